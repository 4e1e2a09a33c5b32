#include "mesh/simplify/closed_overlay.h"

#include <algorithm>
#include <cmath>

namespace scarp {

namespace {

/// How far beyond its ends an edge counts as crossed, in its lengths: rounding may put a crossing
/// at an end there.
constexpr double slack = 1e-9;

/// The best of the lanes so far.
struct PlaceLanes {
  DoubleLanes inside = all_lanes(-1e300);
  DoubleLanes height = all_lanes(0.0);
  DoubleLanes facet = all_lanes(0.0);

  void offer(DoubleLanes at, DoubleLanes z, DoubleLanes which, DoubleMask counts) {
    const DoubleMask better = counts & (at > inside);
    inside = better ? at : inside;
    height = better ? z : height;
    facet = better ? which : facet;
  }
};

DoubleLanes cross2(DoubleLanes ax, DoubleLanes ay, DoubleLanes bx, DoubleLanes by) {
  return ax * by - ay * bx;
}

}  // namespace

bool ClosedOverlay::lay(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n) {
  project(mesh, star, r, n);
  is_vertex_ = star.dying_count() == 0;
  // An end without facets of its own is no inner vertex of a surface.
  if (is_vertex_ ? at_origin_ < count_ : at_origin_ == 0 || at_origin_ == count_) return false;
  if (!find_places()) return false;
  return is_vertex_ || look_at_dying();
}

void ClosedOverlay::project(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n) {
  const Vec3d other = std::abs(n.x) < 0.6   ? Vec3d{1, 0, 0}
                      : std::abs(n.y) < 0.6 ? Vec3d{0, 1, 0}
                                            : Vec3d{0, 0, 1};
  const Vec3d e = normalized(cross(other, n));
  const Vec3d f = cross(n, e);
  const auto flat = [&](std::uint32_t vertex) {
    const Vec3d a = mesh.r[vertex] - r;
    return Flat{dot(a, e), dot(a, f), dot(a, n)};
  };
  count_ = star.count;
  at_origin_ = 0;
  for (int i = 0; i < count_; ++i) {
    const Flat p = flat(star.ring[i]);
    x_[i] = p.x;
    y_[i] = p.y;
    z_[i] = p.z;
    at_origin_ += star.at_target[i] ? 0 : 1;
  }
  for (int i = count_; i < count_ + 2 * double_lanes; ++i) {
    x_[i] = x_[0];
    y_[i] = y_[0];
    z_[i] = z_[0];
  }
  u_ = flat(star.u);
  v_ = flat(star.v);
}

/// False if a facet is turned over.
bool ClosedOverlay::find_places() {
  PlaceLanes merged;
  PlaceLanes u;
  PlaceLanes v;
  DoubleMask bad{};
  const DoubleLanes one = all_lanes(1.0);
  DoubleLanes number{0, 1};
  for (int i = 0; i < count_; i += double_lanes, number += all_lanes(double{double_lanes})) {
    const DoubleMask counts = number < all_lanes(static_cast<double>(count_));
    const DoubleMask at_v = number >= all_lanes(static_cast<double>(at_origin_));
    const DoubleLanes ax = load(&x_[i]);
    const DoubleLanes ay = load(&y_[i]);
    const DoubleLanes az = load(&z_[i]);
    const DoubleLanes bx = load(&x_[i + 1]);
    const DoubleLanes by = load(&y_[i + 1]);
    const DoubleLanes bz = load(&z_[i + 1]);
    const DoubleLanes cx = at_v ? all_lanes(v_.x) : all_lanes(u_.x);
    const DoubleLanes cy = at_v ? all_lanes(v_.y) : all_lanes(u_.y);
    const DoubleLanes cz = at_v ? all_lanes(v_.z) : all_lanes(u_.z);
    const DoubleLanes area = cross2(ax, ay, bx, by);
    const DoubleLanes old_area = cross2(ax - cx, ay - cy, bx - cx, by - cy);
    bad |= counts & ~((area > all_lanes(0.0)) & (old_area > all_lanes(0.0)));

    const DoubleLanes inverse = 1.0 / area;
    const DoubleLanes old_inverse = 1.0 / old_area;
    const DoubleLanes old_c = area * old_inverse;
    const DoubleLanes old_a = cross2(bx, by, cx, cy) * old_inverse;
    const DoubleLanes old_b = one - old_c - old_a;
    merged.offer(lane_min(old_c, lane_min(old_a, old_b)), old_c * cz + old_a * az + old_b * bz,
                 number, counts);
    const auto offer_new = [&](const Flat& p, PlaceLanes& place) {
      const DoubleLanes px = all_lanes(p.x);
      const DoubleLanes py = all_lanes(p.y);
      const DoubleLanes of_a = cross2(px, py, bx, by) * inverse;
      const DoubleLanes of_b = cross2(ax, ay, px, py) * inverse;
      place.offer(lane_min(lane_min(of_a, of_b), one - of_a - of_b), of_a * az + of_b * bz, number,
                  counts);
    };
    offer_new(u_, u);
    offer_new(v_, v);
  }
  if (any(bad)) return false;
  const auto best = [](const PlaceLanes& lanes) {
    const int lane = lanes.inside[1] > lanes.inside[0] ? 1 : 0;
    return Place{lanes.inside[lane], lanes.height[lane], static_cast<int>(lanes.facet[lane])};
  };
  merged_in_old_ = best(merged);
  u_in_new_ = best(u);
  v_in_new_ = best(v);
  return true;
}

/// The facets that die lie between the last facet of one end and the first of the other. False if
/// one of them is turned over.
bool ClosedOverlay::look_at_dying() {
  const Flat first = ring(0);
  const Flat second = ring(at_origin_);
  const auto area_of = [](const Flat& a, const Flat& b, const Flat& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  };
  const double area_first = area_of(u_, v_, first);
  const double area_second = area_of(v_, u_, second);
  if (!(area_first > 0 && area_second > 0)) return false;
  offer_dying(u_, v_, first, area_first, count_);
  offer_dying(v_, u_, second, area_second, count_ + 1);
  return true;
}

void ClosedOverlay::offer_dying(const Flat& a, const Flat& b, const Flat& c, double area,
                                int facet) {
  const double of_a = (b.x * c.y - b.y * c.x) / area;
  const double of_b = (c.x * a.y - c.y * a.x) / area;
  const double of_c = 1 - of_a - of_b;
  const double inside = std::min({of_a, of_b, of_c});
  if (inside > merged_in_old_.inside) {
    merged_in_old_ = {inside, of_a * a.z + of_b * b.z + of_c * c.z, facet};
  }
}

int ClosedOverlay::old_edges(std::span<const double> old_error, std::span<Edge> edges) const {
  int edge_count = 0;
  const auto add = [&](const Flat& from, const Flat& to, double error_a, double error_b) {
    edges[edge_count++] = {
        from, {to.x - from.x, to.y - from.y, to.z - from.z}, std::max(error_a, error_b)};
  };
  if (is_vertex_) {
    for (int i = 0; i < count_; ++i) {
      add(u_, ring(i), old_error[i == 0 ? count_ - 1 : i - 1], old_error[i]);
    }
    return edge_count;
  }
  const double first_dying = old_error[count_];
  const double second_dying = old_error[count_ + 1];
  for (int i = 0; i <= at_origin_; ++i) {
    add(u_, ring(i), i == 0 ? first_dying : old_error[i - 1],
        i == at_origin_ ? second_dying : old_error[i]);
  }
  for (int i = at_origin_; i <= count_; ++i) {
    add(v_, ring(i), i == at_origin_ ? second_dying : old_error[i - 1],
        i == count_ ? first_dying : old_error[i]);
  }
  add(u_, v_, first_dying, second_dying);
  return edge_count;
}

ClosedOverlay::Spokes ClosedOverlay::cross_spokes(std::span<const Edge> edges) const {
  Spokes spokes;
  const DoubleLanes lower = all_lanes(-slack);
  const DoubleLanes upper = all_lanes(1 + slack);
  const DoubleLanes zero = all_lanes(0.0);
  for (int k = 0; k < count_; k += double_lanes) {
    const DoubleLanes x = load(&x_[k]);
    const DoubleLanes y = load(&y_[k]);
    const DoubleLanes z = load(&z_[k]);
    DoubleLanes difference = zero;
    DoubleLanes error = zero;
    for (const Edge& edge : edges) {
      const DoubleLanes scale = 1.0 / (edge.along.x * y - edge.along.y * x);
      const DoubleLanes s = (edge.from.y * x - edge.from.x * y) * scale;
      const DoubleLanes t = (edge.from.y * edge.along.x - edge.from.x * edge.along.y) * scale;
      // Parallel ones give infinities, or no numbers, and do not cross.
      const DoubleMask cross = (s >= lower) & (s <= upper) & (t >= lower) & (t <= upper);
      const DoubleLanes height = edge.from.z + s * edge.along.z - t * z;
      difference = lane_max(difference, cross ? lane_max(height, -height) : zero);
      error = lane_max(error, cross ? all_lanes(edge.error) : zero);
    }
    store(&spokes.difference[k], difference);
    store(&spokes.error[k], error);
  }
  spokes.difference[count_] = spokes.difference[0];
  spokes.error[count_] = spokes.error[0];
  return spokes;
}

void ClosedOverlay::bound(std::span<const double> old_error, std::span<double> proposed) const {
  std::array<Edge, capacity + 3> edges;
  const int edge_count = old_edges(old_error, edges);
  const Spokes spokes = cross_spokes(std::span(edges).first(edge_count));

  // All new facets meet the old one under the merged vertex; the one over an old end meets all the
  // old facets of that end.
  const double merged_difference = std::abs(merged_in_old_.height);
  const double merged_error = old_error[merged_in_old_.facet];
  const double dying = std::max(old_error[count_], old_error[count_ + 1]);
  const auto split = old_error.begin() + at_origin_;
  const double u_error = std::max(dying, *std::max_element(old_error.begin(), split));
  const double v_error =
      is_vertex_ ? u_error : std::max(dying, *std::max_element(split, old_error.begin() + count_));
  for (int i = 0; i < count_; ++i) {
    double error = std::max({merged_error, old_error[i], spokes.error[i], spokes.error[i + 1]});
    double difference =
        std::max({merged_difference, spokes.difference[i], spokes.difference[i + 1]});
    if (i == u_in_new_.facet) {
      error = std::max(error, u_error);
      difference = std::max(difference, std::abs(u_in_new_.height - u_.z));
    }
    if (i == v_in_new_.facet) {
      error = std::max(error, v_error);
      difference = std::max(difference, std::abs(v_in_new_.height - v_.z));
    }
    proposed[i] = error + difference;
  }
}

}  // namespace scarp
