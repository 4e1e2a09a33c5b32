#include "flux/rays/shots.h"

#include <algorithm>
#include <numbers>

#include "core/random.h"
#include "flux/sampling/sampling.h"

namespace scarp {

namespace {

// Reflective sides show images of the source. They look like it unless its lobe leans to the side;
// that of a turning wafer leans to all.
std::uint32_t leaning_sides(const SourceLobe& lobe, const FluxOptions& options) {
  std::uint32_t sides = 0;
  for (int axis = 0; axis < options.lateral_axes(); ++axis) {
    const bool leans = lobe.direction[axis] != 0 && !lobe.rotating;
    if (leans && options.sides.boundary[axis] == Boundary::reflective) sides |= 1U << axis;
  }
  return sides;
}

// What a ray counts where some of all rays are aimed at the sky.
float balance(Vec3d u, Vec3d n) {
  constexpr double skyward = 1.0 / RayPlan::rays_per_skyward;
  const double by_lambert = dot(u, n) / std::numbers::pi;
  return static_cast<float>(by_lambert /
                            ((1 - skyward) * by_lambert + skyward * skyward_density(u)));
}

}  // namespace

// Hemisphere rays serve all species, lobe rays their own.
Shooter::Shooter(const FluxProblem& problem, const RayPlan& plan, Law law)
    : problem_(problem),
      plan_(plan),
      law_(law),
      user_(law == Law::lambert ? 0xFFFFFFFFU : ~problem.species_index - 1),
      leans_(law == Law::lambert ? 0 : leaning_sides(problem.species.source, problem.options)) {}

Shooter::Sets Shooter::sets_of(const RayPlan::Block& block, Use use) const {
  static_assert(set_count == 2);
  const FluxOptions& options = problem_.options;
  RandomStream random(
      {options.seed, options.time_step, user_,
       std::uint64_t{static_cast<unsigned>(use)} << 56 | plan_.element_at(block.begin)});
  const auto set = [&] {
    std::array<std::uint32_t, 4> seeds{};
    for (std::uint32_t& seed : seeds) seed = random.bits();
    return ScrambledSobol(seeds);
  };
  return {set(), set()};
}

std::vector<Shot> Shooter::shoot(
    std::size_t begin, std::size_t end,
    const std::function<std::uint32_t(std::size_t rank)>& first) const {
  std::vector<Shot> shots;
  std::size_t most = 0;
  for (std::size_t rank = begin; rank < end; ++rank)
    most += std::max(plan_.rays(rank), first(rank)) - first(rank);
  shots.reserve(most * set_count);
  std::vector<Aim> aims;
  for (std::size_t rank = begin; rank < end;) {
    const RayPlan::Block& block = plan_.block_of(rank);
    const Sets sets = sets_of(block, Use::rays);
    const Sets skyward_sets = block.aims_at_sky ? sets_of(block, Use::skyward_rays) : sets;
    const std::size_t earlier = shots.size();
    aims.clear();
    for (const std::size_t last = std::min<std::size_t>(end, block.end); rank < last; ++rank) {
      if (rank + 1 < end) plan_.elements().prefetch(plan_.element_at(rank + 1));
      start_from(rank, first(rank), sets, skyward_sets, shots, aims);
    }
    aim(std::span(shots).subspan(earlier), aims);
    if (law_ == Law::lambert && !block.aims_at_sky) continue;
    std::size_t left = earlier;
    for (std::size_t k = earlier; k < shots.size(); ++k) {
      const bool may_miss = law_ == Law::lobe || is_skyward(shots[k].name);
      if (!may_miss || dot(shots[k].u, aims[k - earlier].n) > 0) shots[left++] = shots[k];
    }
    shots.resize(left);
  }
  return shots;
}

// All images are tried: a ray counts if it was mirrored at the sides of its own.
void Shooter::start_from(std::size_t rank, std::uint32_t first, const Sets& sets,
                         const Sets& skyward_sets, std::vector<Shot>& shots,
                         std::vector<Aim>& aims) const {
  for (std::uint32_t index = first; index < plan_.rays(rank); ++index) {
    const auto [share, place, is_skyward] = plan_.place(rank, index);
    for (std::uint16_t set = 0; set < set_count; ++set) {
      const auto xi = (is_skyward ? skyward_sets : sets)[set].point_of_share(share, place);
      for (std::uint16_t image = 0; image <= leans_; ++image) {
        if ((image & leans_) != image) continue;
        shots.push_back({.name = {static_cast<std::uint32_t>(rank), index, set, image}});
        aims.push_back(start(shots.back(), xi));
      }
    }
  }
}

void Shooter::scout(const RayPlan::Window& window, std::vector<Shot>& shots) const {
  for (const RayPlan::Block& block : window) {
    const ScrambledSobol set = sets_of(block, Use::scouts)[0];
    for (std::uint32_t rank = block.begin; rank < block.end; ++rank) {
      const auto xi = set.point(rank - block.begin);
      shots.push_back({.name = {.rank = rank}});
      const Aim aim = start(shots.back(), xi);
      aim_at(shots.back(), aim.n, sample_cosine(aim.xi, aim.n));
    }
  }
}

Shot Shooter::shot(const ShotName& name) const {
  const auto [share, place, is_skyward] = plan_.place(name.rank, name.index);
  const Use use = is_skyward ? Use::skyward_rays : Use::rays;
  const auto xi = sets_of(plan_.block_of(name.rank), use)[name.set].point_of_share(share, place);
  Shot shot{.name = name};
  const Aim of_shot = start(shot, xi);
  aim({&shot, 1}, {&of_shot, 1});
  return shot;
}

Shooter::Aim Shooter::start(Shot& shot, const std::array<double, 4>& xi) const {
  const auto [piece, xi2] = start_of(plan_.element_at(shot.name.rank), xi[2]);
  const auto& [a, b, c] = piece.corners;
  const Vec3d weights = sample_triangle({xi2, xi[3]});
  shot.ray.r = weights.x * a + weights.y * b + weights.z * c;
  shot.ray.from = piece.facet;
  return {.xi = {xi[0], xi[1]}, .n = problem_.in_section(piece.normal)};
}

// Those of the law several at once.
void Shooter::aim(std::span<Shot> shots, std::span<const Aim> aims) const {
  CosineSamples samples;
  std::array<std::size_t, CosineSamples::most> of_samples;
  const auto sample = [&] {
    if (law_ == Law::lobe) {
      sample_upright(problem_.species.source, samples);
    } else {
      sample_cosines(samples);
    }
    for (std::size_t k = 0; k < samples.count; ++k) {
      Shot& shot = shots[of_samples[k]];
      const Vec3d u = samples.direction(k);
      aim_at(shot, aims[of_samples[k]].n, law_ == Law::lobe ? along_lobe(shot.name, u) : u);
    }
    samples.count = 0;
  };
  for (std::size_t k = 0; k < shots.size(); ++k) {
    Shot& shot = shots[k];
    const auto& [xi, n] = aims[k];
    if (is_skyward(shot.name)) {
      aim_at(shot, n, sample_skyward(xi));
    } else {
      of_samples[samples.count] = k;
      samples.add(xi, n);
      if (samples.count == CosineSamples::most) sample();
    }
  }
  sample();
}

void Shooter::aim_at(Shot& shot, Vec3d n, Vec3d u) const {
  shot.u = u;
  shot.ray.u = problem_.in_section(u);
  if (plan_.block_of(shot.name.rank).aims_at_sky) shot.weight = balance(u, n);
}

// A number says on which piece, by area, and what it has left where there.
std::pair<const Elements::Piece&, double> Shooter::start_of(std::uint32_t element,
                                                            double xi) const {
  const Elements& elements = plan_.elements();
  const auto pieces = elements.pieces_of(element);
  const auto below = elements.areas_below(element);
  const double place = xi * elements.area(element);
  std::size_t k = 0;
  for (std::size_t next = 1; next < below.size(); ++next) k += place >= below[next] ? 1 : 0;
  const double end = k + 1 < below.size() ? below[k + 1] : elements.area(element);
  return {elements.piece(pieces[k]), std::min((place - below[k]) / (end - below[k]), 1.0)};
}

// upright: about the vertical.
Vec3d Shooter::along_lobe(const ShotName& name, Vec3d upright) const {
  if (problem_.species.source.is_upright()) return -upright;
  // Numbers stay below 2^24, so no stream is that of a block's sets.
  const std::uint64_t number = std::uint64_t{name.index} * set_count + name.set + 1;
  RandomStream random({problem_.options.seed, problem_.options.time_step, user_,
                       number << 32 | plan_.element_at(name.rank)});
  const Vec3d u = -about_lobe_axis(problem_.species.source, upright, random);
  return {(name.image & 1U) != 0 ? -u.x : u.x, (name.image & 2U) != 0 ? -u.y : u.y, u.z};
}

// Rays of an element start close together, which is order enough.
std::vector<Flight> Shooter::fly(const std::vector<Shot>& shots) const {
  std::vector<Ray> rays(shots.size());
  for (std::size_t k = 0; k < rays.size(); ++k) rays[k] = shots[k].ray;
  std::vector<Flight> flights(shots.size());
  problem_.scene.fly(rays, flights);
  return flights;
}

bool Shooter::meets_source(const Shot& shot, const Flight& flight) const {
  if (flight.end != Flight::End::sky) return false;
  std::uint32_t mirrored = 0;
  for (std::uint32_t axis = 0; axis < 2; ++axis) {
    const int a = static_cast<int>(axis);
    if (flight.u[a] * shot.ray.u[a] < 0) mirrored |= 1U << axis;
  }
  return (mirrored & leans_) == shot.name.image;
}

}  // namespace scarp
