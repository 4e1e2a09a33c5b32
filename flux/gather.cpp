#include "flux/gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <numbers>
#include <optional>

#include "core/parallel.h"
#include "flux/error_draws.h"
#include "flux/facet_values.h"
#include "flux/flux_draws.h"
#include "flux/kept_hits.h"
#include "flux/portable_math.h"
#include "flux/radiosity.h"
#include "flux/view.h"

namespace scarp {

namespace {

// What the first round sends, on average: deep down too few rays say nothing of use.
constexpr double first_rays_per_element = 8;
constexpr double first_rays_per_deep_element = 16;

// Of the cells in which elements are joined, in spacings: from the first one half of it until what
// their size leaves is no more than this part of the target. A fixed number of rays has no target.
constexpr double widest_cell = 8;
constexpr double cell_of_fixed_rays = 2;
constexpr double narrowest_cell = 1;
constexpr double most_bias = 1.0 / 3;

constexpr double mean_tolerance = 1e-7;

// What the error needs.
constexpr double rough_tolerance = 1e-4;

// By rank, half of what elements' two sets say apart.
struct HalfDifferences {
  std::vector<double> flux;  // of direct flux plus re-emitted flux seen
  std::vector<double> out;   // of the part of rays that met no facet
  std::vector<double> lost;  // of what leaves along these
};

double square(double x) { return x * x; }

// What one set of an element's rays tells of all that it sees.
struct Told {
  double flux = 0;
  double out = 0;
  double lost = 0;
};

// What a set lacks it takes from the other, as the rows of the matrix do.
// Shape: direct, the sums of weights of the sets.
std::array<Told, set_count> told_by_sets(const View& view, std::size_t row,
                                         std::span<const float> direct,
                                         const Radiosity& radiosity) {
  const ExchangeMatrix& matrix = view.matrix;
  std::array<Told, set_count> others{};
  std::array<double, set_count> to_sky_beyond{};  // that leaves more than the mean
  const auto rays = matrix.row(row);
  const auto places = std::span(view.places).subspan(matrix.first[row], rays.size());
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const auto weight = static_cast<double>(rays[k].weight);
    const std::uint32_t hit = rays[k].hit;
    if (hit < matrix.size()) {
      others[k % set_count].flux +=
          weight * (radiosity.leaves(hit) + dot(radiosity.slopes()[hit], Vec3d(places[k])));
    } else if (hit != matrix.size() + to_sky) {
      others[k % set_count].out += weight;
    } else {
      to_sky_beyond[k % set_count] += weight * dot(radiosity.slopes()[row], Vec3d(places[k]));
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
    told[set].lost = radiosity.leaves(row) * told[set].out + per_ray * to_sky_beyond[set];
  }
  return told;
}

HalfDifferences half_differences(const View& view, const std::vector<float>& direct,
                                 const Radiosity& radiosity) {
  static_assert(set_count == 2);
  const ExchangeMatrix& matrix = view.matrix;
  HalfDifferences halves{std::vector<double>(matrix.size()), std::vector<double>(matrix.size()),
                         std::vector<double>(matrix.size())};
  parallel_for(matrix.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto told =
          told_by_sets(view, i, std::span(direct).subspan(i * set_count, set_count), radiosity);
      halves.flux[i] = (told[0].flux - told[1].flux) / 2;
      halves.out[i] = (told[0].out - told[1].out) / 2;
      halves.lost[i] = (told[0].lost - told[1].lost) / 2;
    }
  });
  return halves;
}

// Takes the flux of elements and its errors to facets: along the planes of elements, but nowhere
// below zero.
class OnFacets {
 public:
  /// flux: by rank, of a problem of a view; it has to outlive this.
  OnFacets(const FluxProblem& problem, const RayPlan& plan, const FacetValues& values,
           const View& view, std::size_t number, std::span<const double> flux);

  double flux(std::size_t facet) const;
  /// Shape: draw_count for each rank, of which the first ones are taken.
  void draws(std::size_t facet, std::span<const float> of_ranks, std::span<double> draws) const;
  /// What makes the flux of a facet another one than with constants on elements.
  struct Changes {
    double by_planes = 0;  ///< of what elements send
    double by_tilts = 0;   ///< of facets from their elements
    /// How far the flux is from its planes, as far as neighbours show that it bends.
    double beyond_planes = 0;
  };
  /// Shape: by rank, the flux with constants.
  Changes changes(std::size_t facet, std::span<const double> constants) const;

