#include "mesh/simplify/tracked_points.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "core/triangle_tree.h"

namespace scarp {

namespace {

template <class Visit>
void for_each_old_facet(const Star& star, const Visit& visit) {
  for (int i = 0; i < star.count; ++i) visit(star.facet[i]);
  for (const std::uint32_t f : star.dying) {
    if (f != HalfEdges::none) visit(f);
  }
}

double squared(double a) { return a * a; }

Fan::Nearest nearest_on(const CollapseMesh& mesh, std::uint32_t f, Vec3d p) {
  const HalfEdges& topology = mesh.topology;
  const std::array<Vec3d, 3> corners{mesh.r[topology.origin(3 * f)],
                                     mesh.r[topology.origin(3 * f + 1)],
                                     mesh.r[topology.origin(3 * f + 2)]};
  return {f, squared(closest_on_triangle(p, corners).distance)};
}

/// The half edge that p lies furthest beyond, seen along the normal of a facet; none if p lies over
/// the facet.
std::uint32_t edge_beyond(const CollapseMesh& mesh, std::uint32_t f, Vec3d p) {
  const Vec3d n = mesh.normals[f];
  std::uint32_t beyond = HalfEdges::none;
  double lowest = 0;
  for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
    const Vec3d r = mesh.r[mesh.topology.origin(h)];
    const double weight = dot(cross(mesh.r[mesh.topology.target(h)] - r, p - r), n);
    if (weight < lowest) {
      lowest = weight;
      beyond = h;
    }
  }
  return beyond;
}

/// The nearest of the facets around a vertex and one other.
Fan::Nearest nearest_around(const CollapseMesh& mesh, std::uint32_t v, std::uint32_t f, Vec3d p) {
  Fan::Nearest nearest = nearest_on(mesh, f, p);
  mesh.topology.for_each_outgoing(v, [&](std::uint32_t h) {
    const Fan::Nearest other = nearest_on(mesh, HalfEdges::facet(h), p);
    if (other.squared_distance < nearest.squared_distance) nearest = other;
  });
  return nearest;
}

/// The same with the facets around the neighbours of the vertex.
Fan::Nearest nearest_in_two_rings(const CollapseMesh& mesh, std::uint32_t v, std::uint32_t f,
                                  Vec3d p) {
  Fan::Nearest nearest = nearest_around(mesh, v, f, p);
  mesh.topology.for_each_neighbour(v, [&](std::uint32_t w) {
    const Fan::Nearest other = nearest_around(mesh, w, f, p);
    if (other.squared_distance < nearest.squared_distance) nearest = other;
  });
  return nearest;
}

/// The facet that p lies over, by a walk from v over edges that p lies beyond.
Fan::Nearest walk(const CollapseMesh& mesh, std::uint32_t v, Vec3d p) {
  constexpr int most_steps = 16;
  std::uint32_t f = HalfEdges::facet(mesh.topology.outgoing(v));
  if (p == mesh.r[v]) return {f, 0};
  std::uint32_t before = HalfEdges::none;
  for (int step = 0; step < most_steps; ++step) {
    const std::uint32_t h = edge_beyond(mesh, f, p);
    if (h == HalfEdges::none) {
      const Vec3d n = mesh.normals[f];
      const double height = dot(n, p - mesh.r[mesh.topology.origin(3 * f)]);
      return {f, height * height / dot(n, n)};
    }
    const std::uint32_t across = mesh.topology.opposite(h);
    // Along a ridge p lies over neither of the two facets.
    if (across == HalfEdges::none || HalfEdges::facet(across) == before) break;
    before = f;
    f = HalfEdges::facet(across);
  }
  Fan::Nearest nearest = nearest_around(mesh, v, f, p);
  if (before != HalfEdges::none) {
    const Fan::Nearest other = nearest_on(mesh, before, p);
    if (other.squared_distance < nearest.squared_distance) nearest = other;
  }
  return nearest;
}

}  // namespace

