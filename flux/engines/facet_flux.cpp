#include "flux/engines/facet_flux.h"

#include <algorithm>

#include "core/parallel.h"
#include "flux/engines/error_draws.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 512;

}  // namespace

FacetFlux::FacetFlux(const FluxProblem& problem, std::size_t number, const RayPlan& plan,
                     const FacetValues& values, const View& view, std::span<const double> flux)
    : scene_(problem.scene),
      plan_(plan),
      values_(values),
      flux_(flux),
      with_normal_(change_with_normal(view, number, flux)),
      planes_(plan.size()) {
  parallel_for(plan.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) find_plane(e);
  });
}

void FacetFlux::find_plane(std::size_t e) {
  constexpr double rounding_room = 1 - 1e-9;
  const Elements& elements = plan_.elements();
  Plane& plane = planes_[e];
  plane.slope = values_.slope(e, [&](std::size_t other) { return of_element(other); });
  const auto beyond = [&](std::uint32_t p) {
    return dot(plane.slope, middle_of(elements.piece(p).corners) - elements.middle(e));
  };
  const double here = std::max(of_element(e), 0.0);
  for (const std::uint32_t p : elements.pieces_of(e))
    if (here + beyond(p) < 0) plane.part = std::min(plane.part, rounding_room * here / -beyond(p));
  plane.slope = plane.part * plane.slope;
  plane.bend = values_.bend(e, plane.slope, [&](std::size_t other) { return of_element(other); });
  for (const std::uint32_t p : elements.pieces_of(e)) {
    const Vec3d away = middle_of(elements.piece(p).corners) - elements.middle(e);
    plane.square += elements.piece(p).area / elements.area(e) * dot(away, away);
  }
}

// What a facet gets more than its element because of its normal.
double FacetFlux::by_tilt(std::size_t e, std::size_t facet) const {
  return dot(with_normal_[plan_.rank_of(e)], scene_.normal(facet) - plan_.elements().normal(e));
}

double FacetFlux::of(std::size_t facet) const {
  double sum = 0;
  for (const FacetValues::Part& part : values_.parts_of(facet))
    sum += static_cast<double>(part.share) *
               (of_element(part.element) + by_tilt(part.element, facet)) +
           dot(Vec3d(part.offset), planes_[part.element].slope);
  return std::max(sum, 0.0);
}

std::vector<float> FacetFlux::of_all() const {
  std::vector<float> flux(values_.facet_count());
  parallel_for(flux.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) flux[f] = static_cast<float>(of(f));
  });
  return flux;
}

void FacetFlux::draws(std::size_t facet, std::span<const float> of_ranks,
                      std::span<double> draws) const {
  std::ranges::fill(draws, 0.0);
  const auto add = [&](std::uint32_t element, double weight) {
    const float* const row = &of_ranks[plan_.rank_of(element) * draw_count];
    for (std::size_t k = 0; k < draws.size(); ++k) draws[k] += weight * static_cast<double>(row[k]);
  };
  for (const FacetValues::Part& part : values_.parts_of(facet)) {
    add(part.element, static_cast<double>(part.share));
    values_.for_each_beyond(part, [&](std::uint32_t element, double weight) {
      add(element, planes_[part.element].part * weight);
    });
  }
}

// Of the change of the plane away from its middle, the part along the side of the neighbours.
double FacetFlux::along_one_side(Vec3d slope, Vec3d away, std::size_t e) const {
  const Vec3d side = values_.one_side(e);
  const double size = length(side);
  return size > 0 ? dot(slope, side) * dot(away, side) / size : 0;
}

FacetFlux::Changes FacetFlux::changes(std::size_t facet, std::span<const double> constants) const {
  // At the foot of a step slopes by one side were a third too steep.
  constexpr double of_slope = 1.0 / 3;
  Changes sum;
  for (const FacetValues::Part& part : values_.parts_of(facet)) {
    const auto share = static_cast<double>(part.share);
    const double here = of_element(part.element);
    sum.by_planes += share * (here - constants[plan_.rank_of(part.element)]);
    sum.by_tilts += share * by_tilt(part.element, facet);
    const Plane& plane = planes_[part.element];
    const Vec3d away = Vec3d(part.offset) / share;
    sum.beyond_planes += share * plane.bend * (dot(away, away) - plane.square);
    sum.by_one_side += of_slope * share * along_one_side(plane.slope, away, part.element);
  }
  return sum;
}

}  // namespace scarp
