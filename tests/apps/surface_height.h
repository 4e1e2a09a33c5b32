#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/apps/final_state.h"
#include "tests/levelset/cross_sections.h"

namespace scarp {

/// Where the surface lies at x, in nm.
inline double height_at(const std::vector<Polyline>& lines, double x) {
  double z = NAN;
  for (const Polyline& line : lines) {
    for (std::size_t p = 0; p + 1 < line.points.size(); ++p) {
      const auto& [xa, za] = line.points[p];
      const auto& [xb, zb] = line.points[p + 1];
      if ((xa < x) == (xb < x)) continue;
      const double here = za + (x - xa) / (xb - xa) * (zb - za);
      z = std::isnan(z) ? here : std::max(z, here);
    }
  }
  return z;
}

/// In the plane y = 0.
inline std::vector<Polyline> surface_after(const Recipe& recipe) {
  return cross_section(final_state(recipe).layers, 1, 0.0).back();
}

}  // namespace scarp
