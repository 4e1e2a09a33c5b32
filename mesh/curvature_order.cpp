#include "mesh/curvature_order.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "mesh/facet_shape.h"

namespace scarp {

namespace {

/// Estimates are taken a little too low: one that is too low is corrected, one that is too high
/// comes too late.
constexpr double optimism = 0.5;

constexpr std::size_t grain = 4096;

/// The facets between a place and a ring around it. In single precision and in one array per
/// coordinate, so that several are measured at once.
struct Spokes {
  static constexpr int capacity = 64;

  explicit Spokes(Vec3d r) : centre(r) {}

  Vec3d centre;
  int count = 0;
  float x[capacity];  ///< from the centre to the ring
  float y[capacity];
  float z[capacity];

  /// Those beyond the capacity are left out: an edge with so many is not collapsed.
  void add(Vec3d r) {
    if (count == capacity) return;
    const Vec3f spoke(r - centre);
    x[count] = spoke.x;
    y[count] = spoke.y;
    z[count] = spoke.z;
    ++count;
  }

  struct Sums {
    float twice_area = 0;
    float shape = 0;  ///< of facet_shape()
  };
  Sums sums() const {
    constexpr float equal_sides = 3.4641016F;  // 2 sqrt(3)
    constexpr float tiny = 1e-30F;
    float twice_area[capacity];
    float shape[capacity];
    for (int i = 0; i + 1 < count; ++i) {
      const Vec3f a{x[i], y[i], z[i]};
      const Vec3f b{x[i + 1], y[i + 1], z[i + 1]};
      const Vec3f n = cross(a, b);
      const Vec3f side = b - a;
      twice_area[i] = std::sqrt(dot(n, n));
      const float squares = dot(a, a) + dot(b, b) + dot(side, side);
      shape[i] = 1 - equal_sides * twice_area[i] / std::max(squares, tiny);
    }
    Sums sums;
    for (int i = 0; i + 1 < count; ++i) {
      sums.twice_area += twice_area[i];
      sums.shape += shape[i];
    }
    return sums;
  }
};

}  // namespace

CurvatureOrder::CurvatureOrder(const CollapseMesh& mesh, TrackedPoints& points, EdgeSizes sizes,
                               double shape_weight)
    : points_(points), sizes_(std::move(sizes)), shape_weight_(shape_weight) {
  const double twice_area = parallel_reduce(
      mesh.normals.size(), grain, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t f = begin; f < end; ++f) sum += length(mesh.normals[f]);
        return sum;
      },
      [](double a, double b) { return a + b; });
  // The height of the next surface over a facet falls from h at one corner to 0 at the others; its
  // mean square is h^2 / 6. The cost has h^2 times twice the area.
  points_per_area_ = twice_area > 0 ? mesh.live_vertices / twice_area : 0;
  points_per_cost_ = optimism * points_per_area_ / 6;
  if (shape_weight_ > 0) find_shapes(mesh);
}

void CurvatureOrder::find_shapes(const CollapseMesh& mesh) {
  const HalfEdges& topology = mesh.topology;
  shapes_.resize(mesh.normals.size());
  parallel_for(shapes_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto f = static_cast<std::uint32_t>(begin); f < end; ++f) {
      if (!topology.alive(f)) continue;
      shapes_[f] = static_cast<float>(
          facet_shape(mesh.r[topology.origin(3 * f)], mesh.r[topology.origin(3 * f + 1)],
                      mesh.r[topology.origin(3 * f + 2)], mesh.normals[f]));
    }
  });
}

double CurvatureOrder::key(const CollapseMesh& mesh, std::uint32_t h, const Placed& placed,
                           double squared_length) const {
  double key = points_per_cost_ * placed.cost;
  if (!shapes_.empty()) {
    key += shape_weight_ * shape_estimate(mesh, h, placed.r);
    const std::uint32_t t = mesh.twin_edge(h);
    if (t != HalfEdges::none) {
      key += shape_weight_ * shape_estimate(mesh, t, mesh.twin_place(h, placed.r));
    }
  }
  if (!(key > 0)) return key;
  return key * sizes_.stretch(mesh.topology.origin(h), mesh.topology.target(h), squared_length);
}

double CurvatureOrder::shape_estimate(const CollapseMesh& mesh, std::uint32_t h, Vec3d r) const {
  const HalfEdges& topology = mesh.topology;
  const std::uint32_t o = topology.opposite(h);
  Spokes spokes(r);
  float old_shapes = shapes_[HalfEdges::facet(h)];
  if (o != HalfEdges::none) old_shapes += shapes_[HalfEdges::facet(o)];
  if (o == HalfEdges::none || topology.on_boundary(topology.origin(h)) ||
      topology.on_boundary(topology.target(h))) {
    Star star;
    if (!star.gather(topology, h) || star.count == 0) return 0;
    for (int i = 0; i <= star.count; ++i) spokes.add(mesh.r[star.ring[i]]);
    for (int i = 0; i < star.count; ++i) old_shapes += shapes_[star.facet[i]];
  } else {
    // As Star, which also knows boundaries: from one facet of the edge to the other and back.
    const auto add = [&](std::uint32_t from, std::uint32_t to) {
      const auto turned = [&](std::uint32_t g) {
        return topology.opposite(HalfEdges::previous(g));
      };
      for (std::uint32_t g = turned(from); HalfEdges::facet(g) != to; g = turned(g)) {
        spokes.add(mesh.r[topology.target(g)]);
        old_shapes += shapes_[HalfEdges::facet(g)];
      }
    };
    add(h, HalfEdges::facet(o));
    add(o, HalfEdges::facet(h));
    spokes.add(mesh.r[topology.apex(h)]);
  }
  const Spokes::Sums sums = spokes.sums();
  const int old_count = spokes.count - 1 + (o == HalfEdges::none ? 1 : 2);
  return points_per_area_ * sums.twice_area / old_count * (sums.shape - old_shapes);
}

double CurvatureOrder::exact_key(const CollapseMesh& mesh, const CollapseChecks& checks) const {
  const Star& star = checks.star();
  double key = points_.growth(star, checks.fan(mesh));
  if (!shapes_.empty()) {
    key += shape_weight_ * points_.per_facet(star) * exact_shapes(mesh, checks);
  }
  if (!(key > 0)) return key;
  const Vec3d edge = mesh.r[star.v] - mesh.r[star.u];
  return key * sizes_.stretch(star.u, star.v, dot(edge, edge));
}

double CurvatureOrder::new_shape(const CollapseMesh& mesh, const CollapseChecks& checks, int i) {
  const Star& star = checks.star();
  return facet_shape(checks.place(), mesh.r[star.ring[i]], mesh.r[star.ring[i + 1]],
                     checks.normals()[i]);
}

double CurvatureOrder::exact_shapes(const CollapseMesh& mesh, const CollapseChecks& checks) const {
  const Star& star = checks.star();
  double growth = 0;
  for (int i = 0; i < star.count; ++i) {
    growth += new_shape(mesh, checks, i) - double{shapes_[star.facet[i]]};
  }
  for (int i = 0; i < star.dying_count(); ++i) growth -= double{shapes_[star.dying[i]]};
  return growth;
}

void CurvatureOrder::accept(const CollapseMesh& mesh, const CollapseChecks& checks) {
  points_.move(checks.star(), checks.fan(mesh));
  if (shapes_.empty()) return;
  for (int i = 0; i < checks.star().count; ++i) {
    shapes_[checks.star().facet[i]] = static_cast<float>(new_shape(mesh, checks, i));
  }
}

}  // namespace scarp
