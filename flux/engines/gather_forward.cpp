#include "flux/engines/gather_forward.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "flux/engines/error_draws.h"
#include "flux/engines/first_arrivals.h"
#include "flux/engines/onward.h"

namespace scarp {

namespace {

// What the first round sends. Where most sticks few particles do, but whether it does they have to
// tell.
constexpr double first_rays_per_element = 8;
constexpr double first_particles_per_element = 4;
constexpr double least_particles = 1 << 10;
constexpr double most_first_particles = 1 << 13;

// Of so few rays in a set half differences tell the error of narrow light; two say too little.
constexpr std::uint32_t least_set = 4;

// A part of the solution: rays or particles, what they cost and what their noise does.
struct Part {
  double rays = 0;
  double most = 0;
  double flights = 0;
  double error = 0;
};

struct Flights {
  double direct = 0;
  double onward = 0;
};

// The fewest flights for an error, as the parts' own errors tell: that of first arrivals, from
// scrambled sets, falls as one over their flights, its square that of particles. By Lagrange's
// rule, with D / n and sqrt(O / m) for them, m^2 = O n^3 / (2 D^2).
Flights fewest(const Part& direct, const Part& onward, double error) {
  const double D = direct.error * direct.flights;
  const double O = onward.error * onward.error * onward.flights;
  SCARP_ASSERT(D, >=, 0);
  SCARP_ASSERT(O, >=, 0);
  if (D == 0) return {.direct = 1, .onward = O / (error * error)};
  const auto for_direct = [&](double n) { return Flights{n, std::sqrt(O * n / 2) * n / D}; };
  const auto reaches = [&](double n) {
    const double of_direct = D / n;
    const double square = O > 0 ? O / for_direct(n).onward : 0;
    return of_direct * of_direct + square <= error * error;
  };
  double enough = std::max(D / error, 1.0);
  while (!reaches(enough)) enough *= 2;
  for (double step = enough / 2; step > 1e-3 * enough; step /= 2)
    if (enough > step && reaches(enough - step)) enough -= step;
  return for_direct(enough);
}

// What first arrivals bring, of one quantity.
class Direct {
 public:
  /// sums as those of the first arrivals.
  Direct(const FluxOptions& options, const RayPlan& plan, const FirstArrivals& arrivals,
         const std::vector<double>& sums)
      : plan_(plan), mean_(plan.size()) {
    const auto sum_of = [&](std::size_t rank, double sign) {
      return (sums[rank * set_count] + sign * sums[rank * set_count + 1]) /
             (1.0 * arrivals.rays[rank] * set_count);
    };
    Differences of{.halves = std::vector<double>(plan.size())};
    for (std::size_t rank = 0; rank < plan.size(); ++rank) {
      mean_[rank] = sum_of(rank, 1);
      of.halves[rank] = sum_of(rank, -1);
    }
    const auto none = [](std::size_t) { return false; };
    deviation_ = ErrorDraws(options, plan, of, none).draws(0, draw_count);
  }

  FluxSpread spread() const {
    double unseen = 0;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank)
      unseen = std::max(unseen, area(rank) / (plan_.rays(rank) * set_count));
    return {.flux =
                [this](std::size_t f) {
                  return mean_on_facet(plan_, f, [this](std::size_t rank) { return mean_[rank]; });
                },
            .deviations =
                [this](std::size_t f, std::span<double> draws) {
                  mean_draws_on_facet(plan_, f, deviation_, draws);
                },
            .count = draw_count,
            .divisor = draw_count,
            .unseen = unseen};
  }

  // Flux times area on the whole surface.
  double total() const {
    double sum = 0;
    for (std::size_t rank = 0; rank < mean_.size(); ++rank) sum += area(rank) * mean_[rank];
    return sum;
  }
  double total_error() const {
    std::array<double, draw_count> errors{};
    for (std::size_t k = 0; k < deviation_.size(); ++k)
      errors[k % draw_count] += area(k / draw_count) * static_cast<double>(deviation_[k]);
    double squares = 0;
    for (const double error : errors) squares += error * error;
    return std::sqrt(squares / draw_count);
  }

 private:
  double area(std::size_t rank) const { return plan_.elements().area(plan_.element_at(rank)); }

