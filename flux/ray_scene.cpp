#include "flux/ray_scene.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/quantity.h"
#include "flux/nearest_facet.h"

namespace scarp {

namespace {

constexpr int max_side_crossings = 1'000'000;

// In spacings: a vertex this close to a side belongs on it.
constexpr float side_tolerance = 1e-4F;

float snapped(float x, float upper) {
  if (std::abs(x) < side_tolerance) return 0;
  if (std::abs(x - upper) < side_tolerance) return upper;
  return x;
}

// The normal of the facet as it is traced, so that nothing is emitted below its plane; but that of
// a sliver may turn anywhere by rounding.
Vec3d placed_normal(const std::array<Vec3f, 3>& corners, Vec3d exact) {
  const auto& [a, b, c] = corners;
  const Vec3d placed = cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a));
  const bool is_turned = !(dot(placed, exact) > 0.99 * length(placed) * length(exact));
  return normalized(is_turned ? exact : placed);
}

RayScene::Instructions newest_instructions() {
  const bool has_avx512 =
      __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
      __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512bw") != 0;
  if (has_avx512) return RayScene::Instructions::avx512;
  const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  return has_avx2 ? RayScene::Instructions::avx2 : RayScene::Instructions::sse2;
}

}  // namespace

namespace {

class ListTraffic final : public RayScene::Traffic {
 public:
  ListTraffic(std::span<const Ray> rays, std::span<Flight> flights)
      : rays_(rays), flights_(flights) {}

  void depart(std::uint32_t first, std::span<Ray> rays) override {
    std::ranges::copy(rays_.subspan(first, rays.size()), rays.begin());
  }
  void land(std::span<const Landing> landings) override {
    for (const auto& [number, flight] : landings) flights_[number] = flight;
  }

 private:
  std::span<const Ray> rays_;
  std::span<Flight> flights_;
};

}  // namespace

// Where flights take their rays from and land, one at a time.
class RayScene::Port {
 public:
  Port(std::uint32_t count, Traffic& traffic) : count_(count), traffic_(traffic) {}

  bool has_next() const { return next_ < count_; }
  const Ray& take() {
    const std::uint32_t place = next_ % Traffic::block_size;
    if (place == 0)
      traffic_.depart(next_,
                      std::span(rays_).first(std::min<std::size_t>(rays_.size(), count_ - next_)));
    ++next_;
    return rays_[place];
  }
  Ray ray(std::uint32_t number) const {
    Ray ray;
    traffic_.depart(number, {&ray, 1});
    return ray;
  }
  void land(std::uint32_t number, const Flight& flight) {
    landings_[landed_++] = {number, flight};
    if (landed_ == landings_.size()) hand_over();
  }
  void hand_over() {
    traffic_.land(std::span(landings_).first(landed_));
    landed_ = 0;
  }

 private:
  std::uint32_t count_;
  Traffic& traffic_;
  std::uint32_t next_ = 0;
  std::array<Ray, Traffic::block_size> rays_;
  std::array<Traffic::Landing, Traffic::block_size> landings_;
  std::size_t landed_ = 0;
};

// Flights under way: their straight parts, between sides.
class RayScene::Wave {
 public:
  Wave(const RayScene& scene, Port& port)
      : scene_(scene),
        port_(port),
        across_{scene.has_diagonal_ ? 1.0 : 0.0},
        lower_end_{0, 0, scene.lowest_ - 1, 0},
        upper_end_{scene.upper_.x, scene.upper_.y, scene.source_height_,
                   std::numeric_limits<double>::infinity()} {}

  void fly() {
    for (; count_ < capacity && port_.has_next(); ++count_) launch(count_);
    while (count_ > 0) {
      walks_.look(scene_.grid_, count_);
      test_facets();
      const std::size_t ended_count = walks_.go_on(count_, ended_);
      // From the last, so that the one that takes its place has been looked after.
      for (std::size_t k = ended_count; k-- > 0;) end_part(ended_[k]);
    }
  }

 private:
  static constexpr std::size_t capacity = FacetGrid::Walks::capacity;
  static constexpr std::size_t ahead = 8;

  struct Part {
    Ray ray;
    std::uint32_t number;  // of the flight
    int crossings;
    bool begins_inside;
    int side;  // that it ends at: an axis, or the diagonal
    double t_side;
    double t_end;  // of the domain
  };

  static void prefetch(const FacetGrid::Block* block) {
    constexpr std::size_t line = 64;
    const auto* const first = reinterpret_cast<const char*>(block);
    for (std::size_t k = 0; k < sizeof(*block); k += line) __builtin_prefetch(first + k);
  }

