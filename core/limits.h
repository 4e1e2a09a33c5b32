#pragma once

#include <limits>
#include <string_view>

namespace scarp {

/// What a value may be, said once where it is read.
///
/// Units: minimum and maximum in the unit of the inside; fallback as a recipe writes it ("0 deg",
/// "0.1"), empty when the key has to be given.
struct Limits {
  std::string_view fallback{};
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  bool exclusive = false;  ///< minimum and maximum themselves are not allowed
};

/// No number of a recipe is beyond it, in the units of the inside: sums and products overflow
/// there.
inline constexpr double largest_number = 1e30;

}  // namespace scarp
