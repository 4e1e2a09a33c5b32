#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace scarp::bench {

/// Walls that a beam from above leaves below the edge of a mask that stands on a slope.
struct SlopeWallSettings {
  std::vector<std::string> kinds{};  ///< all without any
  std::vector<double> spacings{10, 5};
  std::vector<double> places{0, 0.25, 0.5, 0.75};
  std::vector<double> slopes{0, 15, 30, 45, 60};
};

/// Their names: which way the film's top rises, seen from the mask's edge.
std::vector<std::string> slope_wall_kinds();

/// How rough walls below a mask on a slope are: the largest distance of a vertex of the wall from
/// where the etch leaves it, by spacing, slope and the place of the mask's edge between nodes.
///
/// Shape: `rows`, one per kind, spacing and slope; `in` and `out` of a wall are below the mask and
///        beyond its edge. Units: nm, degrees; walls and places in spacings.
nlohmann::ordered_json slope_walls(const SlopeWallSettings& settings);

void print_slope_walls(const nlohmann::ordered_json& found);

}  // namespace scarp::bench
