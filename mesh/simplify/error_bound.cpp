#include "mesh/simplify/error_bound.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "mesh/simplify/closed_overlay.h"

namespace scarp {

namespace {

constexpr int corner_none = -1;

/// A point seen along the direction of projection. Without values to begin with: stars have room
/// for many.
struct Flat {
  double x;
  double y;
  double z;  ///< height
};

double cross2(const Flat& a, const Flat& b, const Flat& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// A triangle of one of the two height fields.
struct FlatTriangle {
  Flat a, b, c;
  double area;  ///< twice

  FlatTriangle() = default;
  FlatTriangle(const Flat& a_in, const Flat& b_in, const Flat& c_in)
      : a(a_in), b(b_in), c(c_in), area(cross2(a_in, b_in, c_in)) {}

  /// The lowest of the three weights of p, and the height of the triangle there.
  double inside(const Flat& p, double& height) const {
    const double wa = cross2(b, c, p) / area;
    const double wb = cross2(c, a, p) / area;
    const double wc = 1 - wa - wb;
    height = wa * a.z + wb * b.z + wc * c.z;
    return std::min({wa, wb, wc});
  }
};

/// Where two segments cross: their height difference. False if they do not.
bool crossing(const Flat& a, const Flat& b, const Flat& c, const Flat& d, double& difference) {
  constexpr double slack = 1e-9;
  double along = (b.x - a.x) * (d.y - c.y) - (b.y - a.y) * (d.x - c.x);
  double s = (c.x - a.x) * (d.y - c.y) - (c.y - a.y) * (d.x - c.x);
  double t = (c.x - a.x) * (b.y - a.y) - (c.y - a.y) * (b.x - a.x);
  if (along < 0) {
    along = -along;
    s = -s;
    t = -t;
  }
  const double lower = -slack * along;
  const double upper = (1 + slack) * along;
  if (!(along > 0 && s >= lower && s <= upper && t >= lower && t <= upper)) return false;
  s /= along;
  t /= along;
  difference = std::abs(a.z + s * (b.z - a.z) - c.z - t * (d.z - c.z));
  return true;
}

/// The direction along which both surfaces inside the rim of a star are seen as height fields.
Vec3d direction_of(const CollapseMesh& mesh, const Star& star) {
  Vec3d n;
  for (int i = 0; i < star.count; ++i) n += mesh.normals[star.facet[i]];
  for (const std::uint32_t f : star.dying) {
    if (f != HalfEdges::none) n += mesh.normals[f];
  }
  // Both surfaces end on the same side, so it has to be seen as a line.
  const auto both = static_cast<SideMask>(mesh.sides[star.u] | mesh.sides[star.v]);
  return normalized(along_sides(both, n));
}

/// Whether the boundary of the star lies on sides. An open boundary elsewhere may change its
/// course, and with it what the surfaces cover.
bool ends_on_side(const CollapseMesh& mesh, const Star& star) {
  const HalfEdges& topology = mesh.topology;
  for (const std::uint32_t v : {star.u, star.v}) {
    if (!topology.on_boundary(v)) continue;
    const std::uint32_t first = topology.outgoing(v);
    std::uint32_t last = first;
    topology.for_each_outgoing(v, [&](std::uint32_t h) { last = h; });
    if ((mesh.sides[v] & mesh.sides[topology.target(first)]) == 0 ||
        (mesh.sides[v] & mesh.sides[topology.apex(last)]) == 0) {
      return false;
    }
  }
  return true;
}

/// Whether facet i of a star can be seen along n, as it is and with the centre of the star at r.
bool faces_along(const CollapseMesh& mesh, const Star& star, int i, Vec3d r, Vec3d n) {
  const Vec3d x = mesh.r[star.ring[i]] - r;
  const Vec3d y = mesh.r[star.ring[i + 1]] - r;
  return dot(cross(x, y), n) > 0 && dot(mesh.normals[star.facet[i]], n) > 0;
}

/// The range of the heights of both surfaces along n, which no height difference exceeds; nothing
/// if one of them is no height field.
std::optional<double> thickness(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n) {
  if (!star.closed && !ends_on_side(mesh, star)) return {};
  for (const std::uint32_t f : star.dying) {
    if (f != HalfEdges::none && !(dot(mesh.normals[f], n) > 0)) return {};
  }
  double lowest = 0;
  double highest = 0;
  const auto add = [&](Vec3d spoke) {
    const double height = dot(spoke, n);
    lowest = std::min(lowest, height);
    highest = std::max(highest, height);
  };
  for (int i = 0; i < star.count; ++i) {
    if (!faces_along(mesh, star, i, r, n)) return {};
    add(mesh.r[star.ring[i]] - r);
    add(mesh.r[star.ring[i + 1]] - r);
  }
  add(mesh.r[star.u] - r);
  add(mesh.r[star.v] - r);
  return highest - lowest;
}

/// The two surfaces inside the rim of a star, as height fields over one plane.
class Overlay {
 public:
  Overlay(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n)
      : star_(star), n_(n), origin_(r) {
    const Vec3d other = std::abs(n_.x) < 0.6   ? Vec3d{1, 0, 0}
                        : std::abs(n_.y) < 0.6 ? Vec3d{0, 1, 0}
                                               : Vec3d{0, 0, 1};
    x_ = normalized(cross(other, n_));
    y_ = cross(n_, x_);
    merged_ = {0, 0, 0};
    u_ = flat(mesh.r[star.u]);
    v_ = flat(mesh.r[star.v]);
    for (int i = 0; i <= star.count; ++i) ring_[i] = flat(mesh.r[star.ring[i]]);
    for (int i = 0; i < star.count; ++i) {
      old_[i] = {star.at_target[i] ? v_ : u_, ring_[i], ring_[i + 1]};
      new_[i] = {merged_, ring_[i], ring_[i + 1]};
    }
    old_count_ = star.count;
    for (const std::uint32_t f : star.dying) {
      if (f == HalfEdges::none) continue;
      old_[old_count_++] = {flat(mesh.r[mesh.topology.origin(3 * f)]),
                            flat(mesh.r[mesh.topology.origin(3 * f + 1)]),
                            flat(mesh.r[mesh.topology.origin(3 * f + 2)])};
    }
  }

  int old_count() const { return old_count_; }

  /// Whether both surfaces cover the same part of the plane, once.
  bool is_height_field(const CollapseMesh& mesh) const {
    if (!star_.closed && !ends_on_side(mesh, star_)) return false;
    for (int i = 0; i < old_count_; ++i) {
      if (!(old_[i].area > 0)) return false;
    }
    for (int i = 0; i < star_.count; ++i) {
      if (!(new_[i].area > 0)) return false;
    }
    return true;
  }

  /// Calls meet(new facet, old facet, height difference) at every vertex of the overlay, for every
  /// pair of facets that meets there.
  template <class Meet>
  void visit(const Meet& meet) const {
    for (int i = 0; i < star_.count; ++i) meet(i, i, 0.0);
    visit_merged(meet);
    visit_old_end(u_, false, meet);
    visit_old_end(v_, true, meet);
    visit_crossings(meet);
  }

 private:
  Flat flat(Vec3d r) const {
    const Vec3d a = r - origin_;
    return {dot(a, x_), dot(a, y_), dot(a, n_)};
  }

  /// The triangle that p lies in, or the one it is least outside of.
  template <std::size_t N>
  static int locate(const Flat& p, const std::array<FlatTriangle, N>& triangles, int count,
                    double& height) {
    int best = corner_none;
    double best_inside = -1e300;
    for (int i = 0; i < count; ++i) {
      double z = 0;
      const double inside = triangles[i].inside(p, z);
      if (inside > best_inside) {
        best_inside = inside;
        best = i;
        height = z;
      }
    }
    return best;
  }

  template <class Meet>
  void visit_merged(const Meet& meet) const {
    double height = 0;
    const int old = locate(merged_, old_, old_count_, height);
    for (int i = 0; i < star_.count; ++i) meet(i, old, std::abs(height));
  }

  template <class Meet>
  void visit_old_end(const Flat& end, bool target, const Meet& meet) const {
    double height = 0;
    const int inside = locate(end, new_, star_.count, height);
    const double difference = std::abs(height - end.z);
    for (int i = 0; i < old_count_; ++i) {
      if (i >= star_.count || star_.at_target[i] == target) meet(inside, i, difference);
    }
  }

  template <class Meet>
  void visit_crossings(const Meet& meet) const {
    // Old inner edges: from a corner to the ring vertex between two facets, and the edge itself.
    const int inner = star_.closed ? star_.count : star_.count - 1;
    const int first_dying = star_.count;
    for (int j = 0; j < inner; ++j) {
      const int after = j + 1 == star_.count ? 0 : j + 1;
      if (star_.at_target[j] == star_.at_target[after]) {
        cross_spokes(old_[j].a, ring_[j + 1], j, after, meet);
        continue;
      }
      // A dying facet lies between the two; either may be it.
      for (int dying = first_dying; dying < old_count_; ++dying) {
        cross_spokes(old_[j].a, ring_[j + 1], j, dying, meet);
        cross_spokes(old_[after].a, ring_[j + 1], after, dying, meet);
      }
    }
    // An open star may begin or end with a dying facet.
    if (!star_.closed) {
      const int last = star_.count - 1;
      for (int dying = first_dying; dying < old_count_; ++dying) {
        cross_spokes(old_[0].a, ring_[0], 0, dying, meet);
        cross_spokes(old_[last].a, ring_[star_.count], last, dying, meet);
      }
    }
    cross_spokes(u_, v_, first_dying, old_count_ - 1, meet);
  }

  template <class Meet>
  void cross_spokes(const Flat& a, const Flat& b, int old_left, int old_right,
                    const Meet& meet) const {
    const int spokes = star_.closed ? star_.count : star_.count + 1;
    for (int k = 0; k < spokes; ++k) {
      double difference = 0;
      if (!crossing(a, b, merged_, ring_[k], difference)) continue;
      const int left = k < star_.count ? k : star_.count - 1;
      const int right = k > 0 ? k - 1 : star_.closed ? star_.count - 1 : 0;
      for (const int i : {left, right}) {
        meet(i, old_left, difference);
        meet(i, old_right, difference);
      }
    }
  }

  const Star& star_;
  Vec3d n_;
  Vec3d origin_;
  Vec3d x_;
  Vec3d y_;
  Flat merged_;
  Flat u_;
  Flat v_;
  std::array<Flat, Star::capacity + 1> ring_;
  std::array<FlatTriangle, Star::capacity + 2> old_;
  std::array<FlatTriangle, Star::capacity> new_;
  int old_count_ = 0;
};

}  // namespace

bool ErrorBound::allows(const CollapseMesh& mesh, const Star& star, Vec3d r) {
  const auto old_error = [&](int i) {
    return i < star.count ? error_[star.facet[i]] : error_[star.dying[i - star.count]];
  };
  // Whatever the shape: the surface moves linearly with its vertices.
  const double shift = std::max(length(r - mesh.r[star.u]), length(r - mesh.r[star.v]));
  double largest_old = 0;
  const int old_count = star.count + star.dying_count();
  for (int i = 0; i < old_count; ++i) largest_old = std::max(largest_old, old_error(i));
  if (largest_old == kept) return false;
  const double simple = largest_old + shift;
  if (simple <= limit_.rough) {
    std::fill_n(proposed_.begin(), star.count, simple);
    return true;
  }

  const Vec3d n = direction_of(mesh, star);
  if (largest_old < limit_.rough) {
    const std::optional<double> slab = thickness(mesh, star, r, n);
    if (slab && largest_old + *slab <= limit_.rough) {
      std::fill_n(proposed_.begin(), star.count, std::min(simple, largest_old + *slab));
      return true;
    }
  }
  if (star.closed && star.dying_count() != 1 && star.count <= ClosedOverlay::capacity) {
    return allows_closed(mesh, star, r, n, simple);
  }
  return allows_open(mesh, star, r, n, simple);
}

bool ErrorBound::take_over(double simple, int count) {
  double largest = 0;
  for (int i = 0; i < count; ++i) {
    proposed_[i] = std::min(simple, proposed_[i]);
    largest = std::max(largest, proposed_[i]);
  }
  return largest <= limit_.limit;
}

bool ErrorBound::allows_closed(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n,
                               double simple) {
  ClosedOverlay overlay;
  if (!overlay.lay(mesh, star, r, n)) {
    std::fill_n(proposed_.begin(), star.count, simple);
    return simple <= limit_.limit;
  }
  std::array<double, ClosedOverlay::capacity + 2> old_error;
  for (int i = 0; i < star.count; ++i) old_error[i] = error_[star.facet[i]];
  for (int i = 0; i < 2; ++i) {
    const std::uint32_t f = star.dying[i];
    old_error[star.count + i] = f == HalfEdges::none ? 0 : error_[f];
  }
  overlay.bound(old_error, proposed_);
  return take_over(simple, star.count);
}

bool ErrorBound::allows_open(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n,
                             double simple) {
  const Overlay overlay(mesh, star, r, n);
  if (!overlay.is_height_field(mesh)) {
    std::fill_n(proposed_.begin(), star.count, simple);
    return simple <= limit_.limit;
  }
  const auto old_error = [&](int i) {
    return i < star.count ? error_[star.facet[i]] : error_[star.dying[i - star.count]];
  };
  std::array<double, Star::capacity> difference;
  std::array<double, Star::capacity> carried;
  std::fill_n(difference.begin(), star.count, 0.0);
  std::fill_n(carried.begin(), star.count, 0.0);
  overlay.visit([&](int i, int old, double height) {
    difference[i] = std::max(difference[i], height);
    carried[i] = std::max(carried[i], old_error(old));
  });
  for (int i = 0; i < star.count; ++i) proposed_[i] = carried[i] + difference[i];
  return take_over(simple, star.count);
}

bool ErrorBound::allows_flip(const CollapseMesh& mesh, const Star& star) {
  const double largest_old = std::max(error_[star.facet[0]], error_[star.facet[1]]);
  if (largest_old == kept) return false;
  const Vec3d n = normalized(mesh.normals[star.facet[0]] + mesh.normals[star.facet[1]]);
  for (int i = 0; i < star.count; ++i) {
    if (!faces_along(mesh, star, i, mesh.r[star.u], n)) return false;
  }
  const Vec3d edge = mesh.r[star.ring[2]] - mesh.r[star.ring[0]];
  const Vec3d across = cross(edge, mesh.r[star.ring[1]] - mesh.r[star.u]);
  const double height = std::abs(dot(mesh.r[star.ring[0]] - mesh.r[star.u], across));
  const double error = largest_old + height / std::abs(dot(n, across));
  proposed_[0] = proposed_[1] = error;
  return error <= limit_.limit;
}

void ErrorBound::accept(const Star& star) {
  for (int i = 0; i < star.count; ++i) error_[star.facet[i]] = proposed_[i];
}

void ErrorBound::keep(std::span<const std::uint32_t> facets) {
  for (const std::uint32_t f : facets) error_[f] = kept;
}

bool ErrorBound::keeps(const Star& star) const {
  const auto is_kept = [this](std::uint32_t f) { return error_[f] == kept; };
  return std::any_of(star.facet.begin(), star.facet.begin() + star.count, is_kept) ||
         std::any_of(star.dying.begin(), star.dying.begin() + star.dying_count(), is_kept);
}

bool ErrorBound::raise() {
  if (limit_.limit == 0 || 2 * limit_.limit > limit_.highest) return false;
  limit_.limit *= 2;
  limit_.rough *= 2;
  return true;
}

double ErrorBound::largest(const HalfEdges& topology) const {
  double largest = 0;
  for (std::uint32_t f = 0; f < error_.size(); ++f) {
    if (topology.alive(f) && error_[f] != kept) largest = std::max(largest, error_[f]);
  }
  return largest;
}

}  // namespace scarp
