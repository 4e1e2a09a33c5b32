#include "flux/gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>

#include "core/parallel.h"
#include "flux/error_draws.h"
#include "flux/facet_values.h"
#include "flux/flux_draws.h"
#include "flux/kept_hits.h"
#include "flux/portable_math.h"
#include "flux/view.h"

namespace scarp {

namespace {

// What the first round sends, on average: deep down too few rays say nothing of use.
constexpr double first_rays_per_element = 8;
constexpr double first_rays_per_deep_element = 16;

constexpr double mean_tolerance = 1e-7;

// What the error needs.
constexpr double rough_tolerance = 1e-4;

// By rank, half of what elements' two sets say apart.
struct HalfDifferences {
  std::vector<double> flux;  // of direct flux plus re-emitted flux seen
  std::vector<double> out;   // of the part of rays that met no facet
};

// The flux on every element, by rank.
struct Solution {
  std::vector<double> flux;
  HalfDifferences halves;
};

// What one set of an element's rays tells of all that it sees.
struct Told {
  double flux = 0;
  double out = 0;
};

// What a set lacks it takes from the other, as the rows of the matrix do.
// Shape: direct, the sums of weights of the sets; leaves, what leaves each element.
std::array<Told, set_count> told_by_sets(const ExchangeMatrix& matrix, std::size_t row,
                                         std::span<const float> direct,
                                         std::span<const double> leaves) {
  std::array<Told, set_count> others{};
  const auto rays = matrix.row(row);
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const auto weight = static_cast<double>(rays[k].weight);
    if (rays[k].hit < matrix.size()) {
      others[k % set_count].flux += weight * leaves[rays[k].hit];
    } else if (rays[k].hit != matrix.size() + to_sky) {
      others[k % set_count].out += weight;
    }
  }
  const SetSums sums = sums_of_sets(matrix, row);
  const double per_ray = static_cast<double>(set_count) / static_cast<double>(rays.size());
  std::array<Told, set_count> told{};
  for (std::size_t set = 0; set < set_count; ++set) {
    const std::size_t other = 1 - set;
    const double lacking = sums[other].others > 0 ? sums[set].lacking / sums[other].others : 0;
    told[set] = {.flux = per_ray * (static_cast<double>(direct[set]) + others[set].flux +
                                    lacking * others[other].flux),
                 .out = per_ray * (sums[set].sky + others[set].out + lacking * others[other].out)};
  }
  return told;
}

HalfDifferences half_differences(const View& view, const std::vector<float>& direct,
                                 std::span<const double> leaves) {
  static_assert(set_count == 2);
  const ExchangeMatrix& matrix = view.matrix;
  HalfDifferences halves{std::vector<double>(matrix.size()), std::vector<double>(matrix.size())};
  parallel_for(matrix.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto told =
          told_by_sets(matrix, i, std::span(direct).subspan(i * set_count, set_count), leaves);
      halves.flux[i] = (told[0].flux - told[1].flux) / 2;
      halves.out[i] = (told[0].out - told[1].out) / 2;
    }
  });
  return halves;
}

// Takes quantities of elements to facets: linear across joined ones, but nowhere below zero.
class OnFacets {
 public:
  OnFacets(const RayPlan& plan, const FacetValues& values, std::span<const double> flux);

  /// Shape: the columns of a facet, and as many for each rank, side by side.
  template <class Number, std::size_t Columns>
  std::array<Number, Columns> of(std::size_t facet, std::span<const Number> of_ranks) const;

 private:
  const RayPlan& plan_;
  const FacetValues& values_;
  std::vector<double> slope_;  // per facet: 1, less where the flux would be negative
};

OnFacets::OnFacets(const RayPlan& plan, const FacetValues& values, std::span<const double> flux)
    : plan_(plan), values_(values), slope_(values.facet_count(), 1) {
  constexpr double rounding_room = 1 - 1e-9;
  const Elements& elements = plan.elements();
  for (std::size_t e = 0; e < plan.size(); ++e) {
    const auto pieces = elements.pieces_of(e);
    if (pieces.size() == 1) continue;
    const double of_element = std::max(flux[plan.rank_of(e)], 0.0);
    double slope = 1;
    for (const std::uint32_t p : pieces) {
      double beyond = 0;
      values.for_each_beyond(elements.piece(p).facet, [&](std::uint32_t element, double weight) {
        beyond += weight * flux[plan.rank_of(element)];
      });
      if (of_element + beyond < 0) slope = std::min(slope, rounding_room * of_element / -beyond);
    }
    for (const std::uint32_t p : pieces) slope_[elements.piece(p).facet] = slope;
  }
}