 private:
  double of_element(std::size_t e) const { return flux_[plan_.rank_of(e)]; }
  void find_plane(std::size_t e);
  double by_tilt(std::size_t e, std::size_t facet) const;

  const FluxProblem& problem_;
  const RayPlan& plan_;
  const FacetValues& values_;
  std::span<const double> flux_;
  std::vector<Vec3d> with_normal_;
  // Of the flux on each element.
  struct Plane {
    Vec3d slope;
    double part = 1;  // of what neighbours say of the slope; less where the flux would be negative
    double bend = 0;
    double square = 0;  // of distances from the middle, mean
  };
  std::vector<Plane> planes_;
};

OnFacets::OnFacets(const FluxProblem& problem, const RayPlan& plan, const FacetValues& values,
                   const View& view, std::size_t number, std::span<const double> flux)
    : problem_(problem),
      plan_(plan),
      values_(values),
      flux_(flux),
      with_normal_(change_with_normal(view, number, flux)),
      planes_(plan.size()) {
  parallel_for(plan.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) find_plane(e);
  });
}

void OnFacets::find_plane(std::size_t e) {
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
double OnFacets::by_tilt(std::size_t e, std::size_t facet) const {
  return dot(with_normal_[plan_.rank_of(e)],
             problem_.scene.normal(facet) - plan_.elements().normal(e));
}

double OnFacets::flux(std::size_t facet) const {
  double sum = 0;
  for (const FacetValues::Part& part : values_.parts_of(facet))
    sum += static_cast<double>(part.share) *
               (of_element(part.element) + by_tilt(part.element, facet)) +
           dot(Vec3d(part.offset), planes_[part.element].slope);
  return std::max(sum, 0.0);
}

void OnFacets::draws(std::size_t facet, std::span<const float> of_ranks,
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

OnFacets::Changes OnFacets::changes(std::size_t facet, std::span<const double> constants) const {
  Changes sum;
  for (const FacetValues::Part& part : values_.parts_of(facet)) {
    const auto share = static_cast<double>(part.share);
    const double here = of_element(part.element);
    sum.by_planes += share * (here - constants[plan_.rank_of(part.element)]);
    sum.by_tilts += share * by_tilt(part.element, facet);
    const Plane& plane = planes_[part.element];
    const Vec3d away = Vec3d(part.offset) / share;
    sum.beyond_planes += share * plane.bend * (dot(away, away) - plane.square);
  }
  return sum;
}

// What facets get is nowhere below zero.
std::vector<float> flux_on(const OnFacets& on_facets, std::size_t count) {
  std::vector<float> flux(count);
  parallel_for(count, 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) flux[f] = static_cast<float>(on_facets.flux(f));
  });
  return flux;
}

// What the rays found for one problem, and its solution.
class Gathered {
 public:
  Gathered(const FluxProblem& problem, const RayPlan& plan, const FacetValues& values,
           const View& view, std::size_t number, double tolerance);

  void solve(double tolerance) { radiosity_.solve(tolerance); }
  std::vector<float> arrivals() const { return flux_on(on_facets(), values_.facet_count()); }
  /// Before the first draw. Shape: the part that every facet passes on, as of Settle::passed_on.
  void pass_on_errors_by(std::span<const float> of_facets);
  /// More draws of the error, up to a number of them.
  void draw(std::size_t count);
  /// What is compared with the target.
  double target_measure() const;
  double bias_measure() const;
  /// By window, what each element's relative error of a single ray squared is, summed up.
  void add_variances(std::span<double> of_windows) const;
  FluxField field() const;

 private:
  std::span<const double> flux() const { return radiosity_.flux(); }
  OnFacets on_facets() const { return {problem_, plan_, values_, view_, number_, flux()}; }
  static constexpr std::size_t bias_count = 3;
  FluxSpread bias(const OnFacets& on_facets) const;
  FluxSpread spread(const OnFacets& on_facets) const;
  double measure(const FluxSpread& spread) const;
  double unknown_of_strips(std::size_t facet) const;
  double unknown_of_emission(std::size_t facet) const;
  FluxAudit audit() const;
  bool errors_stick_alike() const { return passed_on_.empty(); }
  // Of which elements pass on errors.
  std::span<const float> error_parts() const {
    return errors_stick_alike() ? reemitted_ : passed_on_;
  }
  // What re-emits and yet has no flux has no error; without sticking, one there would have no end.
  bool is_in_void(std::size_t rank) const { return reemitted_[rank] > 0 && flux()[rank] == 0; }
  ErrorDraws error_draws(std::span<const double> halves) const;
  std::vector<double> weights() const;

