#include "mesh/simplify/pass_star.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "mesh/simplify/collapse_limits.h"

namespace scarp {

namespace {

using namespace collapse_limits;

FloatLanes dot3(FloatLanes ax, FloatLanes ay, FloatLanes az, FloatLanes bx, FloatLanes by,
                FloatLanes bz) {
  return ax * bx + ay * by + az * bz;
}

/// Whether not: the cosine between two vectors is at least the lowest one, which is positive. By
/// their product and squares.
FloatMask disagree(FloatLanes product, FloatLanes squares, double lowest) {
  const FloatLanes zero{};
  return ~((product > zero) &
           (product * product >= all_lanes(static_cast<float>(lowest * lowest)) * squares));
}

FloatLanes squared(float a) { return all_lanes(a * a); }
FloatLanes squared_limit(double limit) { return squared(static_cast<float>(limit)); }

constexpr FloatLanes first_numbers{0, 1, 2, 3};

constexpr std::size_t grain = 4096;

/// The power of two next to it.
double inverse_mean_edge(const CollapseMesh& mesh) {
  const double squared_edge = 2 * mesh.area / static_cast<double>(mesh.normals.size());
  return squared_edge > 0 ? std::ldexp(1.0, -std::ilogb(squared_edge) / 2) : 1;
}

}  // namespace

FloatMesh::FloatMesh(const CollapseMesh& mesh)
    : scale(inverse_mean_edge(mesh)), r(mesh.r.size()), normals(mesh.normals.size()) {
  parallel_for(r.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) r[v] = place(mesh.r[v]);
  });
  parallel_for(normals.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) normals[f] = normal(mesh.normals[f]);
  });
}

bool PassStar::gather(const HalfEdges& topology, std::uint32_t h) {
  at_origin_ = star_.gather_closed(topology, h, capacity);
  if (star_.count < 3 || at_origin_ == 0 || at_origin_ == star_.count) return false;
  // Where the two ends share a neighbour besides the apexes, the ring comes back to it.
  for (int i = 0; i < star_.count; ++i) {
    for (int j = i + 1; j < star_.count; ++j) {
      if (star_.ring[i] == star_.ring[j]) return false;
    }
  }
  return true;
}

void PassStar::place_at(const FloatMesh& floats, FloatRecord r) {
  const int count = star_.count;
  const auto from_r = [&r](const FloatRecord& a) {
    return FloatRecord{a.x - r.x, a.y - r.y, a.z - r.z, 0};
  };
  u_ = from_r(floats.r[star_.u]);
  v_ = from_r(floats.r[star_.v]);
  for (int i = 0; i < count; ++i) {
    const FloatRecord p = from_r(floats.r[star_.ring[i]]);
    ring_.put(i, p.x, p.y, p.z);
    const FloatRecord& n = floats.normals[star_.facet[i]];
    old_normals_.put(i, n.x, n.y, n.z);
    error_[i] = n.w;
  }
  // What lies beyond the end is not asked for, but worked on.
  for (int i = count; i < count + 2 * float_lanes && i < padded; ++i) {
    ring_.put(i, ring_.x[i - count], ring_.y[i - count], ring_.z[i - count]);
    old_normals_.put(i, old_normals_.x[0], old_normals_.y[0], old_normals_.z[0]);
    error_[i] = error_[0];
  }
  for (int i = 0; i < count; i += float_lanes) {
    const auto [ax, ay, az] = load_rows(ring_, i);
    const auto [bx, by, bz] = load_rows(ring_, i + 1);
    store(&normals_.x[i], ay * bz - az * by);
    store(&normals_.y[i], az * bx - ax * bz);
    store(&normals_.z[i], ax * by - ay * bx);
  }
}

bool PassStar::keeps_length(float limit) const {
  FloatMask bad{};
  FloatLanes number = first_numbers;
  const FloatLanes at_origin = all_lanes(static_cast<float>(at_origin_));
  const FloatLanes count = all_lanes(static_cast<float>(star_.count));
  for (int i = 0; i < star_.count; i += float_lanes, number += all_lanes(float{float_lanes})) {
    const auto [x, y, z] = load_rows(ring_, i);
    const FloatMask at_v = number >= at_origin;
    const FloatLanes px = x - (at_v ? all_lanes(v_.x) : all_lanes(u_.x));
    const FloatLanes py = y - (at_v ? all_lanes(v_.y) : all_lanes(u_.y));
    const FloatLanes pz = z - (at_v ? all_lanes(v_.z) : all_lanes(u_.z));
    const FloatLanes square = dot3(x, y, z, x, y, z);
    bad |= (number < count) & (square > squared(limit)) & (square > dot3(px, py, pz, px, py, pz));
  }
  return !any(bad);
}