template <class Number, std::size_t Columns>
std::array<Number, Columns> OnFacets::of(std::size_t facet,
                                         std::span<const Number> of_ranks) const {
  const Elements& elements = plan_.elements();
  std::array<Number, Columns> sum{};
  const auto add = [&](std::uint32_t element, double weight) {
    const Number* const row = &of_ranks[plan_.rank_of(element) * Columns];
    for (std::size_t c = 0; c < Columns; ++c) sum[c] += static_cast<Number>(weight) * row[c];
  };
  for (const std::uint32_t p : elements.pieces_of_facet(facet))
    add(elements.element_of(p), elements.share_of_facet(p));
  values_.for_each_beyond(
      facet, [&](std::uint32_t element, double weight) { add(element, slope_[facet] * weight); });
  return sum;
}

// What the rays found for one problem, and its solution.
class Gathered {
 public:
  Gathered(const FluxProblem& problem, const RayPlan& plan, const View& view,
           const std::vector<float>& direct, double tolerance);

  void solve(double tolerance);
  std::vector<float> arrivals(const FacetValues& values) const;
  /// Before the first draw. Shape: the part that every facet passes on, as of Settle::passed_on.
  void pass_on_errors_by(std::span<const float> of_facets);
  /// More draws of the error, up to a number of them.
  void draw(std::size_t count);
  /// What is compared with the target.
  double target_measure() const;
  FluxField field(const FacetValues& values) const;

 private:
  FluxSpread spread() const;
  FluxAudit audit() const;
  double leaves(std::size_t rank) const {
    return static_cast<double>(reemitted_[rank]) * solution_.flux[rank] + emission_[rank];
  }
  bool errors_stick_alike() const { return passed_on_.empty(); }
  // Of which elements pass on errors.
  std::span<const float> error_parts() const {
    return errors_stick_alike() ? reemitted_ : passed_on_;
  }
  // What re-emits and yet has no flux has no error; without sticking, one there would have no end.
  bool is_in_void(std::size_t rank) const {
    return reemitted_[rank] > 0 && solution_.flux[rank] == 0;
  }
  ErrorDraws error_draws(std::span<const double> halves) const;
  std::vector<double> weights() const;

  const FluxProblem& problem_;
  const RayPlan& plan_;
  const View& view_;
  const std::vector<float>& direct_;
  std::vector<float> reemitted_;
  std::vector<float> passed_on_;  // of errors; empty where as much as of the flux
  std::vector<double> emission_;
  ExchangeSolver exchange_;
  Solution solution_;
  double unseen_ = 0;
  std::optional<FluxDraws> draws_;
};

// Means over elements, by rank.
std::vector<float> on_elements(const RayPlan& plan, std::span<const float> of_facets) {
  std::vector<float> values(plan.size());
  for (std::size_t rank = 0; rank < values.size(); ++rank)
    values[rank] = static_cast<float>(plan.elements().mean(
        plan.element_at(rank), [&](std::uint32_t f) { return static_cast<double>(of_facets[f]); }));
  return values;
}

std::vector<float> reemitted_parts(const FluxProblem& problem, const RayPlan& plan) {
  std::vector<float> of_facets;
  for (const float sticking : problem.sticking) of_facets.push_back(1 - sticking);
  return on_elements(plan, of_facets);
}

// What elements emit of their own, by rank.
std::vector<double> emission_of(const FluxProblem& problem, const RayPlan& plan) {
  std::vector<double> emission(plan.size());
  const std::vector<float>& of_facets = problem.species.emission;
  if (of_facets.empty()) return emission;
  for (std::size_t rank = 0; rank < emission.size(); ++rank)
    emission[rank] = plan.elements().mean(
        plan.element_at(rank), [&](std::uint32_t f) { return static_cast<double>(of_facets[f]); });
  return emission;
}

// What every element, by rank, sees of the source and of what elements emit.
std::vector<double> first_flux(const View& view, std::span<const float> direct,
                               std::span<const double> emission) {
  const ExchangeMatrix& matrix = view.matrix;
  std::vector<double> flux(matrix.size());
  parallel_for(matrix.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double of_source = 0;
      for (std::size_t set = 0; set < set_count; ++set)
        of_source += static_cast<double>(direct[i * set_count + set]);
      double of_elements = 0;
      view.rows.for_each_part(
          i, [&](std::size_t hit, double part) { of_elements += part * emission[hit]; });
      flux[i] = of_source / static_cast<double>(matrix.row(i).size()) + of_elements;
    }
  });
  return flux;
}