  const FluxProblem& problem_;
  const RayPlan& plan_;
  const FacetValues& values_;
  const View& view_;
  std::size_t number_;  // of the problem
  std::vector<float> reemitted_;
  std::vector<float> passed_on_;  // of errors; empty where as much as of the flux
  std::vector<double> emission_;
  ExchangeSolver exchange_;
  Radiosity radiosity_;
  HalfDifferences halves_;
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

Gathered::Gathered(const FluxProblem& problem, const RayPlan& plan, const FacetValues& values,
                   const View& view, std::size_t number, double tolerance)
    : problem_(problem),
      plan_(plan),
      values_(values),
      view_(view),
      number_(number),
      reemitted_(reemitted_parts(problem, plan)),
      emission_(emission_of(problem, plan)),
      exchange_(view.rows, reemitted_),
      radiosity_(plan, values, view, reemitted_, emission_, exchange_,
                 first_flux(view, view.direct[number], emission_)) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    // Rays that are aimed at the sky see little else.
    const double part = plan.block_of(rank).aims_at_sky ? 1 - 1.0 / RayPlan::rays_per_skyward : 1;
    const double rays = part * static_cast<double>(plan.rays(rank) * set_count);
    unseen_ = std::max(unseen_, plan.elements().area(plan.element_at(rank)) / rays);
  }
  // Always anew: where nothing arrives the flux is zero to the bit only from a start that is.
  solve(tolerance);
  halves_ = half_differences(view, view.direct[number], radiosity_);
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
      sum += of_element * square(weights[rank] * halves_.flux[rank]) * n * std::sqrt(n);
    }
    of_windows[w] += sum / area;
  }
}

