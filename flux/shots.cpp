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

Shooter::Sets Shooter::sets_of(std::size_t rank, Use use) const {
  static_assert(set_count == 2);
  const FluxOptions& options = problem_.options;
  RandomStream random({options.seed, options.time_step, user_,
                       std::uint64_t{static_cast<unsigned>(use)} << 56 |
                           plan_.element_at(plan_.block_of(rank).begin)});
  const auto set = [&] {
    std::array<std::uint32_t, 4> seeds{};
    for (std::uint32_t& seed : seeds) seed = random.bits();
    return ScrambledSobol(seeds);
  };
  return {set(), set()};
}

// All images are tried: a ray counts if it was mirrored at the sides of its own.
void Shooter::shoot(std::size_t rank, std::uint32_t first, std::vector<Shot>& shots) const {
  const bool aims_at_sky = plan_.block_of(rank).aims_at_sky;
  const Sets sets = sets_of(rank, Use::rays);
  const Sets skyward_sets = aims_at_sky ? sets_of(rank, Use::skyward_rays) : sets;
  for (std::uint32_t index = first; index < plan_.rays(rank); ++index) {
    const auto [share, place, is_skyward] = plan_.place(rank, index);
    const Use use = is_skyward ? Use::skyward_rays : Use::rays;
    for (std::uint16_t set = 0; set < set_count; ++set) {
      const auto xi = (is_skyward ? skyward_sets : sets)[set].point_of_share(share, place);
      for (std::uint16_t image = 0; image <= leans_; ++image) {
        if ((image & leans_) != image) continue;
        shots.push_back(shot({static_cast<std::uint32_t>(rank), index, set, image}, use, xi));
        const Shot& last = shots.back();
        const bool may_miss = law_ == Law::lobe || is_skyward;
        if (may_miss && dot(last.u, problem_.normal(last.ray.from)) <= 0) shots.pop_back();
      }
    }
  }
}

Shot Shooter::scout(std::size_t rank) const {
  const auto number = static_cast<std::uint32_t>(rank - plan_.block_of(rank).begin);
  return shot({.rank = static_cast<std::uint32_t>(rank)}, Use::scouts,
              sets_of(rank, Use::scouts)[0].point(number));
}

Shot Shooter::shot(const ShotName& name) const {
  const auto [share, place, is_skyward] = plan_.place(name.rank, name.index);
  const Use use = is_skyward ? Use::skyward_rays : Use::rays;
  return shot(name, use, sets_of(name.rank, use)[name.set].point_of_share(share, place));
}

Shot Shooter::shot(const ShotName& name, Use use, const std::array<double, 4>& xi) const {
  const auto [piece, xi2] = start_of(plan_.element_at(name.rank), xi[2]);
  const auto& [a, b, c] = piece.corners;
  const Vec3d weights = sample_triangle({xi2, xi[3]});
  const Vec3d u = direction(name, use, piece.facet, {xi[0], xi[1]});
  return {.name = name,
          .ray = {.r = weights.x * a + weights.y * b + weights.z * c,
                  .u = problem_.options.two_dimensional ? project_to_cross_section(u) : u,
                  .from = piece.facet},
          .u = u,
          .weight =
              plan_.block_of(name.rank).aims_at_sky ? balance(u, problem_.normal(piece.facet)) : 1};
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

Vec3d Shooter::direction(const ShotName& name, Use use, std::uint32_t facet, UnitSquare xi) const {
  if (use == Use::skyward_rays) return sample_skyward(xi);
  if (law_ == Law::lambert) return sample_cosine(xi, problem_.normal(facet));
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
