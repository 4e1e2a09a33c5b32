#include "mesh/simplify/curvature.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 2048;

/// A value of Gaussian noise is below this many medians of its modulus in 99.95 % of all cases.
constexpr double medians_of_noise = 5.2;

/// How many mean edge lengths the radius of an edge may have that is still a feature.
constexpr double feature_radius = 8;

/// What a facet adds to the curvature of its vertices.
struct FacetShares {
  std::array<float, 3> area{};  ///< parts of the facet that belong to its corners
  float per_length = 0;         ///< the inverse of twice its area
};

FacetShares shares_of(const CollapseMesh& mesh, std::uint32_t f) {
  const double twice_area = length(mesh.normals[f]);
  // Of the edge opposite to each corner.
  const std::array<double, 3> square{mesh.squared_length(3 * f + 1), mesh.squared_length(3 * f + 2),
                                     mesh.squared_length(3 * f)};
  // A facet without a height has no angles; it carries no area either.
  if (twice_area <= 1e-9 * std::max({square[0], square[1], square[2]})) return {};
  FacetShares shares{.per_length = static_cast<float>(1 / twice_area)};
  const double sum = square[0] + square[1] + square[2];
  // Cotangents, times four times the area.
  const auto cot = [&](int i) { return sum - 2 * square[i]; };
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    double area = 0;
    if (cot(i) < 0) {
      area = twice_area / 4;
    } else if (cot(j) < 0 || cot(k) < 0) {
      area = twice_area / 8;
    } else {
      area = (square[j] * cot(j) + square[k] * cot(k)) / (16 * twice_area);
    }
    shares.area[i] = static_cast<float>(area);
  }
  return shares;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Of some facets, which stand for all.
double mean_edge_length(const CollapseMesh& mesh) {
  struct Lengths {
    double sum = 0;
    std::size_t count = 0;
  };
  const std::uint32_t stride = mesh.stride_of_sample();
  const auto of_range = [&mesh, stride](std::size_t begin, std::size_t end) {
    Lengths lengths;
    for (auto f = static_cast<std::uint32_t>(begin); f < end; f += stride) {
      if (!mesh.topology.alive(f)) continue;
      for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
        if (!mesh.topology.is_edge(h)) continue;
        lengths.sum += std::sqrt(mesh.squared_length(h));
        ++lengths.count;
      }
    }
    return lengths;
  };
  const Lengths all = parallel_reduce(mesh.normals.size(), grain, Lengths{}, of_range,
                                      [](Lengths a, const Lengths& b) {
                                        return Lengths{a.sum + b.sum, a.count + b.count};
                                      });
  return all.count > 0 ? all.sum / static_cast<double>(all.count) : 0;
}

}  // namespace

std::vector<double> mean_curvature(const CollapseMesh& mesh) {
  const HalfEdges& topology = mesh.topology;
  std::vector<FacetShares> shares(mesh.normals.size());
  parallel_for(shares.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto f = static_cast<std::uint32_t>(begin); f < end; ++f) {
      if (topology.alive(f)) shares[f] = shares_of(mesh, f);
    }
  });
  std::vector<double> curvature(topology.vertex_count(), 0);
  parallel_for(curvature.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      if (topology.outgoing(v) == HalfEdges::none) continue;
      Vec3d laplacian;
      Vec3d normal;
      double area = 0;
      topology.for_each_outgoing(v, [&](std::uint32_t h) {
        const std::uint32_t f = HalfEdges::facet(h);
        const Vec3d n = mesh.normals[f];
        // The cotangents of the other two angles times their opposite edges, as one product.
        const Vec3d opposite = mesh.r[topology.apex(h)] - mesh.r[topology.target(h)];
        laplacian += double{shares[f].per_length} * cross(n, opposite);
        area += double{shares[f].area[h - 3 * f]};
        normal += n;
      });
      // Behind a side lies the mirror image: what points through the side cancels, all else
      // doubles, area included.
      laplacian = along_sides(mesh.sides[v], laplacian);
      normal = along_sides(mesh.sides[v], normal);
      const bool open = topology.on_boundary(v) && mesh.sides[v] == 0;
      if (open || !(area > 0)) continue;
      // 2 H n is the sum over the neighbours of both their cotangents, over twice the area.
      curvature[v] = dot(laplacian, normalized(normal)) / (4 * area);
    }
  });
  return curvature;
}

std::vector<double> smoothed(std::span<const double> values, const HalfEdges& half_edges) {
  std::vector<double> result(values.size());
  parallel_for(values.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      double sum = values[v];
      int count = 1;
      half_edges.for_each_neighbour(v, [&](std::uint32_t w) {
        sum += values[w];
        ++count;
      });
      result[v] = sum / count;
    }
  });
  return result;
}

double feature_threshold(std::span<const double> curvature, const CollapseMesh& mesh) {
  const std::vector<double> mean = smoothed(curvature, mesh.topology);
  std::vector<double> deviation(curvature.size());
  for (std::size_t v = 0; v < deviation.size(); ++v) {
    deviation[v] = std::abs(curvature[v] - mean[v]);
  }
  const double edge = mean_edge_length(mesh);
  const double floor = edge > 0 ? 1 / (2 * feature_radius * edge) : 0;
  return std::max(floor, medians_of_noise * median(std::move(deviation)));
}

}  // namespace scarp