bool PassStar::keeps_lengths(std::span<const float> limits) const {
  for (int i = 0; i < star_.count; ++i) {
    const FloatRecord& corner = star_.at_target[i] ? v_ : u_;
    const Vec3f edge{ring_.x[i], ring_.y[i], ring_.z[i]};
    const Vec3f old_edge = edge - Vec3f{corner.x, corner.y, corner.z};
    const float square = dot(edge, edge);
    if (square > limits[i] * limits[i] && square > dot(old_edge, old_edge)) return false;
  }
  return true;
}

bool PassStar::keeps_facets(const CollapseMesh& mesh) const {
  const int count = star_.count;
  Rows input_normals;
  for (int i = 0; i < count; ++i) {
    const Vec3f input(Vec3d(mesh.input_normals[star_.facet[i]]));
    input_normals.put(i, input.x, input.y, input.z);
  }
  for (int i = count; i < count + float_lanes && i < padded; ++i) {
    input_normals.put(i, input_normals.x[0], input_normals.y[0], input_normals.z[0]);
  }
  Vec3f around;
  for (int i = 0; i < count; ++i) {
    around += Vec3f{old_normals_.x[i], old_normals_.y[i], old_normals_.z[i]};
  }
  const FloatLanes gx = all_lanes(around.x);
  const FloatLanes gy = all_lanes(around.y);
  const FloatLanes gz = all_lanes(around.z);
  const FloatLanes around_square = all_lanes(dot(around, around));
  const FloatMask is_noisy = mesh.thin_facets == ThinFacets::noisy ? ~FloatMask{} : FloatMask{};
  const FloatLanes least_share = any(is_noisy) ? all_lanes(1.0F) : squared_limit(as_thin);
  FloatMask bad{};
  std::array<std::int32_t, padded> turned;
  FloatMask any_turned{};
  FloatLanes number = first_numbers;
  for (int i = 0; i < count; i += float_lanes, number += all_lanes(float{float_lanes})) {
    const FloatMask at_v = number >= all_lanes(static_cast<float>(at_origin_));
    const FloatLanes cx = at_v ? all_lanes(v_.x) : all_lanes(u_.x);
    const FloatLanes cy = at_v ? all_lanes(v_.y) : all_lanes(u_.y);
    const FloatLanes cz = at_v ? all_lanes(v_.z) : all_lanes(u_.z);
    const auto [ax, ay, az] = load_rows(ring_, i);
    const auto [bx, by, bz] = load_rows(ring_, i + 1);
    const auto [nx, ny, nz] = load_rows(normals_, i);
    const auto [ox, oy, oz] = load_rows(old_normals_, i);
    const auto [ix, iy, iz] = load_rows(input_normals, i);
    const FloatLanes dx = bx - ax;
    const FloatLanes dy = by - ay;
    const FloatLanes dz = bz - az;
    const FloatLanes side = dot3(dx, dy, dz, dx, dy, dz);
    const FloatLanes px = ax - cx;
    const FloatLanes py = ay - cy;
    const FloatLanes pz = az - cz;
    const FloatLanes qx = bx - cx;
    const FloatLanes qy = by - cy;
    const FloatLanes qz = bz - cz;
    const FloatLanes longest =
        lane_max(side, lane_max(dot3(ax, ay, az, ax, ay, az), dot3(bx, by, bz, bx, by, bz)));
    const FloatLanes old_longest =
        lane_max(side, lane_max(dot3(px, py, pz, px, py, pz), dot3(qx, qy, qz, qx, qy, qz)));
    // Squares of the measure of shape, without dividing.
    const FloatLanes scale = longest * longest;
    const FloatLanes old_scale = old_longest * old_longest;
    const FloatLanes square = dot3(nx, ny, nz, nx, ny, nz);
    const FloatLanes old_square = dot3(ox, oy, oz, ox, oy, oz);
    const FloatLanes with_around = dot3(nx, ny, nz, gx, gy, gz);
    const FloatMask flat = ~(square > squared_limit(without_area) * scale);
    const FloatMask thinner = (square < squared_limit(too_thin) * scale) &
                              (square * old_scale < least_share * old_square * scale);
    const FloatMask was_needle = ~(old_square > squared_limit(needle) * old_scale);
    const FloatMask needle_turns =
        disagree(with_around, square * around_square, lowest_cosine_of_needle);
    const FloatMask turns =
        disagree(dot3(nx, ny, nz, ox, oy, oz), square * old_square, lowest_cosine);
    const FloatMask sliver_turns =
        (square < squared_limit(sliver) * scale) &
        disagree(with_around, square * around_square, lowest_cosine_of_sliver);
    const FloatMask counts = number < all_lanes(static_cast<float>(count));
    bad |= counts & (flat | thinner | (was_needle & needle_turns & is_noisy) |
                     (~was_needle & turns) | (sliver_turns & is_noisy));
    const FloatMask turns_in_all =
        counts & disagree(dot3(nx, ny, nz, ix, iy, iz), square * dot3(ix, iy, iz, ix, iy, iz),
                          lowest_cosine_in_all);
    any_turned |= turns_in_all;
    std::memcpy(&turned[i], &turns_in_all, sizeof turns_in_all);
  }
  if (any(bad)) return false;
  if (!any(any_turned)) return true;
  for (int i = 0; i < count; ++i) {
    if (turned[i] != 0 && !is_chamfer(mesh, i)) return false;
  }
  return true;
}