// The flux on every element, by rank. What hardly sees anything may come out a little below zero.
std::vector<double> solved_flux(const View& view, const ExchangeSolver& exchange,
                                std::span<const float> direct, std::span<const double> emission,
                                double tolerance, std::span<const double> start = {}) {
  return exchange.solve<double>(first_flux(view, direct, emission), 1, tolerance, start);
}

// What facets get is nowhere below zero.
std::vector<float> flux_on(const OnFacets& facets, std::size_t count,
                           std::span<const double> of_elements) {
  std::vector<float> flux(count);
  parallel_for(count, 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f)
      flux[f] = static_cast<float>(std::max(facets.of<double, 1>(f, of_elements)[0], 0.0));
  });
  return flux;
}

Gathered::Gathered(const FluxProblem& problem, const RayPlan& plan, const View& view,
                   const std::vector<float>& direct, double tolerance)
    : problem_(problem),
      plan_(plan),
      view_(view),
      direct_(direct),
      reemitted_(reemitted_parts(problem, plan)),
      emission_(emission_of(problem, plan)),
      exchange_(view.rows, reemitted_) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    // Rays that are aimed at the sky see little else.
    const double part = plan.block_of(rank).aims_at_sky ? 1 - 1.0 / RayPlan::rays_per_skyward : 1;
    const double rays = part * static_cast<double>(plan.rays(rank) * set_count);
    unseen_ = std::max(unseen_, plan.elements().area(plan.element_at(rank)) / rays);
  }
  solve(tolerance);
  std::vector<double> leaving(plan.size());
  for (std::size_t rank = 0; rank < leaving.size(); ++rank) leaving[rank] = leaves(rank);
  solution_.halves = half_differences(view, direct, leaving);
}

// Always anew: where nothing arrives the flux is zero to the bit only from a start that is.
void Gathered::solve(double tolerance) {
  solution_.flux = solved_flux(view_, exchange_, direct_, emission_, tolerance);
}

std::vector<float> Gathered::arrivals(const FacetValues& values) const {
  return flux_on(OnFacets(plan_, values, solution_.flux), values.facet_count(), solution_.flux);
}

void Gathered::pass_on_errors_by(std::span<const float> of_facets) {
  if (!of_facets.empty()) passed_on_ = on_elements(plan_, of_facets);
}

ErrorDraws Gathered::error_draws(std::span<const double> halves) const {
  return {problem_.options, plan_, halves, [this](std::size_t rank) { return is_in_void(rank); }};
}

// How an error counts, per area, in the sum of all: about as what is compared with the target.
std::vector<double> Gathered::weights() const {
  const auto responses = problem_.responses();
  std::vector<double> weights(plan_.size());
  for (std::size_t rank = 0; rank < weights.size(); ++rank) {
    if (is_in_void(rank)) continue;
    weights[rank] = responses.empty()
                        ? 1 / std::max(solution_.flux[rank], small_flux)
                        : plan_.elements().mean(plan_.element_at(rank), [&](std::uint32_t f) {
                            return std::abs(static_cast<double>(responses.front()[f]));
                          });
  }
  return weights;
}

void Gathered::draw(std::size_t count) {
  if (!draws_) {
    double largest = 0;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank)
      largest = std::max({largest, solution_.flux[rank], leaves(rank)});
    draws_.emplace(plan_, view_.matrix, view_.rows, errors_stick_alike() ? &exchange_ : nullptr,
                   error_parts(), error_draws(solution_.halves.flux), weights(), largest);
  }
  draws_->draw(count);
}

// What an element sees that is no facet, as parts of all it sees.
std::array<double, fate_count> ends_of(const ExchangeMatrix& matrix, std::size_t row) {
  std::array<double, fate_count> ends{};
  matrix.for_each_part(row, [&](std::size_t hit, double part) {
    if (hit >= matrix.size()) ends[hit - matrix.size()] += part;
  });
  double of_sky = 0;
  for (const WeightSums& sums : sums_of_sets(matrix, row)) of_sky += sums.sky;
  ends[to_sky] = of_sky / static_cast<double>(matrix.row(row).size());
  return ends;
}

