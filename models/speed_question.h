#pragma once

#include <span>
#include <vector>

#include "models/surface_model.h"

namespace scarp {

/// The contributions of some tallies to the speeds of points.
struct Contribution {
  std::vector<float> rise;  ///< by how much each changes with the logarithm of what they count
  std::vector<float> all;   ///< what there would not be without it
};

/// A model, points and what arrives there: asked what it would say if less or more arrived.
///
/// Shape: as of SurfaceModel::speeds.
struct SpeedQuestion {
  const SurfaceModel& model;
  const SurfacePoints& points;
  std::span<const std::span<const float>> flux;
  std::vector<float> speeds = model.speeds(points, flux);

  /// What of the speeds goes if the nth of some tallies counts count(n, point).
  template <class Count>
  std::vector<float> loss_with(const Count& count, std::span<const std::size_t> tallies) const {
    std::vector<std::vector<float>> changed(tallies.size(), std::vector<float>(speeds.size()));
    std::vector<std::span<const float>> views(flux.begin(), flux.end());
    for (std::size_t n = 0; n < tallies.size(); ++n) {
      for (std::size_t p = 0; p < speeds.size(); ++p) changed[n][p] = count(n, p);
      views[tallies[n]] = changed[n];
    }
    std::vector<float> lost = model.speeds(points, views);
    for (std::size_t p = 0; p < lost.size(); ++p) lost[p] = speeds[p] - lost[p];
    return lost;
  }

  /// The same if they all count less by a part.
  std::vector<float> loss(float less, std::span<const std::size_t> tallies) const {
    return loss_with([&](std::size_t n, std::size_t p) { return (1 - less) * flux[tallies[n]][p]; },
                     tallies);
  }

  Contribution contribution_of(std::span<const std::size_t> tallies) const {
    constexpr float less = 0.01F;
    Contribution contribution{.rise = loss(less, tallies), .all = loss(1, tallies)};
    for (float& rise : contribution.rise) rise /= less;
    return contribution;
  }
};

}  // namespace scarp