void Fan::spread(const CollapseMesh& mesh, const Star& star, Vec3d r,
                 std::span<const Vec3d> normals) {
  mesh_ = &mesh;
  star_ = &star;
  r_ = r;
  axis_ = {};
  has_found_ = false;
  spoke_[0] = mesh.r[star.ring[0]] - r;
  for (int i = 0; i < star.count; ++i) {
    const Vec3d n = normals[i];
    spoke_[i + 1] = mesh.r[star.ring[i + 1]] - r;
    axis_ += n;
    normal_[i] = n;
    square_[i] = dot(n, n);
    to_first_[i] = cross(spoke_[i + 1], n);
    to_second_[i] = cross(n, spoke_[i]);
  }
}

/// The facet in whose sector d lies when seen along the mean normal; -1: none.
int Fan::sector(Vec3d d) const {
  const Vec3d along = cross(d, axis_);
  double left = dot(spoke_[0], along);
  for (int i = 0; i < star_->count; ++i) {
    const double after = dot(spoke_[i + 1], along);
    if (left >= 0 && after < 0) return i;
    left = after;
  }
  return -1;
}

/// Whether the point of the plane of facet i that is nearest to d lies in the facet.
bool Fan::is_over(int i, Vec3d d) const {
  const double first = dot(to_first_[i], d);
  const double second = dot(to_second_[i], d);
  return first >= 0 && second >= 0 && first + second <= square_[i];
}

Fan::Nearest Fan::over(int i, Vec3d d) const {
  const double height = dot(normal_[i], d);
  return {star_->facet[i], height * height / square_[i]};
}

Fan::Nearest Fan::nearest(Vec3d p, int likely) const {
  const Vec3d d = p - r_;
  if (likely >= 0 && is_over(likely, d)) return over(likely, d);
  const int i = sector(d);
  if (i >= 0 && is_over(i, d)) return over(i, d);
  // Seen in the sector of a facet it is near that one or those beside it.
  const int count = star_->count;
  const bool is_inside = i >= 0 && star_->closed && count > 3;
  return is_inside ? nearest_of(i > 0 ? i - 1 : count - 1, 3, d) : nearest_of(0, count, d);
}

/// Of `count` facets from `first` on and those behind their rims; d: from the centre.
Fan::Nearest Fan::nearest_of(int first, int count, Vec3d d) const {
  Nearest nearest;
  const auto look_at = [&](std::uint32_t f, const std::array<Vec3d, 3>& corners) {
    const double square = squared(closest_on_triangle(d, corners).distance);
    if (square < nearest.squared_distance) nearest = {f, square};
  };
  for (int i = first; i < first + count; ++i) {
    const int k = i < star_->count ? i : i - star_->count;
    look_at(star_->facet[k], {Vec3d{}, spoke_[k], spoke_[k + 1]});
    const std::uint32_t across = mesh_->topology.opposite(star_->rim[k]);
    if (across == HalfEdges::none) continue;
    const Vec3d tip = mesh_->r[mesh_->topology.apex(across)] - r_;
    look_at(HalfEdges::facet(across), {spoke_[k + 1], spoke_[k], tip});
  }
  return nearest;
}

TrackedPoints::TrackedPoints(const CollapseMesh& mesh)
    : places_(mesh.r),
      next_(mesh.r.size(), HalfEdges::none),
      first_(mesh.normals.size(), HalfEdges::none),
      count_(mesh.normals.size(), 0),
      squares_(mesh.normals.size(), 0) {
  for (std::uint32_t v = 0; v < places_.size(); ++v) {
    const std::uint32_t h = mesh.topology.outgoing(v);
    if (h == HalfEdges::none) continue;
    add(v, {HalfEdges::facet(h), 0});
  }
}

