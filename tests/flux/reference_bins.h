#pragma once

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp::exact {

/// A row of tests/reference/flux_*_bins.csv: exact mean flux on a part of the wall or bottom.
struct ReferenceBin {
  double aspect_ratio = 0;
  double sticking = 0;
  std::string surface;  ///< "wall" or "bottom"
  double from = 0;
  double to = 0;
  double flux = 0;
};

inline std::vector<ReferenceBin> reference_bins(const std::string& shape, double aspect_ratio,
                                                double sticking) {
  std::ifstream file(std::string(SCARP_SOURCE_DIR) + "/tests/reference/flux_" + shape +
                     "_bins.csv");
  std::vector<ReferenceBin> bins;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::vector<std::string> cells;
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    const ReferenceBin bin{std::stod(cells[0]), std::stod(cells[1]), cells[2],
                           std::stod(cells[4]), std::stod(cells[5]), std::stod(cells[6])};
    if (bin.aspect_ratio == aspect_ratio && bin.sticking == sticking) bins.push_back(bin);
  }
  return bins;
}

/// The facets of a trench or hole of width 20 that lie in a bin, by centroid.
inline std::vector<std::uint32_t> facets_in(const ReferenceBin& bin, const TriMesh& mesh,
                                            const std::string& shape) {
  constexpr double width = 20;
  const double depth = width * bin.aspect_ratio;
  const std::vector<Vec3f> normals = facet_normals(mesh);
  std::vector<std::uint32_t> facets;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    const Vec3d r = (a + b + c) / 3.0;
    const bool on_wall = std::abs(normals[f].z) < 0.5;
    const bool on_bottom = !on_wall && r.z < -0.5 * depth;
    if ((bin.surface == "wall") != on_wall || (bin.surface == "bottom") != on_bottom) continue;
    const double coordinate = on_wall           ? -r.z / depth
                              : shape == "hole" ? std::hypot(r.x, r.y) / width
                                                : 0.5 - std::abs(r.x) / width;
    if (coordinate > bin.from && coordinate < bin.to) facets.push_back(f);
  }
  return facets;
}

}  // namespace scarp::exact