void Gathered::draw(std::size_t count) {
  if (!draws_) {
    double largest = 0;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank)
      largest = std::max({largest, flux()[rank], radiosity_.leaves(rank)});
    draws_.emplace(plan_, view_.matrix, view_.rows, errors_stick_alike() ? &exchange_ : nullptr,
                   error_parts(), error_draws(halves_.flux), weights(), largest);
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

// The mean over an element's rays, of those to the sky, of weights times where they started.
Vec3d sky_moment(const View& view, std::size_t row) {
  const auto rays = view.matrix.row(row);
  Vec3d sum;
  for (std::size_t k = 0; k < rays.size(); ++k)
    if (rays[k].hit == view.matrix.size() + to_sky)
      sum += static_cast<double>(rays[k].weight) * Vec3d(view.places[view.matrix.first[row] + k]);
  return sum / static_cast<double>(rays.size());
}

// Books what the elements absorb and where their re-emitted particles end. In units of source
// particles per squared spacing. Flux and part that leaves come from the same rays, so the product
// of their means is too large by their covariance, which the half differences tell.
FluxAudit Gathered::audit() const {
  FluxAudit audit{.emitted = problem_.emitted()};
  std::array<double, draw_count> totals{};
  const HalfDifferences& halves = halves_;
  std::vector<float> lost_errors = error_draws(halves.lost).draws(0, draw_count);
  for (std::size_t i = 0; i < view_.matrix.size(); ++i) {
    const auto ends = ends_of(view_.matrix, i);
    const std::uint32_t element = plan_.element_at(i);
    const double area = plan_.elements().area(element);
    const double arrives = area * flux()[i];
    const double c = reemitted_[i];
    const double leaving = area * radiosity_.leaves(i);
    audit.absorbed += arrives * (1 - c);
    audit.escaped += leaving * ends[to_sky] +
                     area * dot(radiosity_.slopes()[i], sky_moment(view_, i)) -
                     area * c * halves.flux[i] * halves.out[i];
    audit.lost_back_face += leaving * ends[to_back];
    audit.lost_below += leaving * ends[to_below];
    audit.lost_side_limit += leaving * ends[to_side_limit];

    const auto of_lost = std::span(lost_errors).subspan(i * draw_count, draw_count);
    draws_->known_sum().correct(of_lost);
    const auto of_flux = draws_->of_rank(i);
    const double on = error_parts()[i];
    const double out = ends[to_sky] + ends[to_back] + ends[to_below] + ends[to_side_limit];
    for (std::size_t draw = 0; draw < draw_count; ++draw) {
      totals[draw] += area * static_cast<double>(of_flux[draw]) * (1 - on + on * out) +
                      area * static_cast<double>(of_lost[draw]);
    }
  }
  double squares = 0;
  for (const double total : totals) squares += total * total;
  if (audit.emitted > 0) audit.balance_std_error = std::sqrt(squares / draw_count) / audit.emitted;
  return audit;
}

// What elements of a finite size leave uncertain, each on all facets together: a part of what
// planes in place of constants change, a part of what normals of facets change, and how far the
// flux may be from the planes. Against fine elements, in a trench and a hole of aspect ratio 2 with
// sticking .01 to 1, these parts were seen to be left.
FluxSpread Gathered::bias(const OnFacets& on_facets) const {
  constexpr double of_planes = 0.1;
  constexpr double of_tilts = 0.3;
  return {.flux = [&](std::size_t f) { return on_facets.flux(f); },
          .deviations =
              [&](std::size_t f, std::span<double> each) {
                const auto [by_planes, by_tilts, beyond_planes] =
                    on_facets.changes(f, radiosity_.flux_of_constants());
                each[0] = of_planes * by_planes;
                each[1] = of_tilts * by_tilts;
                each[2] = beyond_planes;
              },
          .count = bias_count};
}

// On patches, and on single facets, whose noise is larger, with a part of it. What normals change
// on facets does not become less with smaller elements.
//
// A floor between walls may be one element across: its flux was seen to be off by 8 % in places
// where elements of eight spacings cover a floor of twenty.
double Gathered::unknown_of_strips(std::size_t facet) const {
  constexpr double of_widest = 0.08;
  double share = 0;
  for (const FacetValues::Part& part : values_.parts_of(facet))
    if (values_.is_strip(part.element)) share += static_cast<double>(part.share);
  return share * of_widest * square(plan_.elements().cell_width() / widest_cell);
}

// What single facets of an element emit more than all is seen nearby.
double Gathered::unknown_of_emission(std::size_t facet) const {
  constexpr double seen_nearby = 0.3;
  const std::vector<float>& of_facets = problem_.species.emission;
  if (of_facets.empty()) return 0;
  double more = 0;
  for (const FacetValues::Part& part : values_.parts_of(facet))
    more += static_cast<double>(part.share) *
            (static_cast<double>(of_facets[facet]) - emission_[plan_.rank_of(part.element)]);
  return seen_nearby * std::abs(more);
}

double Gathered::bias_measure() const {
  constexpr double of_facets = 1.0 / 3;
  const OnFacets on_facets = this->on_facets();
  const FluxSpread of_size = bias(on_facets);
  const auto responses = problem_.responses();
  double squares = 0;
  double area = 0;
  for (std::size_t f = 0; f < problem_.scene.facet_count(); ++f) {
    std::array<double, bias_count> each{};
    of_size.deviations(f, each);
    const double flux = on_facets.flux(f);
    if (flux == 0) continue;
    const double counts = responses.empty() ? 1 / std::max(flux, small_flux)
                                            : std::abs(static_cast<double>(responses.front()[f]));
    const double of_others = flux * unknown_of_strips(f) + unknown_of_emission(f);
    squares += problem_.scene.area(f) * square(counts * std::hypot(each[0], each[2], of_others));
    area += problem_.scene.area(f);
  }
  return area > 0 ? std::max(of_facets * std::sqrt(squares / area), measure(of_size)) : 0;
}

FluxSpread Gathered::spread(const OnFacets& on_facets) const {
  const FluxSpread of_size = bias(on_facets);
  const double scale = std::sqrt(static_cast<double>(draws_->count()));
  return {.flux = of_size.flux,
          .deviations =
              [this, &on_facets, of_size, scale](std::size_t f, std::span<double> of_facet) {
                const std::span<double> biases = of_facet.last(of_size.count);
                of_size.deviations(f, biases);
                for (double& each : biases) each *= scale;
                on_facets.draws(f, draws_->all(), of_facet.first(draws_->count()));
              },
          .count = draws_->count() + of_size.count,
          .divisor = static_cast<double>(draws_->count()),
          .unseen = unseen_};
}

double Gathered::measure(const FluxSpread& spread) const {
  const auto of_response = response_error(problem_, [&](std::size_t) { return spread; });
  return of_response ? *of_response : estimate(problem_.scene, problem_.patches, spread).error;
}

double Gathered::target_measure() const {
  const OnFacets on_facets = this->on_facets();
  return measure(spread(on_facets));
}

FluxField Gathered::field() const {
  const OnFacets on_facets = this->on_facets();
  const FluxSpread all = spread(on_facets);
  FluxEstimate estimated = estimate(problem_.scene, problem_.patches, all);
  return {.tallies = {std::move(estimated.tally)},
          .audit = audit(),
          .rays = plan_.total(),
          .segments = view_.flights,
          .error = estimated.error,
          .bias = measure(bias(on_facets)),
          .response_error = response_error(problem_, [&](std::size_t) { return all; }),
          .max_facet_error = estimated.max_facet_error};
}

// The fluxes that the rays of a round tell, unless a few draws say that the target is missed.
struct Round {
  std::vector<FluxField> fields{};  ///< none if it is
  double error = 0;                 ///< the largest of all problems
  double bias = 0;
  std::vector<double> densities{};  ///< of rays, by window, for the fewest in all
};

// With variance s / n^1.5 of an element of area A that sends n rays, the sum of areas times
// variances is least for a given number of rays where n goes as (s A)^0.4. In steps, so that fluxes
// that differ little have the same rays.
std::vector<double> densities_for(const RayPlan& plan, std::span<const double> variances) {
  constexpr double most = 4;
  const auto windows = plan.windows();
  std::vector<double> densities(windows.size());
  double rays = 0;
  double area = 0;
  for (std::size_t w = 0; w < windows.size(); ++w) {
    double of_window = 0;
    const std::uint32_t begin = windows[w].front().begin;
    const std::uint32_t end = windows[w].back().end;
    for (std::uint32_t rank = begin; rank < end; ++rank)
      of_window += plan.elements().area(plan.element_at(rank));
    const double of_element = of_window / (end - begin);
    densities[w] = portable_power(variances[w] * of_element, 0.4) / of_element;
    rays += densities[w] * of_window;
    area += of_window;
  }
  for (double& density : densities) {
    if (rays > 0) density *= area / rays;
    density = std::ldexp(1, std::ilogb(std::numbers::sqrt2 * std::clamp(density, 1 / most, most)));
  }
  return densities;
}

// The elements of some problems, their rays and what these see.
class Gathering {
 public:
  Gathering(std::span<const FluxProblem> problems, const Settle& settle,
            std::optional<double> width);

  /// Nothing if the elements are too wide for the target.
  std::optional<std::vector<FluxField>> solve();

 private:
  bool are_joined() const { return width_ && !options_.two_dimensional && options_.rings.empty(); }
  bool is_too_wide(const Round& round) const;
  void grow(double error);
  void look();
  Round solve_round();
  void settle_sticking();

  std::span<const FluxProblem> problems_;
  const FluxOptions& options_;
  const Settle& settle_;
  std::optional<double> width_;
  Elements elements_;
  FacetValues values_;
  RayPlan plan_;
  RayLimit limit_{};
  double rays_ = 0;
  bool is_last_;
  std::shared_ptr<const View> view_;
};

Gathering::Gathering(std::span<const FluxProblem> problems, const Settle& settle,
                     std::optional<double> width)
    : problems_(problems),
      options_(problems.front().options),
      settle_(settle),
      width_(width),
      elements_(elements_of(problems.front(), width)),
      values_(problems.front().mesh, elements_),
      plan_(problems.front().scene, elements_),
      is_last_(options_.rays > 0) {
  const std::uint64_t scouts = width ? aim_at_sky(problems.front(), plan_) : 0;
  limit_ = ray_limit(options_, plan_.least_total(),
                     sizeof(ExchangeMatrix::Ray) + sizeof(ExchangeRows::Seen) + 2 * sizeof(Vec3f));
  view_ = std::make_shared<const View>(View{.flights = scouts});
  rays_ = static_cast<double>(limit_.rays);
  if (options_.rays == 0) {
    double first = 0;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank)
      first +=
          plan_.block_of(rank).aims_at_sky ? first_rays_per_deep_element : first_rays_per_element;
    rays_ = std::min(rays_, std::max(first, double{least_rays}));
  }
  plan_.grow(rays_ / plan_.surface(), limit_.rays);
}

