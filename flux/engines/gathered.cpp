#include "flux/engines/gathered.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace scarp {

namespace {

double square(double x) { return x * x; }

// What an element sees that is no facet, as parts of all it sees.
std::array<double, fate_count> ends_of(const View& view, std::size_t row) {
  const ExchangeMatrix& matrix = view.matrix;
  std::array<double, fate_count> ends{};
  matrix.for_each_part(row, [&](std::size_t hit, double part) {
    if (hit >= matrix.size()) ends[hit - matrix.size()] += part;
  });
  double of_sky = 0;
  for (const WeightSums& sums : view.sums[row]) of_sky += sums.sky;
  ends[to_sky] = of_sky / static_cast<double>(matrix.row(row).size());
  return ends;
}

// The mean over an element's rays, of those to the sky, of weights times where they started.
Vec3d sky_moment(const View& view, std::size_t row) {
  const auto rays = view.matrix.row(row);
  Vec3d sum;
  for (std::size_t k = 0; k < rays.size(); ++k)
    if (rays[k].hit == view.matrix.size() + to_sky)
      sum += static_cast<double>(rays[k].weight) * Vec3d(view.places[view.matrix.first[row] + k]);
  return sum / static_cast<double>(rays.size());
}

}  // namespace

Gathered::Gathered(const FluxProblem& problem, std::size_t number, const RayPlan& plan,
                   const FacetValues& values, const View& view, double tolerance)
    : problem_(problem),
      plan_(plan),
      values_(values),
      view_(view),
      flux_(problem, number, plan, values, view) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    // Rays that are aimed at the sky see little else.
    const double part = plan.block_of(rank).aims_at_sky ? 1 - 1.0 / RayPlan::rays_per_skyward : 1;
    const double rays = part * static_cast<double>(plan.rays(rank) * set_count);
    unseen_ = std::max(unseen_, plan.elements().area(plan.element_at(rank)) / rays);
  }
  flux_.solve(tolerance);
  flux_.solve_constants();
  halves_ = half_differences(view, number, plan, flux_.radiosity());
  // Rays along a lobe scatter by themselves.
  if (is_looked_for(problem)) {
    halves_.flux.parts.clear();
    halves_.lost.parts.clear();
  }
}

void Gathered::pass_on_errors_by(std::span<const float> of_facets) {
  if (!of_facets.empty()) passed_on_ = on_elements(plan_, of_facets);
}

// How an error counts, per area, in the sum of all: about as what is compared with the target.
std::vector<double> Gathered::weights() const {
  const auto responses = problem_.responses();
  std::vector<double> weights(plan_.size());
  for (std::size_t rank = 0; rank < weights.size(); ++rank) {
    if (is_in_void(rank)) continue;
    weights[rank] = responses.empty()
                        ? 1 / std::max(flux()[rank], small_flux)
                        : plan_.elements().mean(plan_.element_at(rank), [&](std::uint32_t f) {
                            return std::abs(static_cast<double>(responses.front()[f]));
                          });
  }
  return weights;
}

// The variance of scrambled sets falls about as n^-1.5 with their number of rays.
void Gathered::add_variances(std::span<double> of_windows) const {
  const std::vector<double> weights = this->weights();
  for (std::size_t w = 0; w < of_windows.size(); ++w) {
    const RayPlan::Window& window = plan_.windows()[w];
    double area = 0;
    double sum = 0;
    for (std::size_t rank = window.front().begin; rank < window.back().end; ++rank) {
      const double of_element = plan_.elements().area(plan_.element_at(rank));
      const double n = plan_.rays(rank);
      area += of_element;
      sum += of_element * square(weights[rank] * halves_.flux.halves[rank]) * n * std::sqrt(n);
    }
    of_windows[w] += sum / area;
  }
}

void Gathered::draw(std::size_t count) {
  if (!draws_) {
    double largest = 0;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank)
      largest = std::max({largest, flux()[rank], flux_.radiosity().leaves(rank)});
    const FluxDraws::Passing passing{.matrix = view_.matrix,
                                     .rows = view_.rows,
                                     .solver = errors_stick_alike() ? &flux_.exchange() : nullptr,
                                     .reemitted = error_parts()};
    draws_.emplace(plan_, passing,
                   ErrorDraws(problem_.options, plan_, halves_.flux,
                              [this](std::size_t rank) { return is_in_void(rank); }),
                   weights(), largest);
  }
  draws_->draw(count);
}

// Books what the elements absorb and where their re-emitted particles end. In units of source
// particles per squared spacing. Flux and part that leaves come from the same rays, so the product
// of their means is too large by their covariance, which the half differences tell.
FluxAudit Gathered::audit() const {
  FluxAudit audit{.emitted = problem_.emitted()};
  for (std::size_t i = 0; i < view_.matrix.size(); ++i) {
    const auto ends = ends_of(view_, i);
    const std::uint32_t element = plan_.element_at(i);
    const double area = plan_.elements().area(element);
    const double arrives = area * flux()[i];
    const double c = flux_.reemitted()[i];
    const double leaving = area * flux_.radiosity().leaves(i);
    audit.absorbed += arrives * (1 - c);
    audit.escaped += leaving * ends[to_sky] +
                     area * dot(flux_.radiosity().slopes()[i], sky_moment(view_, i)) -
                     area * c * halves_.flux.halves[i] * halves_.out[i];
    audit.lost_back_face += leaving * ends[to_back];
    audit.lost_below += leaving * ends[to_below];
    audit.lost_side_limit += leaving * ends[to_side_limit];
  }
  if (audit.emitted > 0) audit.balance_std_error = balance_error() / audit.emitted;
  return audit;
}

