#include "mesh/curvature.h"

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

/// What one corner of a facet adds to the curvature of its vertex.
struct CornerShare {
  Vec3d laplacian;  ///< sum of cotangent times edge, for the two edges at the corner
  double area = 0;  ///< part of the facet that belongs to the corner
};

/// p: the corner first; twice_area: of the facet.
CornerShare corner_share(const std::array<Vec3d, 3>& p, double twice_area) {
  const Vec3d ab = p[1] - p[0];
  const Vec3d ac = p[2] - p[0];
  const double square_ab = dot(ab, ab);
  const double square_ac = dot(ac, ac);
  const double product = dot(ab, ac);
  const double square_bc = square_ab + square_ac - 2 * product;
  // A facet without a height has no angles; it carries no area either.
  if (twice_area <= 1e-9 * std::max({square_ab, square_ac, square_bc})) return {};
  const double inverse = 1 / twice_area;
  const double cot_a = product * inverse;
  const double cot_b = (square_ab - product) * inverse;
  const double cot_c = (square_ac - product) * inverse;
  // The angle opposite to an edge weighs that edge.
  CornerShare share{.laplacian = -cot_c * ab - cot_b * ac, .area = 0};
  if (cot_a < 0) {
    share.area = twice_area / 4;
  } else if (cot_b < 0 || cot_c < 0) {
    share.area = twice_area / 8;
  } else {
    share.area = (square_ab * cot_c + square_ac * cot_b) / 8;
  }
  return share;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double mean_edge_length(const CollapseMesh& mesh) {
  struct Lengths {
    double sum = 0;
    std::size_t count = 0;
  };
  const auto of_range = [&mesh](std::size_t begin, std::size_t end) {
    Lengths lengths;
    for (auto h = static_cast<std::uint32_t>(begin); h < end; ++h) {
      if (!mesh.topology.alive(HalfEdges::facet(h)) || !mesh.topology.is_edge(h)) continue;
      lengths.sum += std::sqrt(mesh.squared_length(h));
      ++lengths.count;
    }
    return lengths;
  };
  const Lengths all = parallel_reduce(mesh.topology.half_edge_count(), grain, Lengths{}, of_range,
                                      [](Lengths a, const Lengths& b) {
                                        return Lengths{a.sum + b.sum, a.count + b.count};
                                      });
  return all.count > 0 ? all.sum / static_cast<double>(all.count) : 0;
}

}  // namespace

std::vector<double> mean_curvature(const CollapseMesh& mesh) {
  const HalfEdges& topology = mesh.topology;
  std::vector<double> curvature(topology.vertex_count(), 0);
  parallel_for(curvature.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      if (topology.outgoing(v) == HalfEdges::none) continue;
      Vec3d laplacian;
      Vec3d normal;
      double area = 0;
      topology.for_each_outgoing(v, [&](std::uint32_t h) {
        const Vec3d n = mesh.normals[HalfEdges::facet(h)];
        const CornerShare share = corner_share(
            {mesh.r[v], mesh.r[topology.target(h)], mesh.r[topology.apex(h)]}, length(n));
        laplacian += share.laplacian;
        area += share.area;
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