  const RayPlan& plan_;
  std::vector<double> mean_;
  std::vector<float> deviation_;  // at rank * draw_count + draw
};

// What the borders of shadows leave unknown of the flux times area on the whole surface, at least.
//
// A border runs through one of few elements, and every other time the two sets there find as many
// rays that meet the source: half differences of so few say next to nothing then, and err by
// more than 4 of what they say every sixth time, as Student's t with one degree of freedom is. The
// number that meets the source, a part p of n, varies by n p (1 - p) where rays are drawn without
// order, in a scrambled set by n^0.5 p (1 - p) (see ErrorDraws); and by 1/6 where a border is as
// sharp as can be, and the number is only rounded up or down.
double unknown_of_borders(const RayPlan& plan, const FirstArrivals& found) {
  double variance = 0;
  for (const RayPlan::Window& window : plan.windows()) {
    for (const RayPlan::Block& block : window) {
      double flown = 0;
      double met = 0;
      double flux = 0;    // times area
      double varies = 0;  // of the number that meets the source, in a set
      for (std::uint32_t rank = block.begin; rank < block.end; ++rank) {
        const double n = static_cast<double>(found.flown[rank]) / set_count;
        const double part = n > 0 ? found.met[rank] / (n * set_count) : 0;
        const double area = plan.elements().area(plan.element_at(rank));
        const std::span<const double> sums =
            std::span(found.sums.front()).subspan(rank * set_count);
        varies += std::sqrt(n) * part * (1 - part);
        flown += found.flown[rank];
        met += found.met[rank];
        flux += area * (sums[0] + sums[1]) / (1.0 * found.rays[rank] * set_count);
      }
      if (met == 0 || met == flown) continue;
      const double of_ray = flux / (met / set_count);
      variance += of_ray * of_ray * std::max(varies, 1.0 / 6) / set_count;
    }
  }
  return std::sqrt(variance);
}

// Of parts whose errors are independent.
FluxSpread sum_of(const FluxSpread& a, const FluxSpread& b) {
  const double scale_a = 1 / std::sqrt(a.divisor);
  const double scale_b = 1 / std::sqrt(b.divisor);
  return {.flux = [a, b](std::size_t f) { return a.flux(f) + b.flux(f); },
          .deviations =
              [a, b, scale_a, scale_b](std::size_t f, std::span<double> of_facet) {
                const std::span<double> of_a = of_facet.first(a.count);
                const std::span<double> of_b = of_facet.subspan(a.count);
                a.deviations(f, of_a);
                b.deviations(f, of_b);
                for (double& each : of_a) each *= scale_a;
                for (double& each : of_b) each *= scale_b;
              },
          .count = a.count + b.count,
          .divisor = 1,
          .unseen = std::sqrt(a.unseen * a.unseen + b.unseen * b.unseen)};
}

class Solver {
 public:
  explicit Solver(const FluxProblem& problem);

  FluxField solve();

 private:
  void send();
  FluxField field();
  // Of all tallies.
  struct Spreads {
    std::vector<FluxSpread> direct;
    std::vector<FluxSpread> onward;
    std::vector<FluxSpread> total;
  };
  std::vector<double> response_sums() const;
  void find_response_errors(const Spreads& spreads, FluxField& field);
  double error_of(const FluxSpread& part, const FluxSpread& total) const;
  FluxAudit audit() const;
  bool ask_for_more(double error);