// Standard error of what is absorbed and ends elsewhere, in all. An error of what an element sees
// goes on to others, but in the end every particle of it sticks or leaves, so that the sum has all
// of it, and the error of how many leave.
double Gathered::balance_error() const {
  Differences of_sum = halves_.lost;
  if (!of_sum.parts.empty()) of_sum.of_rays_in_parts = halves_.sum_of_rays;
  for (std::size_t i = 0; i < plan_.size(); ++i) {
    const double part = draws_->possible_part(i, halves_.flux.halves[i]);
    of_sum.halves[i] += part * halves_.flux.halves[i];
    if (of_sum.parts.empty()) continue;
    of_sum.of_rays[i] =
        static_cast<float>(square(part) * static_cast<double>(halves_.flux.of_rays[i]));
    for (std::size_t k = 0; k < of_sum.parts[i].size(); ++k)
      of_sum.parts[i][k] +=
          static_cast<float>(part * static_cast<double>(halves_.flux.parts[i][k]));
  }
  return UsualErrors(plan_, of_sum, [this](std::size_t rank) { return is_in_void(rank); }).of_all();
}

// What elements of a finite size leave uncertain, each on all facets together: a part of what
// planes in place of constants change, a part of what normals of facets change, and how far the
// flux may be from the planes, where neighbours show it and where they are all on one side. Against
// fine elements, in a trench and a hole of aspect ratio 2 with sticking .01 to 1, these parts were
// seen to be left.
FluxSpread Gathered::bias() const {
  constexpr double of_planes = 0.1;
  constexpr double of_tilts = 0.3;
  return {.flux = [this](std::size_t f) { return on_facets().of(f); },
          .deviations =
              [this](std::size_t f, std::span<double> each) {
                const auto [by_planes, by_tilts, beyond_planes, by_one_side] =
                    on_facets().changes(f, flux_.radiosity().flux_of_constants());
                each[0] = of_planes * by_planes;
                each[1] = of_tilts * by_tilts;
                each[2] = beyond_planes;
                each[3] = by_one_side;
              },
          .count = bias_count};
}

// What single facets of an element emit more than all is seen nearby.
double Gathered::unknown_of_emission(std::size_t facet) const {
  constexpr double seen_nearby = 0.3;
  const std::vector<float>& of_facets = problem_.species.emission;
  if (of_facets.empty()) return 0;
  double more = 0;
  for (const FacetValues::Part& part : values_.parts_of(facet))
    more += static_cast<double>(part.share) *
            (static_cast<double>(of_facets[facet]) - flux_.emission()[plan_.rank_of(part.element)]);
  return seen_nearby * std::abs(more);
}

std::vector<float> Gathered::biases() const {
  const FluxSpread of_size = bias();
  const auto responses = problem_.responses();
  std::vector<float> biases(problem_.scene.facet_count());
  parallel_for(biases.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const double flux = on_facets().of(f);
      if (flux == 0) continue;
      std::array<double, bias_count> each{};
      of_size.deviations(f, each);
      const auto& [by_planes, by_tilts, beyond_planes, by_one_side] = each;
      const double of_others = flux * values_.off_in_strips(f) + unknown_of_emission(f);
      const double counts = responses.empty() ? 1 / std::max(flux, small_flux)
                                              : std::abs(static_cast<double>(responses.front()[f]));
      biases[f] = static_cast<float>(
          facet_bias_counts * counts *
          std::hypot(std::hypot(by_planes, beyond_planes), std::hypot(by_one_side, of_others)));
    }
  });
  return biases;
}

// On patches, and on facets.
double Gathered::bias_measure(std::span<const float> biases) const {
  double squares = 0;
  double area = 0;
  for (std::size_t f = 0; f < biases.size(); ++f) {
    if (on_facets().of(f) == 0) continue;
    squares += problem_.scene.area(f) * square(static_cast<double>(biases[f]));
    area += problem_.scene.area(f);
  }
  return area > 0 ? std::max(std::sqrt(squares / area), measure(bias())) : 0;
}

FluxSpread Gathered::spread() const {
  const FluxSpread of_size = bias();
  const double scale = std::sqrt(static_cast<double>(draws_->count()));
  return {.flux = of_size.flux,
          .deviations =
              [this, of_size, scale](std::size_t f, std::span<double> of_facet) {
                const std::span<double> biases = of_facet.last(of_size.count);
                of_size.deviations(f, biases);
                for (double& each : biases) each *= scale;
                on_facets().draws(f, draws_->all(), of_facet.first(draws_->count()));
              },
          .count = draws_->count() + of_size.count,
          .divisor = static_cast<double>(draws_->count()),
          .unseen = unseen_};
}

double Gathered::measure(const FluxSpread& spread) const {
  const auto of_response = response_error(problem_, [&](std::size_t) { return spread; });
  return of_response ? *of_response : estimate(problem_.scene, problem_.patches, spread).error;
}

double Gathered::target_measure() const { return measure(spread()); }

FluxField Gathered::field() const {
  const FluxSpread all = spread();
  FluxEstimate estimated = estimate(problem_.scene, problem_.patches, all);
  return {.tallies = {std::move(estimated.tally)},
          .audit = audit(),
          .rays = plan_.total(),
          .segments = view_.flights,
          .error = estimated.error,
          .bias = measure(bias()),
          .response_error = response_error(problem_, [&](std::size_t) { return all; }),
          .max_facet_error = estimated.max_facet_error};
}

}  // namespace scarp