void Gathering::settle_sticking() {
  std::vector<std::vector<double>> flux(problems_.size());
  std::vector<std::vector<float>> arrivals(problems_.size());
  do {
    for (std::size_t p = 0; p < problems_.size(); ++p) {
      const FluxProblem& problem = problems_[p];
      const std::vector<float> reemitted = reemitted_parts(problem, plan_);
      const std::vector<double> emission = emission_of(problem, plan_);
      const ExchangeSolver exchange(view_->rows, reemitted);
      Radiosity radiosity(plan_, values_, *view_, reemitted, emission, exchange,
                          first_flux(*view_, view_->direct[p], emission));
      radiosity.solve(settle_.tolerance, flux[p]);
      flux[p] = radiosity.flux();
      arrivals[p] =
          flux_on(OnFacets(problem, plan_, values_, *view_, p, flux[p]), values_.facet_count());
    }
  } while (settle_.update(arrivals));
}

Round Gathering::solve_round() {
  std::deque<Gathered> all;
  const auto begin_next = [&] {
    const std::size_t p = all.size();
    all.emplace_back(problems_[p], plan_, values_, *view_, p,
                     is_last_ ? mean_tolerance : rough_tolerance);
  };
  if (settle_.passed_on) {
    std::vector<std::vector<float>> arrivals;
    while (all.size() < problems_.size()) {
      begin_next();
      arrivals.push_back(all.back().arrivals());
    }
    const std::vector<std::vector<float>> passed_on = settle_.passed_on(arrivals);
    for (std::size_t p = 0; p < all.size(); ++p) all[p].pass_on_errors_by(passed_on[p]);
  }
  Round round;
  std::vector<double> variances(plan_.windows().size());
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    if (p == all.size()) begin_next();
    all[p].add_variances(variances);
    round.bias = std::max(round.bias, all[p].bias_measure());
    if (is_last_) continue;
    all[p].draw(FluxDraws::at_once);
    round.error = std::max(round.error, all[p].target_measure());
  }
  round.densities = densities_for(plan_, variances);
  if (round.error > options_.target_error && !is_last_) return round;
  for (Gathered& gathered : all) {
    if (!is_last_) gathered.solve(mean_tolerance);
    gathered.draw(draw_count);
    round.fields.push_back(gathered.field());
    const double measure = round.fields.back().target_measure();
    round.error = std::max(round.error, measure);
    if (options_.rays == 0 && measure > options_.target_error)
      round.fields.back().missed_by = plan_.is_full() ? RayCap::elements : limit_.cap;
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

void Gathering::grow(double error) {
  const double growth = growth_for(error, options_.target_error);
  for (const std::uint64_t total = plan_.total(); plan_.total() == total && !is_last_;) {
    rays_ *= growth;
    is_last_ = rays_ >= static_cast<double>(limit_.rays);
    plan_.grow(rays_ / plan_.surface(), limit_.rays);
  }
}

void Gathering::look() {
  view_ = options_.hits ? options_.hits->look(problems_, plan_, width_.value_or(0), view_)
                        : std::make_shared<const View>(scarp::look(problems_, plan_, *view_));
}

// Long before the error has come down to what their size leaves, that is as well known as later.
bool Gathering::is_too_wide(const Round& round) const {
  constexpr double soon = 10;
  if (!are_joined() || options_.rays > 0 || *width_ <= narrowest_cell) return false;
  return round.bias > most_bias * options_.target_error && round.error < soon * round.bias;
}

std::optional<std::vector<FluxField>> Gathering::solve() {
  for (bool is_first = true;; is_first = false) {
    look();
    const bool settles_at_once = settle_.update && (is_first || is_last_);
    if (settles_at_once) settle_sticking();
    Round round = solve_round();
    if (settle_.update && !settles_at_once && round.error <= options_.target_error) {
      settle_sticking();
      round = solve_round();
    }
    if (is_too_wide(round)) return std::nullopt;
    if (is_last_ || round.error <= options_.target_error) return std::move(round.fields);
    // A narrow lobe has borders of shadows, which the few rays of a first round find by chance.
    if (is_first && are_joined()) plan_.weigh(round.densities);
    grow(round.error);
  }
}

}  // namespace

// Shadows in a narrow lobe may be sharper than a joined element. In two dimensions an element has
// no neighbours aside that its noise would average with, and rays are cheap.
std::vector<FluxField> gather(std::span<const FluxProblem> problems, const Settle& settle) {
  if (problems.empty()) return {};
  if (std::ranges::any_of(problems, is_looked_for))
    return *Gathering(problems, settle, std::nullopt).solve();
  const bool is_fixed = problems.front().options.rays > 0;
  for (double width = is_fixed ? cell_of_fixed_rays : widest_cell;; width /= 2)
    if (auto fields = Gathering(problems, settle, width).solve()) return std::move(*fields);
}

}  // namespace scarp