bool PassStar::is_chamfer(const CollapseMesh& mesh, int i) const {
  const Vec3d n{normals_.x[i], normals_.y[i], normals_.z[i]};
  if (!agree(n, Vec3d(mesh.input_normals[star_.facet[i]]), lowest_cosine_of_chamfer)) return false;
  return std::all_of(star_.facet.begin(), star_.facet.begin() + star_.count, [&](std::uint32_t f) {
    return agree(n, Vec3d(mesh.input_normals[f]), lowest_cosine_around_chamfer);
  });
}

bool PassStar::makes_no_fold(const CollapseMesh& mesh, const FloatMesh& floats) const {
  const int count = star_.count;
  const auto vector = [](const Rows& rows, int i) {
    return Vec3f{rows.x[i], rows.y[i], rows.z[i]};
  };
  for (int i = 0; i < count; ++i) {
    const Vec3f n = vector(normals_, i);
    const Vec3f old_n = vector(old_normals_, i);
    const std::uint32_t across = mesh.topology.opposite(star_.rim[i]);
    if (across != HalfEdges::none) {
      const FloatRecord& record = floats.normals[HalfEdges::facet(across)];
      const Vec3f outer{record.x, record.y, record.z};
      if (folds(n, outer, old_n, outer)) return false;
    }
    const int after = i + 1 == count ? 0 : i + 1;
    if (folds(n, vector(normals_, after), old_n, vector(old_normals_, after))) return false;
  }
  return true;
}

float PassStar::shape_growth(const FloatMesh& floats) const {
  constexpr float equal_sides = 3.4641016F;  // 2 sqrt(3)
  constexpr float tiny = 1e-30F;
  const auto quality = [&](float twice_area, float squares) {
    return equal_sides * twice_area / std::max(squares, tiny);
  };
  const auto vector = [](const Rows& rows, int i) {
    return Vec3f{rows.x[i], rows.y[i], rows.z[i]};
  };
  const Vec3f u{u_.x, u_.y, u_.z};
  const Vec3f v{v_.x, v_.y, v_.z};
  std::array<float, padded> twice_area;
  std::array<float, padded> growth;
  const int count = star_.count;
  for (int i = 0; i < count; ++i) {
    const Vec3f a = vector(ring_, i);
    const Vec3f b = vector(ring_, i + 1);
    const Vec3f c = i < at_origin_ ? u : v;
    const Vec3f n = vector(normals_, i);
    const Vec3f old_n = vector(old_normals_, i);
    const float side = dot(b - a, b - a);
    twice_area[i] = std::sqrt(dot(n, n));
    growth[i] =
        quality(std::sqrt(dot(old_n, old_n)), side + dot(a - c, a - c) + dot(b - c, b - c)) -
        quality(twice_area[i], side + dot(a, a) + dot(b, b));
  }
  float sum = 0;
  float area = 0;
  for (int i = 0; i < count; ++i) {
    sum += growth[i];
    area += twice_area[i];
  }
  for (int i = 0; i < 2; ++i) {
    const Vec3f apex = vector(ring_, i == 0 ? 0 : at_origin_);
    const FloatRecord& n = floats.normals[star_.dying[i]];
    sum += quality(std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z),
                   dot(u - v, u - v) + dot(apex - u, apex - u) + dot(apex - v, apex - v)) -
           1;
  }
  return sum * area / static_cast<float>(count + 2);
}