  const FluxProblem& problem_;
  const FluxOptions& options_;
  Elements elements_;
  RayPlan plan_;
  RayCap cap_ = RayCap::rays;
  FirstArrivals found_;
  Tracer tracer_;
  std::uint64_t particles_ = 0;
  double worth_ = 0;  // flux times area that a particle stands for
  Part direct_;
  Part onward_;
};

Solver::Solver(const FluxProblem& problem)
    : problem_(problem),
      options_(problem.options),
      elements_(elements_of(problem, {})),
      plan_(problem.scene, elements_, least_set, least_group_of_halves),
      tracer_(problem) {
  const RayLimit limit = ray_limit(options_, plan_.least_total(), sizeof(FirstArrivals::Lit));
  cap_ = limit.cap;
  const auto all = static_cast<double>(limit.rays);
  // Half of the rays for each part, if there are two.
  direct_.most = sticks_at_once(problem) ? all : all / 2;
  onward_.most = std::max(all - direct_.most, 1.0);
  const bool fixed = options_.rays > 0;
  const double first = first_rays_per_element * static_cast<double>(elements_.count());
  direct_.rays = fixed ? direct_.most : std::min(direct_.most, std::max(first, double{least_rays}));
  const double particles =
      std::clamp(first_particles_per_element * static_cast<double>(elements_.count()),
                 least_particles, most_first_particles);
  onward_.rays = fixed ? onward_.most : std::min(particles, onward_.most);
}

// What follows from first arrivals, ray by ray: tallies err together.
std::vector<double> Solver::response_sums() const {
  const auto responses = problem_.responses();
  std::vector<double> sums(found_.sums.front().size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const std::uint32_t element = plan_.element_at(i / set_count);
    for (std::size_t t = 0; t < responses.size(); ++t) {
      const double response = elements_.mean(
          element, [&](std::uint32_t f) { return static_cast<double>(responses[t][f]); });
      sums[i] += response * found_.sums[t][i];
    }
  }
  return sums;
}

// The errors of both parts and of all, of what follows from the flux.
void Solver::find_response_errors(const Spreads& spreads, FluxField& field) {
  const auto responses = problem_.responses();
  if (responses.empty()) return;
  const Direct direct(options_, plan_, found_, response_sums());
  const FluxSpread of_direct = direct.spread();
  const FluxSpread of_onward = sum_of_responses(spreads.onward, responses);
  const auto error = [&](const std::vector<FluxSpread>& tallies, const FluxSpread& sum) {
    std::vector<FluxSpread> seen = tallies;
    seen.front().flux = spreads.total.front().flux;
    return response_error(problem_.scene, problem_.patches, seen, responses, sum);
  };
  field.response_error = error(spreads.total, sum_of(of_direct, of_onward));
  direct_.error = error(spreads.direct, of_direct);
  onward_.error = error(spreads.onward, of_onward);
}

double Solver::error_of(const FluxSpread& part, const FluxSpread& total) const {
  FluxSpread spread = part;
  spread.flux = total.flux;
  return estimate(problem_.scene, problem_.patches, spread).error;
}

// Particles that go on are followed exactly, so the error of the balance is that of what arrives.
FluxAudit Solver::audit() const {
  const Direct arrivals(options_, plan_, found_, found_.sums.front());
  const Direct goes_on(options_, plan_, found_, found_.sums.back());
  const FluxAudit onward = tracer_.audit();
  const double emitted = problem_.scene.source_area();
  return {.emitted = emitted,
          .absorbed = arrivals.total() - goes_on.total() + worth_ * onward.absorbed,
          .escaped = worth_ * onward.escaped,
          .lost_back_face = worth_ * onward.lost_back_face,
          .lost_below = worth_ * onward.lost_below,
          .lost_side_limit = worth_ * onward.lost_side_limit,
          .roulette = worth_ * onward.roulette,
          .balance_std_error =
              std::max(arrivals.total_error(), unknown_of_borders(plan_, found_)) / emitted};
}

// More rays and more particles. Earlier particles started from fewer rays, in the same proportions
// but for their errors.
void Solver::send() {
  plan_.grow(direct_.rays / plan_.surface(), static_cast<std::uint64_t>(direct_.most));
  if (plan_.is_full()) direct_.most = direct_.rays;
  found_ = look_for_source(problem_, plan_, std::move(found_));
  const std::uint64_t wanted = static_cast<std::uint64_t>(onward_.rays);
  const OnwardParticles particles(problem_, plan_, found_,
                                  wanted > particles_ ? wanted - particles_ : 0, particles_);
  tracer_.trace_on(particles.count(), [&](std::uint64_t first, std::span<Particle> some) {
    for (Particle& particle : some) particle = particles.start(first++);
  });
  particles_ += particles.count();
  worth_ = particles_ > 0 ? particles.total() / static_cast<double>(particles_) : 0;
  direct_.flights = static_cast<double>(found_.flights);
  onward_.flights = static_cast<double>(tracer_.segments());
}

FluxField Solver::field() {
  FluxField field{.audit = audit(),
                  .rays = found_.flights + particles_,
                  .segments = found_.flights + tracer_.segments()};
  std::vector<Direct> direct;
  Spreads spreads;
  direct.reserve(found_.sums.size());
  for (std::size_t tally = 0; tally + 1 < found_.sums.size(); ++tally) {
    spreads.direct.push_back(
        direct.emplace_back(options_, plan_, found_, found_.sums[tally]).spread());
    spreads.onward.push_back(tracer_.spread(tally, worth_));
    const FluxSpread& total =
        spreads.total.emplace_back(sum_of(spreads.direct.back(), spreads.onward.back()));
    FluxEstimate estimated = estimate(problem_.scene, problem_.patches, total);
    if (tally == 0) {
      field.error = estimated.error;
      field.max_facet_error = estimated.max_facet_error;
      direct_.error = error_of(spreads.direct[0], total);
      onward_.error = error_of(spreads.onward[0], total);
    } else {
      estimated.tally.quantity = Tally::Quantity::yield;
    }
    field.tallies.push_back(std::move(estimated.tally));
  }
  find_response_errors(spreads, field);
  if (options_.rays == 0 && field.target_measure() > options_.target_error)
    field.missed_by = plan_.is_full() ? RayCap::elements : cap_;
  return field;
}

// A few more make another round unlikely. False at the caps. A part without flights tells nothing
// of how many it takes: particles go on from few rays or none where nearly all sticks.
bool Solver::ask_for_more(double error) {
  if (options_.rays > 0 || error <= options_.target_error) return false;
  const auto grow = [](Part& part, double flights) {
    constexpr double most_growth = 16;
    if (part.flights == 0) return false;
    const double growth = std::min(flights / part.flights, most_growth);
    const double wanted = std::min(part.most, part.rays * growth);
    const bool grows = wanted > part.rays;
    part.rays = std::max(part.rays, wanted);
    return grows;
  };
  const Flights wanted = fewest(direct_, onward_, 0.9 * options_.target_error);
  const bool direct_grows = grow(direct_, wanted.direct);
  return grow(onward_, wanted.onward) || direct_grows;
}

FluxField Solver::solve() {
  for (;;) {
    send();
    FluxField result = field();
    if (!ask_for_more(result.target_measure())) return result;
  }
}

}  // namespace

FluxField gather_forward(const FluxProblem& problem) { return Solver(problem).solve(); }

}  // namespace scarp