// Books what the elements absorb and where their re-emitted particles end. In units of source
// particles per squared spacing. Flux and part that leaves come from the same rays, so the product
// of their means is too large by their covariance, which the half differences tell.
FluxAudit Gathered::audit() const {
  FluxAudit audit{.emitted = problem_.emitted()};
  std::array<double, draw_count> totals{};
  const HalfDifferences& halves = solution_.halves;
  std::vector<float> out_errors = error_draws(halves.out).draws(0, draw_count);
  for (std::size_t i = 0; i < view_.matrix.size(); ++i) {
    const auto ends = ends_of(view_.matrix, i);
    const std::uint32_t element = plan_.element_at(i);
    const double area = plan_.elements().area(element);
    const double arrives = area * solution_.flux[i];
    const double c = reemitted_[i];
    const double leaving = area * leaves(i);
    audit.absorbed += arrives * (1 - c);
    audit.escaped += leaving * ends[to_sky] - area * c * halves.flux[i] * halves.out[i];
    audit.lost_back_face += leaving * ends[to_back];
    audit.lost_below += leaving * ends[to_below];
    audit.lost_side_limit += leaving * ends[to_side_limit];

    const auto of_out = std::span(out_errors).subspan(i * draw_count, draw_count);
    draws_->known_sum().correct(of_out);
    const auto of_flux = draws_->of_rank(i);
    const double on = error_parts()[i];
    const double out = ends[to_sky] + ends[to_back] + ends[to_below] + ends[to_side_limit];
    for (std::size_t draw = 0; draw < draw_count; ++draw) {
      totals[draw] += area * static_cast<double>(of_flux[draw]) * (1 - on + on * out) +
                      leaving * static_cast<double>(of_out[draw]);
    }
  }
  double squares = 0;
  for (const double total : totals) squares += total * total;
  if (audit.emitted > 0) audit.balance_std_error = std::sqrt(squares / draw_count) / audit.emitted;
  return audit;
}

// Patches are made of whole elements, so their errors need not know what facets differ.
FluxSpread Gathered::spread() const {
  return {.flux =
              [this](std::size_t f) {
                return mean_on_facet(plan_, f,
                                     [this](std::size_t rank) { return solution_.flux[rank]; });
              },
          .deviations =
              [this](std::size_t f, std::span<double> draws) {
                mean_draws_on_facet(plan_, f, draws_->all(), draws);
              },
          .count = draws_->count(),
          .divisor = static_cast<double>(draws_->count()),
          .unseen = unseen_};
}

double Gathered::target_measure() const {
  const auto of_response = response_error(problem_, [this](std::size_t) { return spread(); });
  return of_response ? *of_response : estimate(problem_.scene, problem_.patches, spread()).error;
}

FluxField Gathered::field(const FacetValues& values) const {
  const OnFacets on_facets(plan_, values, solution_.flux);
  FluxSpread on_joined = spread();
  on_joined.flux = [&](std::size_t f) {
    return std::max(on_facets.of<double, 1>(f, solution_.flux)[0], 0.0);
  };
  on_joined.deviations = [&](std::size_t f, std::span<double> draws) {
    std::ranges::copy(on_facets.of<float, draw_count>(f, draws_->all()), draws.begin());
  };
  FluxEstimate estimated = estimate(problem_.scene, problem_.patches, on_joined);
  return {.tallies = {std::move(estimated.tally)},
          .audit = audit(),
          .rays = plan_.total(),
          .segments = view_.flights,
          .error = estimated.error,
          .response_error = response_error(problem_, [&](std::size_t) { return on_joined; }),
          .max_facet_error = estimated.max_facet_error};
}

void settle_sticking(std::span<const FluxProblem> problems, const RayPlan& plan,
                     const FacetValues& values, const View& view, const Settle& settle) {
  std::vector<std::vector<double>> flux(problems.size());
  std::vector<std::vector<float>> arrivals(problems.size());
  do {
    for (std::size_t p = 0; p < problems.size(); ++p) {
      const FluxProblem& problem = problems[p];
      const std::vector<float> reemitted = reemitted_parts(problem, plan);
      flux[p] = solved_flux(view, ExchangeSolver(view.rows, reemitted), view.direct[p],
                            emission_of(problem, plan), settle.tolerance, flux[p]);
      arrivals[p] = flux_on(OnFacets(plan, values, flux[p]), values.facet_count(), flux[p]);
    }
  } while (settle.update(arrivals));
}

// The fluxes that the rays of a round tell, unless a few draws say that the target is missed.
struct Round {
  std::vector<FluxField> fields{};  ///< none if it is
  double error = 0;                 ///< the largest of all problems
};