/// The star seen along its mean normal: where the merged vertex and the two ends lie on the other
/// surface, and how high that is there.
class PassStar::Heights {
 public:
  Heights(const PassStar& star, const FloatMesh& floats)
      : star_(star),
        first_dying_(floats.normals[star.star_.dying[0]]),
        second_dying_(floats.normals[star.star_.dying[1]]) {
    project();
  }

  /// False if the new surface is no height field, or with_old and the old one is none.
  template <bool with_old>
  bool find();

  // After find().

  float squares_of_ends() const {
    const float u = over_u_.best().height - u_.z;
    const float v = over_v_.best().height - v_.z;
    return u * u + v * v;
  }
  /// With the old surface.
  bool exceed(float limit) const {
    const float dying = std::max(first_dying_.w, second_dying_.w);
    return differs(over_u_.best().height, u_.z, std::max(largest(u_error_), dying), limit) ||
           differs(over_v_.best().height, v_.z, std::max(largest(v_error_), dying), limit) ||
           merged_exceeds(limit);
  }

 private:
  /// The facet that a place is in, or least outside of: the lowest of its weights there, its
  /// height, and its number.
  struct Place {
    float inside;
    float height;
    float error;
  };
  struct Places {
    FloatLanes inside = all_lanes(-1e30F);
    FloatLanes height{};
    FloatLanes error{};

    void offer(FloatLanes at, FloatLanes z, FloatLanes e, FloatMask counts) {
      const FloatMask better = counts & (at > inside);
      inside = better ? at : inside;
      height = better ? z : height;
      error = better ? e : error;
    }
    Place best() const {
      int lane = 0;
      for (int i = 1; i < float_lanes; ++i) lane = inside[i] > inside[lane] ? i : lane;
      return {inside[lane], height[lane], error[lane]};
    }
  };

  static float largest(FloatLanes lanes) {
    return std::max(std::max(lanes[0], lanes[1]), std::max(lanes[2], lanes[3]));
  }
  static bool differs(float height, float z, float error, float limit) {
    return std::abs(height - z) + error > limit;
  }

  void project();
  bool merged_exceeds(float limit) const;
  static void offer_dying(const std::array<Vec3f, 3>& corners, float error, Place& place);

  const PassStar& star_;
  const FloatRecord& first_dying_;
  const FloatRecord& second_dying_;
  Rows flat_;  ///< of the ring; z: height
  Vec3f u_;
  Vec3f v_;
  Places merged_;
  Places over_u_;
  Places over_v_;
  FloatLanes u_error_{};
  FloatLanes v_error_{};
};

void PassStar::Heights::project() {
  const int count = star_.star_.count;
  const Rows& old_normals = star_.old_normals_;
  Vec3f n{first_dying_.x + second_dying_.x, first_dying_.y + second_dying_.y,
          first_dying_.z + second_dying_.z};
  for (int i = 0; i < count; ++i) n += Vec3f{old_normals.x[i], old_normals.y[i], old_normals.z[i]};
  n = normalized(n);
  const Vec3f other = std::abs(n.x) < 0.6F   ? Vec3f{1, 0, 0}
                      : std::abs(n.y) < 0.6F ? Vec3f{0, 1, 0}
                                             : Vec3f{0, 0, 1};
  const Vec3f e = normalized(cross(other, n));
  const Vec3f f = cross(n, e);
  for (int i = 0; i < count; i += float_lanes) {
    const auto [x, y, z] = load_rows(star_.ring_, i);
    store(&flat_.x[i], dot3(x, y, z, all_lanes(e.x), all_lanes(e.y), all_lanes(e.z)));
    store(&flat_.y[i], dot3(x, y, z, all_lanes(f.x), all_lanes(f.y), all_lanes(f.z)));
    store(&flat_.z[i], dot3(x, y, z, all_lanes(n.x), all_lanes(n.y), all_lanes(n.z)));
  }
  for (int i = count; i < count + float_lanes + 1 && i < padded; ++i) {
    flat_.put(i, flat_.x[i - count], flat_.y[i - count], flat_.z[i - count]);
  }
  const auto flat = [&](const FloatRecord& a) {
    const Vec3f r{a.x, a.y, a.z};
    return Vec3f{dot(r, e), dot(r, f), dot(r, n)};
  };
  u_ = flat(star_.u_);
  v_ = flat(star_.v_);
}