TrackedPoints::TrackedPoints(const CollapseMesh& mesh, LargeVector<Vec3d> places,
                             std::span<const std::uint32_t> merged_into, double bound)
    : places_(std::move(places)),
      next_(places_.size(), HalfEdges::none),
      first_(mesh.normals.size(), HalfEdges::none),
      count_(mesh.normals.size(), 0),
      squares_(mesh.normals.size(), 0) {
  std::vector<Fan::Nearest> nearest(places_.size());
  constexpr std::size_t grain = 1024;
  parallel_for(places_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      std::uint32_t last = v;
      while (merged_into[last] != last) last = merged_into[last];
      if (mesh.topology.outgoing(last) == HalfEdges::none) continue;
      nearest[v] = walk(mesh, last, places_[v]);
      if (nearest[v].squared_distance > bound * bound) {
        nearest[v] = nearest_in_two_rings(mesh, last, nearest[v].facet, places_[v]);
      }
    }
  });
  for (std::uint32_t v = 0; v < places_.size(); ++v) {
    if (nearest[v].facet != HalfEdges::none) add(v, nearest[v]);
  }
}

void TrackedPoints::add(std::uint32_t point, const Fan::Nearest& nearest) {
  const std::uint32_t f = nearest.facet;
  next_[point] = first_[f];
  first_[f] = point;
  ++count_[f];
  squares_[f] += nearest.squared_distance;
}

/// Asks for all points of a star, each from the facet that it belongs to.
void TrackedPoints::find(const Star& star, Fan& fan) const {
  if (fan.has_found_) return;
  fan.has_found_ = true;
  fan.found_.clear();
  const auto find_those_of = [&](std::uint32_t f, int likely) {
    for (std::uint32_t p = first_[f]; p != HalfEdges::none; p = next_[p]) {
      fan.found_.push_back({p, fan.nearest(places_[p], likely)});
    }
  };
  for (int i = 0; i < star.count; ++i) find_those_of(star.facet[i], i);
  for (const std::uint32_t f : star.dying) {
    if (f != HalfEdges::none) find_those_of(f, -1);
  }
}

double TrackedPoints::growth(const Star& star, Fan& fan) const {
  find(star, fan);
  double sum = 0;
  for (const Fan::Found& each : fan.found_) sum += each.nearest.squared_distance;
  return sum - sum_of_squares(star);
}

double TrackedPoints::sum_of_squares(const Star& star) const {
  double sum = 0;
  for_each_old_facet(star, [&](std::uint32_t f) { sum += squares_[f]; });
  return sum;
}

double TrackedPoints::per_facet(const Star& star) const {
  std::uint32_t count = 0;
  for_each_old_facet(star, [&](std::uint32_t f) { count += count_[f]; });
  return static_cast<double>(count) / (star.count + star.dying_count());
}

void TrackedPoints::move(const Star& star, Fan& fan) {
  find(star, fan);
  for_each_old_facet(star, [&](std::uint32_t f) {
    first_[f] = HalfEdges::none;
    count_[f] = 0;
    squares_[f] = 0;
  });
  for (const Fan::Found& each : fan.found_) add(each.point, each.nearest);
}

double TrackedPoints::largest(const CollapseMesh& mesh) const {
  constexpr std::size_t grain = 4096;
  const auto largest_of_range = [&](std::size_t begin, std::size_t end) {
    double largest = 0;
    for (auto f = static_cast<std::uint32_t>(begin); f < end; ++f) {
      // The sum of the squares tells that none of most facets' points is so far away.
      constexpr double rounding = 1 + 1e-6;
      if (first_[f] == HalfEdges::none || squares_[f] * rounding < largest * largest) continue;
      const std::array<Vec3d, 3> corners{mesh.r[mesh.topology.origin(3 * f)],
                                         mesh.r[mesh.topology.origin(3 * f + 1)],
                                         mesh.r[mesh.topology.origin(3 * f + 2)]};
      for_each(f, [&](Vec3d p) {
        largest = std::max(largest, closest_on_triangle(p, corners).distance);
      });
    }
    return largest;
  };
  return parallel_reduce(first_.size(), grain, 0.0, largest_of_range,
                         [](double a, double b) { return std::max(a, b); });
}

}  // namespace scarp