  void launch(std::size_t walk) {
    parts_[walk].ray = port_.take();
    parts_[walk].number = next_++;
    parts_[walk].crossings = 0;
    parts_[walk].begins_inside = false;
    start_part(walk);
  }

  // A flight that begins on an edge, but for rounding, and nearly along the plane of its facet may
  // begin behind the facet beyond. It is known by its end, within the solid, and begins again far
  // enough from all edges; false if it did so before.
  bool begin_inside(std::size_t walk) {
    constexpr double towards_middle = 0.5;
    Part& part = parts_[walk];
    if (part.begins_inside) return false;
    const Ray whole = port_.ray(part.number);
    if (whole.from == Ray::no_facet) return false;
    const auto& [a, b, c] = scene_.facets_[whole.from].corners;
    const Vec3d middle = (Vec3d(a) + Vec3d(b) + Vec3d(c)) / 3;
    part.ray = whole;
    part.ray.r += towards_middle * (middle - whole.r);
    part.crossings = 0;
    part.begins_inside = true;
    start_part(walk);
    return true;
  }

  void start_part(std::size_t walk) {
    Part& part = parts_[walk];
    const Ray& ray = part.ray;
    // To the lower or the upper end along each axis and across the diagonal. Without branches:
    // directions cannot be foreseen.
    const Lanes r{ray.r.x, ray.r.y, ray.r.z, across_ * (ray.r.x - ray.r.y)};
    const Lanes u{ray.u.x, ray.u.y, ray.u.z, across_ * (ray.u.x - ray.u.y)};
    const Lanes end = u > 0 ? upper_end_ : lower_end_;
    const Lanes t = (end - r) / u;
    const Lanes at_least_0 = t > 0 ? t : Lanes{};
    const Lanes to_end = u == 0 ? Lanes{} + std::numeric_limits<double>::infinity() : at_least_0;
    part.t_end = to_end[2];
    const double t_x = to_end[0];
    const double t_y = to_end[1];
    const int axis = t_y < t_x ? 1 : 0;
    const double t_axis = t_y < t_x ? t_y : t_x;
    part.side = to_end[3] < t_axis ? diagonal : axis;
    part.t_side = to_end[3] < t_axis ? to_end[3] : t_axis;
    // A little is searched on both sides of a crossing: rounding there may put the place behind
    // the surface.
    const double longest = std::min(part.t_side, part.t_end) + NearestFacet::tiny_distance;
    nearest_[walk].start(scene_.grid_, ray, longest);
    walks_.start(scene_.grid_, walk, ray.r, ray.u, longest);
  }

  // Of the walks that are at cells with facets.
  void test_facets() {
    std::size_t at_cells = 0;
    for (std::size_t w = 0; w < count_; ++w) {
      at_facets_[at_cells] = static_cast<std::uint32_t>(w);
      at_cells += walks_.has_facets(w) ? 1 : 0;
    }
    for (std::size_t k = 0; k < at_cells; ++k) walks_.prefetch_ceiling(scene_.grid_, at_facets_[k]);
    std::size_t at_facets = 0;
    for (std::size_t k = 0; k < at_cells; ++k) {
      at_facets_[at_facets] = at_facets_[k];
      at_facets += walks_.may_meet(scene_.grid_, at_facets_[k]) ? 1 : 0;
    }
    for (std::size_t k = 0; k < at_facets; ++k)
      at_blocks_[k] = {walks_.blocks(scene_.grid_, at_facets_[k]), at_facets_[k]};
    for (std::size_t count = at_facets; count > 0;) count = look_at_blocks(count);
    find_candidates();
    test_candidates();
  }

  // Only notes the facets that may be met, so that nothing waits for them. Returns how many cells
  // have another block: as that cannot be foreseen, no branch asks.
  std::size_t look_at_blocks(std::size_t count) {
    for (std::size_t k = 0; k < std::min(ahead, count); ++k) prefetch(at_blocks_[k].block);
    std::size_t next_count = 0;
    for (std::size_t k = 0; k < count; ++k) {
      if (k + ahead < count) prefetch(at_blocks_[k + ahead].block);
      const auto [block, walk] = at_blocks_[k];
      const unsigned facets = nearest_[walk].candidates(*block);
      met_[met_count_] = {block, walk, facets};
      met_count_ += facets != 0 ? 1 : 0;
      if (met_count_ == met_.size()) find_candidates();
      at_blocks_[next_count] = {block + 1, walk};
      next_count += block->is_last ? 0 : 1;
    }
    return next_count;
  }