template <bool with_old>
bool PassStar::Heights::find() {
  const int count = star_.star_.count;
  const FloatLanes zero{};
  const FloatLanes one = all_lanes(1.0F);
  FloatMask bad{};
  FloatLanes number = first_numbers;
  for (int i = 0; i < count; i += float_lanes, number += all_lanes(float{float_lanes})) {
    const FloatMask counts = number < all_lanes(static_cast<float>(count));
    const Lanes3 a = load_rows(flat_, i);
    const Lanes3 b = load_rows(flat_, i + 1);
    const FloatLanes area = a.x * b.y - a.y * b.x;
    bad |= counts & ~(area > zero);
    const FloatLanes inverse = one / area;
    const auto offer_new = [&](Vec3f p, Places& places) {
      const FloatLanes new_a = (all_lanes(p.x) * b.y - all_lanes(p.y) * b.x) * inverse;
      const FloatLanes new_b = (a.x * all_lanes(p.y) - a.y * all_lanes(p.x)) * inverse;
      places.offer(lane_min(lane_min(new_a, new_b), one - new_a - new_b), new_a * a.z + new_b * b.z,
                   zero, counts);
    };
    offer_new(u_, over_u_);
    offer_new(v_, over_v_);
    if constexpr (!with_old) continue;
    const FloatMask at_v = number >= all_lanes(static_cast<float>(star_.at_origin_));
    const FloatLanes error = load(&star_.error_[i]);
    const FloatLanes cx = at_v ? all_lanes(v_.x) : all_lanes(u_.x);
    const FloatLanes cy = at_v ? all_lanes(v_.y) : all_lanes(u_.y);
    const FloatLanes cz = at_v ? all_lanes(v_.z) : all_lanes(u_.z);
    const FloatLanes old_area = (a.x - cx) * (b.y - cy) - (a.y - cy) * (b.x - cx);
    bad |= counts & ~(old_area > zero);
    const FloatLanes old_inverse = one / old_area;
    const FloatLanes of_c = area * old_inverse;
    const FloatLanes of_a = (b.x * cy - b.y * cx) * old_inverse;
    const FloatLanes of_b = one - of_c - of_a;
    merged_.offer(lane_min(of_c, lane_min(of_a, of_b)), of_c * cz + of_a * a.z + of_b * b.z, error,
                  counts);
    u_error_ = lane_max(u_error_, counts & ~at_v ? error : zero);
    v_error_ = lane_max(v_error_, counts & at_v ? error : zero);
  }
  return !any(bad);
}

/// The merged vertex may also lie over one of the facets that die.
bool PassStar::Heights::merged_exceeds(float limit) const {
  Place place = merged_.best();
  const int second = star_.at_origin_;
  offer_dying({u_, v_, Vec3f{flat_.x[0], flat_.y[0], flat_.z[0]}}, first_dying_.w, place);
  offer_dying({v_, u_, Vec3f{flat_.x[second], flat_.y[second], flat_.z[second]}}, second_dying_.w,
              place);
  return differs(place.height, 0, place.error, limit);
}

void PassStar::Heights::offer_dying(const std::array<Vec3f, 3>& corners, float error,
                                    Place& place) {
  const auto& [a, b, c] = corners;
  const float inverse = 1 / ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
  const float of_a = (b.x * c.y - b.y * c.x) * inverse;
  const float of_b = (c.x * a.y - c.y * a.x) * inverse;
  const float of_c = 1 - of_a - of_b;
  const float inside = std::min(of_a, std::min(of_b, of_c));
  if (inverse > 0 && inside > place.inside) {
    place = {inside, of_a * a.z + of_b * b.z + of_c * c.z, error};
  }
}

float PassStar::squared_heights_of_ends(const FloatMesh& floats) const {
  Heights heights(*this, floats);
  return heights.find<false>() ? heights.squares_of_ends() : 0;
}

bool PassStar::exceeds(const FloatMesh& floats, float limit) const {
  Heights heights(*this, floats);
  // Of what is no height field the bound knows by itself.
  return heights.find<true>() && heights.exceed(limit);
}

}  // namespace scarp
