#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/running_statistics.h"
#include "flux/flux_field.h"

namespace scarp::exact {

/// Values and their stated errors on some places, facets or patches, from one run. Places without
/// an error are left out.
struct Stated {
  std::vector<double> value;
  std::vector<double> error;
};

inline Stated on_facets(const Tally& tally) {
  return {{tally.mean.begin(), tally.mean.end()}, {tally.std_error.begin(), tally.std_error.end()}};
}

inline Stated on_patches(const Tally& tally) {
  return {{tally.patch_mean.begin(), tally.patch_mean.end()},
          {tally.patch_std_error.begin(), tally.patch_std_error.end()}};
}

inline Stated at_places(const Stated& all, const std::vector<std::size_t>& places) {
  Stated some;
  for (const std::size_t place : places) {
    some.value.push_back(all.value[place]);
    some.error.push_back(all.error[place]);
  }
  return some;
}

/// How z = (value - reference) / error is distributed over places and runs with independent seeds:
/// errors are true if its mean is 0 and its standard deviation 1.
///
/// Places of one run may be off together, so that only runs count for how well the two are known.
struct Calibration {
  double mean = 0;
  double mean_error = 0;
  double deviation = 0;
  double deviation_error = 0;
};

/// Without a reference it is the mean of all runs.
inline Calibration calibration_of(const std::vector<Stated>& runs,
                                  std::vector<double> reference = {}) {
  const auto n = static_cast<double>(runs.size());
  double shrunk = 1;  // by a reference that follows the runs
  if (reference.empty()) {
    shrunk = std::sqrt(1 - 1 / n);
    reference.resize(runs.front().value.size());
    for (const Stated& run : runs)
      for (std::size_t k = 0; k < reference.size(); ++k) reference[k] += run.value[k] / n;
  }
  RunningStatistics means;
  RunningStatistics squares;
  for (const Stated& run : runs) {
    RunningStatistics mean;
    RunningStatistics square;
    for (std::size_t k = 0; k < reference.size(); ++k) {
      if (run.error[k] == 0) continue;
      const double z = (run.value[k] - reference[k]) / (run.error[k] * shrunk);
      mean.add(z);
      square.add(z * z);
    }
    means.add(mean.mean());
    squares.add(square.mean());
  }
  const double deviation = std::sqrt(squares.mean() - means.mean() * means.mean());
  return {.mean = means.mean(),
          .mean_error = means.std_error(),
          .deviation = deviation,
          .deviation_error = squares.std_error() / (2 * deviation)};
}

/// Expects true errors, as far as the runs can tell; they have to tell a tenth.
///
/// An error that is itself the spread of 32 samples makes a standard deviation of 1.03: that of
/// Student's t. Values and errors that rise together shift the mean.
inline void expect_true(const Calibration& c, const std::string& of_what) {
  EXPECT_LT(c.deviation_error, 0.05) << of_what << ": too few runs";
  EXPECT_GT(c.deviation + 4 * c.deviation_error, 0.95) << of_what;
  EXPECT_LT(c.deviation - 4 * c.deviation_error, 1.10) << of_what;
  EXPECT_LT(std::abs(c.mean) - 4 * c.mean_error, 0.05) << of_what;
}

}  // namespace scarp::exact