  void find_candidates() {
    for (std::size_t k = 0; k < met_count_; ++k) {
      const auto [block, walk, facets] = met_[k];
      for (unsigned bits = facets; bits != 0; bits &= bits - 1) {
        const std::uint32_t f = block->facets[static_cast<std::size_t>(std::countr_zero(bits))];
        __builtin_prefetch(&scene_.facets_[f]);
        candidates_[candidate_count_++] = {walk, f};
        if (candidate_count_ == candidates_.size()) test_candidates();
      }
    }
    met_count_ = 0;
  }

  void test_candidates() {
    for (std::size_t k = 0; k < candidate_count_; ++k) {
      const auto [walk, f] = candidates_[k];
      NearestFacet& nearest = nearest_[walk];
      nearest.test(scene_.facets_[f].corners, scene_.facets_[f].normal, f);
      // What is as far away, but for rounding, counts as well.
      walks_.shorten(scene_.grid_, walk, nearest.t_nearest() + scene_.grid_.padding());
    }
    candidate_count_ = 0;
  }

  void end_part(std::size_t walk) {
    Part& part = parts_[walk];
    const Ray& ray = part.ray;
    const NearestFacet& nearest = nearest_[walk];
    if (nearest.is_at_front()) {
      land(walk, Flight::End::front, nearest.front());
    } else if (nearest.back().facet != Ray::no_facet) {
      if (!begin_inside(walk)) land(walk, Flight::End::back, nearest.back());
    } else if (part.t_end <= part.t_side) {
      if (ray.u.z > 0) {
        land(walk, Flight::End::sky, {.t = part.t_end});
      } else if (!begin_inside(walk)) {
        land(walk, Flight::End::below, {.t = part.t_end});
      }
    } else {
      part.ray.r += part.t_side * ray.u;
      scene_.cross_side(part.side, part.ray);
      if (++part.crossings == max_side_crossings) {
        land(walk, Flight::End::side_limit, {});
      } else {
        start_part(walk);
      }
    }
  }

  void land(std::size_t walk, Flight::End end, const NearestFacet::Hit& hit) {
    const Ray& ray = parts_[walk].ray;
    port_.land(parts_[walk].number, {end, hit.facet, ray.r + hit.t * ray.u, ray.u});
    if (port_.has_next()) {
      launch(walk);
      return;
    }
    --count_;
    parts_[walk] = parts_[count_];
    nearest_[walk] = nearest_[count_];
    walks_.move(count_, walk);
  }

  const RayScene& scene_;
  Port& port_;
  double across_;    // what counts of the distance to the diagonal
  Lanes lower_end_;  // of the domain
  Lanes upper_end_;
  std::uint32_t next_ = 0;
  std::size_t count_ = 0;  // under way
  std::array<Part, capacity> parts_;
  std::array<NearestFacet, capacity> nearest_;
  FacetGrid::Walks walks_;
  std::array<std::uint32_t, capacity> at_facets_;
  std::array<std::uint32_t, capacity> ended_;

  struct AtBlock {
    const FacetGrid::Block* block;
    std::uint32_t walk;
  };
  std::array<AtBlock, capacity> at_blocks_;

  /// A block with facets that a flight may meet, one bit each.
  struct Met {
    const FacetGrid::Block* block;
    std::uint32_t walk;
    unsigned facets;
  };
  std::array<Met, 2 * capacity> met_;
  std::size_t met_count_ = 0;

  struct Candidate {
    std::uint32_t walk;
    std::uint32_t facet;
  };
  std::array<Candidate, 2 * capacity> candidates_;
  std::size_t candidate_count_ = 0;
};

RayScene::RayScene(const TriMesh& mesh, const Sides& sides, double spacing) {
  place(mesh, sides, spacing);
  const double diameter = upper_.x + upper_.y + (source_height_ - lowest_);
  // Twenty times the rounding of single precision over the whole domain.
  const double padding = std::max(1.2e-6 * diameter, 2 * NearestFacet::ridge_thickness);
  const Vec3d room{padding, padding, padding};
  grid_ = FacetGrid(facets_, Vec3d{0, 0, lowest_ - 1} - room,
                    Vec3d{upper_.x, upper_.y, source_height_} + room, padding);
}