Round solve_round(std::span<const FluxProblem> problems, const RayPlan& plan,
                  const FacetValues& values, const View& view, const Settle& settle, RayCap cap,
                  bool is_last) {
  const FluxOptions& options = problems.front().options;
  std::deque<Gathered> all;
  const auto begin_next = [&] {
    const std::size_t p = all.size();
    all.emplace_back(problems[p], plan, view, view.direct[p],
                     is_last ? mean_tolerance : rough_tolerance);
  };
  if (settle.passed_on) {
    std::vector<std::vector<float>> arrivals;
    while (all.size() < problems.size()) {
      begin_next();
      arrivals.push_back(all.back().arrivals(values));
    }
    const std::vector<std::vector<float>> passed_on = settle.passed_on(arrivals);
    for (std::size_t p = 0; p < all.size(); ++p) all[p].pass_on_errors_by(passed_on[p]);
  }
  Round round;
  for (std::size_t p = 0; p < problems.size(); ++p) {
    if (p == all.size()) begin_next();
    Gathered& gathered = all[p];
    if (!is_last) {
      gathered.draw(FluxDraws::at_once);
      const double rough = gathered.target_measure();
      if (rough > options.target_error) return {.error = rough};
      gathered.solve(mean_tolerance);
    }
    gathered.draw(draw_count);
    round.fields.push_back(gathered.field(values));
    const double measure = round.fields.back().target_measure();
    round.error = std::max(round.error, measure);
    if (options.rays == 0 && measure > options.target_error)
      round.fields.back().missed_by = plan.is_full() ? RayCap::elements : cap;
  }
  return round;
}

// How many times as many rays the next round has. The error of scrambled sets was seen to fall as
// n^-0.83 with their number; a few more make another round unlikely. Rays go on where they were, so
// that rounds on the way waste only their solves.
double growth_for(double error, double target) {
  constexpr double aim = 0.97;  // of the target
  return std::clamp(portable_power(error / (aim * target), 1.2), 1.1, 3.0);
}

}  // namespace

std::vector<FluxField> gather(std::span<const FluxProblem> problems, const Settle& settle) {
  if (problems.empty()) return {};
  const RayScene& scene = problems.front().scene;
  const FluxOptions& options = problems.front().options;
  // Shadows in a narrow lobe may be sharper than a joined element. In two dimensions an element has
  // no neighbours aside that its noise would average with, and rays are cheap.
  const bool is_diffuse = std::ranges::none_of(problems, is_looked_for);
  const Elements elements = elements_of(problems.front(), is_diffuse);
  const FacetValues values(problems.front().mesh, elements);
  RayPlan plan(scene, elements);
  const std::uint64_t scouts = is_diffuse ? aim_at_sky(problems.front(), plan) : 0;
  const RayLimit limit = ray_limit(options, plan.least_total(),
                                   sizeof(ExchangeMatrix::Ray) + sizeof(ExchangeRows::Seen));
  const std::uint64_t cap = limit.rays;
  auto view = std::make_shared<const View>(View{.flights = scouts});
  double rays = static_cast<double>(cap);
  if (options.rays == 0) {
    double first = 0;
    for (std::size_t rank = 0; rank < plan.size(); ++rank)
      first +=
          plan.block_of(rank).aims_at_sky ? first_rays_per_deep_element : first_rays_per_element;
    rays = std::min(rays, std::max(first, double{least_rays}));
  }
  plan.grow(rays / plan.surface(), cap);
  bool is_last = options.rays > 0;
  for (bool is_first = true;; is_first = false) {
    view = options.hits ? options.hits->look(problems, plan, view)
                        : std::make_shared<const View>(look(problems, plan, *view));
    const bool settles_at_once = settle.update && (is_first || is_last);
    const auto solve_now = [&] {
      return solve_round(problems, plan, values, *view, settle, limit.cap, is_last);
    };
    if (settles_at_once) settle_sticking(problems, plan, values, *view, settle);
    Round round = solve_now();
    if (settle.update && !settles_at_once && round.error <= options.target_error) {
      settle_sticking(problems, plan, values, *view, settle);
      round = solve_now();
    }
    if (is_last || round.error <= options.target_error) return std::move(round.fields);
    const double growth = growth_for(round.error, options.target_error);
    for (const std::uint64_t total = plan.total(); plan.total() == total && !is_last;) {
      rays *= growth;
      is_last = rays >= static_cast<double>(cap);
      plan.grow(rays / plan.surface(), cap);
    }
  }
}

}  // namespace scarp
