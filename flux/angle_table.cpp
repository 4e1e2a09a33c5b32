#include "flux/angle_table.h"

namespace scarp {

// Rounded to single precision, in which all versions of the C library agree.
AngleTable::AngleTable(const std::function<double(double theta)>& value) {
  for (int n = 0; n <= interval_count; ++n) {
    const double theta = 2 * std::asin(std::min(n / per_half_sine, std::sqrt(0.5)));
    values_[static_cast<std::size_t>(n)] = static_cast<float>(value(theta));
  }
}

}  // namespace scarp