// The mesh has to end exactly on the sides: vertices that should lie there are put there.
void RayScene::place(const TriMesh& mesh, const Sides& sides, double spacing) {
  if (mesh.triangles.empty()) throw InputError("flux: the mesh has no triangles");
  const Box box = bounding_box(mesh);
  const Vec3d origin{static_cast<float>(sides.lower[0]), static_cast<float>(sides.lower[1]),
                     0.5 * (box.lower.z + box.upper.z)};
  const auto placed = [&](Vec3f r) { return Vec3f((Vec3d(r) - origin) / spacing); };
  const Vec3f upper =
      placed({static_cast<float>(sides.upper[0]), static_cast<float>(sides.upper[1]), 0});
  upper_ = Vec3d(upper);
  boundary_ = sides.boundary;
  has_diagonal_ = sides.diagonal;

  facets_.resize(mesh.triangles.size());
  areas_.resize(facets_.size());
  Box extent;
  std::optional<Vec3f> beyond;
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      Vec3f r = placed(mesh.vertices[mesh.triangles[f][corner]]);
      r.x = snapped(r.x, upper.x);
      r.y = snapped(r.y, upper.y);
      if (has_diagonal_ && std::abs(r.x - r.y) < side_tolerance) r.y = r.x;
      facets_[f].corners[corner] = r;
      extent.add(Vec3d(r));
      const bool is_within = r.x >= 0 && r.y >= 0 && r.x <= upper.x && r.y <= upper.y &&
                             (!has_diagonal_ || r.y <= r.x);
      if (!is_within && !beyond) beyond = mesh.vertices[mesh.triangles[f][corner]];
    }
    const Vec3d exact = area_vector(mesh, f) / (spacing * spacing);
    areas_[f] = length(exact);
    if (!(areas_[f] > 0) || !std::isfinite(areas_[f])) {
      throw InputError("flux: facet " + std::to_string(f) + " at " +
                       rounded_place(Vec3d(mesh.vertices[mesh.triangles[f][0]])) +
                       " has no area; remove such triangles first");
    }
    facets_[f].normal = placed_normal(facets_[f].corners, exact);
  }
  if (beyond) {
    const auto side = [&](int axis) {
      return rounded_number(sides.lower[axis]) + " to " + rounded_number(sides.upper[axis]);
    };
    throw InputError("flux: the mesh reaches over the lateral sides of the domain at " +
                     rounded_place(Vec3d(*beyond)) + "; x goes from " + side(0) + " and y from " +
                     side(1) + (has_diagonal_ ? ", up to x" : "") +
                     ": cut the mesh there or widen the domain");
  }
  source_height_ = extent.upper.z + 1;
  lowest_ = extent.lower.z;
}

void RayScene::cross_side(int side, Ray& ray) const {
  ray.from = Ray::no_facet;
  if (side == diagonal) {
    ray.r.x = ray.r.y = 0.5 * (ray.r.x + ray.r.y);
    std::swap(ray.u.x, ray.u.y);
    return;
  }
  const bool up = ray.u[side] > 0;
  if (boundary_[static_cast<std::size_t>(side)] == Boundary::periodic) {
    ray.r[side] = up ? 0 : upper_[side];
  } else {
    ray.r[side] = up ? upper_[side] : 0;
    ray.u[side] = -ray.u[side];
  }
}

Flight RayScene::fly(const Ray& ray) const {
  Flight flight;
  fly({&ray, 1}, {&flight, 1});
  return flight;
}

// All that flights call becomes part of each of the three functions: compiled for AVX2 they take
// half the time, for AVX-512 (vectors stay at 256 bits) a tenth less. No result depends on it.
[[gnu::flatten]] void RayScene::fly_with_sse2(Port& port) const { Wave(*this, port).fly(); }

[[gnu::target("avx2"), gnu::flatten]] void RayScene::fly_with_avx2(Port& port) const {
  Wave(*this, port).fly();
}

[[gnu::target("avx512f,avx512vl,avx512dq,avx512bw"), gnu::flatten]] void RayScene::fly_with_avx512(
    Port& port) const {
  Wave(*this, port).fly();
}

void RayScene::fly(std::uint32_t count, Traffic& traffic, Instructions newest) const {
  static const Instructions machine = newest_instructions();
  Port port(count, traffic);
  switch (std::min(newest, machine)) {
    case Instructions::sse2:
      fly_with_sse2(port);
      break;
    case Instructions::avx2:
      fly_with_avx2(port);
      break;
    case Instructions::avx512:
      fly_with_avx512(port);
      break;
  }
  port.hand_over();
}

void RayScene::fly(std::span<const Ray> rays, std::span<Flight> flights,
                   Instructions newest) const {
  ListTraffic traffic(rays, flights);
  fly(static_cast<std::uint32_t>(rays.size()), traffic, newest);
}

}  // namespace scarp
