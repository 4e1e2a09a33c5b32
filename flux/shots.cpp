#include "flux/shots.h"

#include <algorithm>
#include <numbers>

#include "core/random.h"
#include "flux/sampling.h"

namespace scarp {

namespace {

// Reflective sides show images of the source. They look like it unless its lobe leans to the side;
// that of a turning wafer leans to all.
std::uint32_t leaning_sides(const SourceLobe& lobe, const FluxOptions& options) {
  std::uint32_t sides = 0;
  for (std::uint32_t axis = 0; axis < (options.two_dimensional ? 1U : 2U); ++axis) {
    const bool leans = lobe.direction[static_cast<int>(axis)] != 0 && !lobe.rotating;
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
  constexpr std::size_t ahead = 4;  // elements
  std::vector<Shot> shots;
  std::size_t most = 0;
  for (std::size_t rank = begin; rank < end; ++rank) most += plan_.rays(rank) - first(rank);
  shots.reserve(most * set_count);
  std::vector<UnitSquare> aims;
  for (std::size_t rank = begin; rank < end;) {
    const RayPlan::Block& block = plan_.block_of(rank);
    const Sets sets = sets_of(block, Use::rays);
    const Sets skyward_sets = block.aims_at_sky ? sets_of(block, Use::skyward_rays) : sets;
    const std::size_t earlier = shots.size();
    aims.clear();
    for (const std::size_t last = std::min<std::size_t>(end, block.end); rank < last; ++rank) {
      if (rank + ahead < end) prefetch(plan_.element_at(rank + ahead));
      start_from(rank, first(rank), sets, skyward_sets, shots, aims);
    }
    aim(std::span(shots).subspan(earlier), aims);
    if (law_ == Law::lambert && !block.aims_at_sky) continue;
    const auto leaves_into_solid = [&](const Shot& shot) {
      const bool may_miss = law_ == Law::lobe || is_skyward(shot.name);
      return may_miss && dot(shot.u, problem_.normal(shot.ray.from)) <= 0;
    };
    shots.erase(std::remove_if(shots.begin() + static_cast<std::ptrdiff_t>(earlier), shots.end(),
                               leaves_into_solid),
                shots.end());
  }
  return shots;
}

// Elements that follow each other lie anywhere in memory.
void Shooter::prefetch(std::uint32_t element) const {
  for (const std::uint32_t p : plan_.elements().pieces_of(element)) {
    const Elements::Piece& piece = plan_.elements().piece(p);
    __builtin_prefetch(&piece);
    __builtin_prefetch(&piece.facet);
  }
}

// All images are tried: a ray counts if it was mirrored at the sides of its own.
void Shooter::start_from(std::size_t rank, std::uint32_t first, const Sets& sets,
                         const Sets& skyward_sets, std::vector<Shot>& shots,
                         std::vector<UnitSquare>& aims) const {
  for (std::uint32_t index = first; index < plan_.rays(rank); ++index) {
    const auto [share, place, is_skyward] = plan_.place(rank, index);
    for (std::uint16_t set = 0; set < set_count; ++set) {
      const auto xi = (is_skyward ? skyward_sets : sets)[set].point_of_share(share, place);
      for (std::uint16_t image = 0; image <= leans_; ++image) {
        if ((image & leans_) != image) continue;
        shots.push_back(start({static_cast<std::uint32_t>(rank), index, set, image}, xi));
        aims.push_back({xi[0], xi[1]});
      }
    }
  }
}

std::vector<Shot> Shooter::scouts(std::size_t begin, std::size_t end) const {
  std::vector<Shot> shots;
  for (std::size_t rank = begin; rank < end; ++rank) {
    const RayPlan::Block& block = plan_.block_of(rank);
    const auto number = static_cast<std::uint32_t>(rank - block.begin);
    const auto xi = sets_of(block, Use::scouts)[0].point(number);
    shots.push_back(start({.rank = static_cast<std::uint32_t>(rank)}, xi));
    aim_at(shots.back(), sample_cosine({xi[0], xi[1]}, problem_.normal(shots.back().ray.from)));
  }
  return shots;
}

Shot Shooter::shot(const ShotName& name) const {
  const auto [share, place, is_skyward] = plan_.place(name.rank, name.index);
  const Use use = is_skyward ? Use::skyward_rays : Use::rays;
  const auto xi =
      sets_of(plan_.block_of(name.rank), use)[name.set].point_of_share(share, place);
  Shot shot = start(name, xi);
  const UnitSquare of_direction{xi[0], xi[1]};
  aim({&shot, 1}, {&of_direction, 1});
  return shot;
}

// But for its direction.
Shot Shooter::start(const ShotName& name, const std::array<double, 4>& xi) const {
  const auto [piece, xi2] = start_of(plan_.element_at(name.rank), xi[2]);
  const auto& [a, b, c] = piece.corners;
  const Vec3d weights = sample_triangle({xi2, xi[3]});
  return {.name = name,
          .ray = {.r = weights.x * a + weights.y * b + weights.z * c, .u = {}, .from = piece.facet},
          .u = {}};
}

// Those by Lambert's law together.
void Shooter::aim(std::span<Shot> shots, std::span<const UnitSquare> aims) const {
  CosineSamples samples;
  std::array<Shot*, CosineSamples::most> of_samples;
  const auto sample = [&] {
    sample_cosines(samples);
    for (std::size_t k = 0; k < samples.count; ++k) aim_at(*of_samples[k], samples.direction(k));
    samples.count = 0;
  };
  for (std::size_t k = 0; k < shots.size(); ++k) {
    Shot& shot = shots[k];
    if (is_skyward(shot.name)) {
      aim_at(shot, sample_skyward(aims[k]));
    } else if (law_ == Law::lobe) {
      aim_at(shot, along_lobe(shot.name, aims[k]));
    } else {
      of_samples[samples.count] = &shot;
      samples.add(aims[k], problem_.normal(shot.ray.from));
      if (samples.count == CosineSamples::most) sample();
    }
  }
  sample();
}

void Shooter::aim_at(Shot& shot, Vec3d u) const {
  shot.u = u;
  shot.ray.u = problem_.options.two_dimensional ? project_to_cross_section(u) : u;
  if (plan_.block_of(shot.name.rank).aims_at_sky)
    shot.weight = balance(u, problem_.normal(shot.ray.from));
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
  const Elements::Piece& piece = elements.piece(pieces[k]);
  return {piece, pieces.size() == 1 ? xi : std::min((place - below[k]) / piece.area, 1.0)};
}

Vec3d Shooter::along_lobe(const ShotName& name, UnitSquare xi) const {
  // Numbers stay below 2^24, so no stream is that of a block's sets.
  const std::uint64_t number = std::uint64_t{name.index} * set_count + name.set + 1;
  RandomStream random({problem_.options.seed, problem_.options.time_step, user_,
                       number << 32 | plan_.element_at(name.rank)});
  const Vec3d u = -sample_lobe(problem_.species.source, xi, random);
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
