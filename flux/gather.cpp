#include "flux/gather.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "flux/exchange.h"
#include "flux/portable_math.h"
#include "flux/sampling.h"
#include "flux/sobol.h"
#include "flux/spatial_order.h"

namespace scarp {

namespace {

// Independent sets of rays from a facet, and draws of the error of all facets.
constexpr std::size_t set_count = 2;
constexpr std::size_t draw_count = 32;

// Rays in a set.
constexpr std::uint32_t least_set = 2;
constexpr std::uint32_t most_in_set = 1U << 16;

constexpr double first_rays_per_facet = 8;

// Facets in a row along the curve that share their error estimate.
constexpr std::size_t error_window = 16;

constexpr std::size_t pool_size = std::size_t{1} << 16;  // rays
constexpr double mean_tolerance = 1e-7;
constexpr double deviation_tolerance = 1e-2;

// Where a ray ended that met no facet: added to the number of facets.
enum Fate : std::uint32_t { to_sky, to_back, to_below, to_side_limit, fate_count };

// Facets along a space-filling curve, one main direction after the other: neighbours on the
// surface are neighbours in the list. From here on a facet is known by its place in it, its rank.
struct Curve {
  std::vector<std::uint32_t> facet_at;
  std::vector<std::uint32_t> rank_of;
};

Curve curve_through(const RayScene& scene) {
  Curve curve;
  std::vector<std::uint64_t> keys(scene.facet_count());
  const Vec3d size{scene.upper().x, scene.upper().y, scene.source_height() - scene.lowest()};
  const double largest = std::max({size.x, size.y, size.z});
  for (std::size_t f = 0; f < keys.size(); ++f) {
    const auto& [a, b, c] = scene.corners(f);
    const Vec3d r = (Vec3d(a) + Vec3d(b) + Vec3d(c)) / 3.0;
    keys[f] = curve_key({r.x / largest, r.y / largest, (r.z - scene.lowest()) / largest},
                        main_direction(scene.normal(f)));
  }
  curve.facet_at.resize(keys.size());
  std::iota(curve.facet_at.begin(), curve.facet_at.end(), 0U);
  std::sort(curve.facet_at.begin(), curve.facet_at.end(), [&](std::uint32_t f, std::uint32_t g) {
    return keys[f] != keys[g] ? keys[f] < keys[g] : f < g;
  });
  curve.rank_of.resize(keys.size());
  for (std::uint32_t rank = 0; rank < keys.size(); ++rank)
    curve.rank_of[curve.facet_at[rank]] = rank;
  return curve;
}

// How many rays leave each facet, in each of its sets.
struct RayPlan {
  Curve curve;
  std::vector<std::uint32_t> rays;   // by rank; powers of two, which make the best sets
  std::vector<std::uint64_t> first;  // of each rank's rays in one set

  std::uint64_t total() const { return first.back() * set_count; }
};

// As many rays per area everywhere, since errors are judged on patches of the same area.
void set_rays(const RayScene& scene, double rays_per_area, RayPlan& plan) {
  plan.rays.resize(scene.facet_count());
  plan.first.assign(scene.facet_count() + 1, 0);
  for (std::size_t rank = 0; rank < plan.rays.size(); ++rank) {
    const double share = rays_per_area * scene.area(plan.curve.facet_at[rank]) / set_count;
    std::uint32_t rays = least_set;
    while (rays < most_in_set && rays * std::numbers::sqrt2 < share) rays *= 2;
    plan.rays[rank] = rays;
    plan.first[rank + 1] = plan.first[rank] + rays;
  }
}

// At most cap rays, unless that is less than the least set of every facet.
void plan_rays(const RayScene& scene, double rays_per_area, std::uint64_t cap, RayPlan& plan) {
  const std::uint64_t least = scene.facet_count() * set_count * least_set;
  do {
    set_rays(scene, rays_per_area, plan);
    rays_per_area *= 0.9;
  } while (plan.total() > std::max(cap, least));
}

// What the rays saw. Ray j of a set is entry j * set_count + set of the facet's matrix row.
struct View {
  ExchangeMatrix matrix;
  std::vector<std::vector<float>> direct;  // per problem, at rank * set_count + set
  std::uint64_t flights = 0;
};

// The part of the direct flux that a ray to the sky along u stands for. For n = 1 rays by
// Lambert's law all count the same; otherwise they share the work with rays along the lobe.
double sky_weight(Vec3d u, Vec3d n, double power) {
  if (power == 1) return 1;
  const double cosine = dot(u, n);
  if (cosine <= 0 || u.z <= 0) return 0;
  const double radiance = (power + 1) / (2 * std::numbers::pi) * portable_power(u.z, power - 1);
  return radiance * cosine / (cosine / std::numbers::pi + radiance * u.z);
}

class Viewer {
 public:
  Viewer(std::span<const FluxProblem> problems, const RayPlan& plan);

  View view() const;

 private:
  // A ray from a facet, with its direction before projection to a cross-section.
  struct Shot {
    Ray ray;
    Vec3d u;
    std::uint32_t rank = 0;
    std::uint32_t set = 0;
  };

  void shoot(std::size_t rank, const FluxProblem* lobe, std::vector<Shot>& shots) const;
  std::vector<Shot> shoot_all(std::size_t begin, std::size_t end, const FluxProblem* lobe) const;
  std::vector<Flight> fly(const std::vector<Shot>& shots) const;
  void view_by_lambert(std::size_t begin, std::size_t end, View& view) const;
  void view_by_lobe(std::size_t begin, std::size_t end, std::size_t problem, View& view) const;
  Vec3d normal(std::size_t rank) const;

  std::span<const FluxProblem> problems_;
  const RayScene& scene_;
  const FluxOptions& options_;
  const RayPlan& plan_;
};

Viewer::Viewer(std::span<const FluxProblem> problems, const RayPlan& plan)
    : problems_(problems),
      scene_(problems.front().scene),
      options_(problems.front().options),
      plan_(plan) {}

Vec3d Viewer::normal(std::size_t rank) const {
  const Vec3d n = scene_.normal(plan_.curve.facet_at[rank]);
  return options_.two_dimensional ? project_to_cross_section(n) : n;
}

void Viewer::shoot(std::size_t rank, const FluxProblem* lobe, std::vector<Shot>& shots) const {
  const std::uint32_t facet = plan_.curve.facet_at[rank];
  const Vec3d n = normal(rank);
  // Hemisphere rays serve all species, lobe rays their own.
  const std::uint32_t user = lobe == nullptr ? 0xFFFFFFFFU : ~lobe->species_index - 1;
  RandomStream random({options_.seed, options_.time_step, user, facet});
  std::vector<ScrambledSobol> sets;
  for (std::size_t set = 0; set < set_count; ++set)
    sets.emplace_back(std::array{random.bits(), random.bits(), random.bits(), random.bits()});
  for (std::uint32_t ray = 0; ray < plan_.rays[rank]; ++ray) {
    for (std::uint32_t set = 0; set < set_count; ++set) {
      const auto xi = sets[set].point(ray);
      const Vec3d weights = sample_triangle({xi[2], xi[3]});
      const auto& [a, b, c] = scene_.corners(facet);
      const Vec3d u = lobe == nullptr
                          ? sample_cosine({xi[0], xi[1]}, n)
                          : -sample_source({xi[0], xi[1]}, lobe->species.source.cosine_power);
      shots.push_back(
          {.ray = {.r = weights.x * Vec3d(a) + weights.y * Vec3d(b) + weights.z * Vec3d(c),
                   .u = options_.two_dimensional ? project_to_cross_section(u) : u,
                   .from = facet},
           .u = u,
           .rank = static_cast<std::uint32_t>(rank),
           .set = set});
    }
  }
}

std::vector<Viewer::Shot> Viewer::shoot_all(std::size_t begin, std::size_t end,
                                            const FluxProblem* lobe) const {
  std::vector<Shot> shots;
  shots.reserve((plan_.first[end] - plan_.first[begin]) * set_count);
  for (std::size_t rank = begin; rank < end; ++rank) shoot(rank, lobe, shots);
  return shots;
}

std::vector<Flight> Viewer::fly(const std::vector<Shot>& shots) const {
  std::vector<Flight> flights(shots.size());
  const auto order =
      flight_order(scene_, shots.size(), [&](std::size_t i) -> const Ray& { return shots[i].ray; });
  for (const std::uint32_t i : order) flights[i] = scene_.fly(shots[i].ray);
  return flights;
}

void Viewer::view_by_lambert(std::size_t begin, std::size_t end, View& view) const {
  const std::vector<Shot> shots = shoot_all(begin, end, nullptr);
  const std::vector<Flight> flights = fly(shots);
  std::uint32_t* hit = &view.matrix.hits[plan_.first[begin] * set_count];
  const auto facet_count = static_cast<std::uint32_t>(scene_.facet_count());
  for (std::size_t i = 0; i < shots.size(); ++i, ++hit) {
    const auto& [ray, u, rank, set] = shots[i];
    switch (flights[i].end) {
      case Flight::End::front:
        *hit = plan_.curve.rank_of[flights[i].facet];
        break;
      case Flight::End::back:
        *hit = facet_count + to_back;
        break;
      case Flight::End::below:
        *hit = facet_count + to_below;
        break;
      case Flight::End::side_limit:
        *hit = facet_count + to_side_limit;
        break;
      case Flight::End::sky:
        *hit = facet_count + to_sky;
        for (std::size_t p = 0; p < problems_.size(); ++p) {
          const double weight =
              sky_weight(u, normal(rank), problems_[p].species.source.cosine_power);
          view.direct[p][rank * set_count + set] += static_cast<float>(weight / plan_.rays[rank]);
        }
    }
  }
}

void Viewer::view_by_lobe(std::size_t begin, std::size_t end, std::size_t problem,
                          View& view) const {
  std::vector<Shot> shots = shoot_all(begin, end, &problems_[problem]);
  std::erase_if(shots, [&](const Shot& shot) { return dot(shot.u, normal(shot.rank)) <= 0; });
  const std::vector<Flight> flights = fly(shots);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (flights[i].end != Flight::End::sky) continue;
    const auto& [ray, u, rank, set] = shots[i];
    const double weight =
        sky_weight(u, normal(rank), problems_[problem].species.source.cosine_power);
    view.direct[problem][rank * set_count + set] += static_cast<float>(weight / plan_.rays[rank]);
  }
}

View Viewer::view() const {
  View view;
  const std::size_t facet_count = scene_.facet_count();
  view.matrix.first.resize(facet_count + 1);
  for (std::size_t rank = 0; rank <= facet_count; ++rank)
    view.matrix.first[rank] = plan_.first[rank] * set_count;
  view.matrix.hits.resize(plan_.total());
  view.direct.assign(problems_.size(), std::vector<float>(facet_count * set_count));
  view.flights = plan_.total();

  const std::uint64_t rays_per_facet = plan_.total() / facet_count;
  const std::size_t grain = std::max<std::size_t>(1, pool_size / rays_per_facet);
  parallel_for(facet_count, grain, [&](std::size_t begin, std::size_t end) {
    view_by_lambert(begin, end, view);
    for (std::size_t p = 0; p < problems_.size(); ++p)
      if (problems_[p].species.source.cosine_power != 1) view_by_lobe(begin, end, p, view);
  });
  for (const FluxProblem& problem : problems_)
    if (problem.species.source.cosine_power != 1) view.flights += plan_.total();
  return view;
}

// What a facet's two sets say apart: half their difference is a fair sample of the error of their
// mean.
struct HalfDifference {
  double flux = 0;  // of direct flux plus re-emitted flux seen
  double out = 0;   // of the part of rays that met no facet
};

// The flux on every facet, by rank, and draws of its error.
struct Solution {
  std::vector<double> flux;
  std::vector<HalfDifference> halves;
  std::vector<float> sigma;      // standard error of each facet's own equation
  std::vector<float> deviation;  // at rank * draw_count + draw
};

std::vector<HalfDifference> half_differences(const View& view, const std::vector<float>& direct,
                                             std::span<const float> reemitted,
                                             const std::vector<double>& flux) {
  const ExchangeMatrix& matrix = view.matrix;
  std::vector<HalfDifference> halves(matrix.size());
  parallel_for(matrix.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      HalfDifference sum;
      for (std::uint64_t k = matrix.first[i]; k < matrix.first[i + 1]; ++k) {
        const std::uint32_t j = matrix.hits[k];
        const double sign = k % set_count == 0 ? 1 : -1;
        if (j < matrix.size()) {
          sum.flux += sign * reemitted[j] * flux[j];
        } else {
          sum.out += sign;
        }
      }
      const auto rays = static_cast<double>(matrix.first[i + 1] - matrix.first[i]);
      const double of_direct = static_cast<double>(direct[i * set_count]) -
                               static_cast<double>(direct[i * set_count + 1]);
      halves[i] = {.flux = of_direct / 2 + sum.flux / rays, .out = sum.out / rays};
    }
  });
  return halves;
}

// A single difference says little about its facet. Facets nearby have the same variance but for
// their numbers of rays n, with which the variance of scrambled sets falls about as n^-1.5.
std::vector<float> standard_errors(const RayPlan& plan, const std::vector<HalfDifference>& halves) {
  const auto relative = [&](std::size_t rank) {
    const double n = plan.rays[rank];
    return n * std::sqrt(n);
  };
  std::vector<float> sigma(halves.size());
  for (std::size_t begin = 0; begin < sigma.size(); begin += error_window) {
    const std::size_t end = std::min(begin + error_window, sigma.size());
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += halves[i].flux * halves[i].flux * relative(i);
    const double variance = sum / static_cast<double>(end - begin);
    for (std::size_t i = begin; i < end; ++i)
      sigma[i] = static_cast<float>(std::sqrt(variance / relative(i)));
  }
  return sigma;
}

// A draw flips a facet's half difference or not.
std::uint32_t draw_signs(const FluxOptions& options, std::uint32_t facet) {
  static_assert(draw_count == 32);
  return RandomStream(
             {options.seed, options.time_step, 0xFFFFFFFFU, (std::uint64_t{1} << 32) + facet})
      .bits();
}

double sign(std::uint32_t signs, std::size_t draw) { return (signs >> draw) & 1U ? 1 : -1; }

Solution solve_exchange_of(const FluxProblem& problem, const RayPlan& plan, const View& view,
                           const std::vector<float>& direct, std::span<const float> reemitted) {
  const std::size_t size = view.matrix.size();
  std::vector<double> mean_direct(size);
  for (std::size_t k = 0; k < direct.size(); ++k)
    mean_direct[k / set_count] += static_cast<double>(direct[k]) / set_count;

  Solution solution;
  solution.flux = solve_exchange<double>(view.matrix, reemitted, mean_direct, 1, mean_tolerance);
  solution.halves = half_differences(view, direct, reemitted, solution.flux);
  solution.sigma = standard_errors(plan, solution.halves);
  std::vector<float> errors(size * draw_count);
  for (std::size_t rank = 0; rank < size; ++rank) {
    const std::uint32_t signs = draw_signs(problem.options, plan.curve.facet_at[rank]);
    const double size_and_sign = std::copysign(solution.sigma[rank], solution.halves[rank].flux);
    for (std::size_t draw = 0; draw < draw_count; ++draw)
      errors[rank * draw_count + draw] = static_cast<float>(sign(signs, draw) * size_and_sign);
  }
  solution.deviation =
      solve_exchange<float>(view.matrix, reemitted, errors, draw_count, deviation_tolerance);
  return solution;
}

// The ends of a facet's rays that met no facet, as parts of all of them.
std::array<double, fate_count> ends_of(const ExchangeMatrix& matrix, std::size_t row) {
  std::array<double, fate_count> ends{};
  const auto rays = static_cast<double>(matrix.first[row + 1] - matrix.first[row]);
  for (std::uint64_t k = matrix.first[row]; k < matrix.first[row + 1]; ++k)
    if (matrix.hits[k] >= matrix.size()) ends[matrix.hits[k] - matrix.size()] += 1 / rays;
  return ends;
}

// Books what the facets absorb and where their re-emitted particles end. In units of source
// particles per squared spacing. Flux and part that leaves come from the same rays, so the product
// of their means is too large by their covariance, which the half differences tell.
FluxAudit audit_of(const FluxProblem& problem, const RayPlan& plan, const View& view,
                   std::span<const float> reemitted, const Solution& solution) {
  FluxAudit audit{.emitted = problem.scene.source_area()};
  std::array<double, draw_count> totals{};
  for (std::size_t i = 0; i < view.matrix.size(); ++i) {
    const auto ends = ends_of(view.matrix, i);
    const std::uint32_t facet = plan.curve.facet_at[i];
    const HalfDifference& half = solution.halves[i];
    const double area = problem.scene.area(facet);
    const double arrives = area * solution.flux[i];
    const double c = reemitted[i];
    audit.absorbed += arrives * (1 - c);
    audit.escaped += arrives * c * ends[to_sky] - area * c * half.flux * half.out;
    audit.lost_back_face += arrives * c * ends[to_back];
    audit.lost_below += arrives * c * ends[to_below];
    audit.lost_side_limit += arrives * c * ends[to_side_limit];

    const double out = ends[to_sky] + ends[to_back] + ends[to_below] + ends[to_side_limit];
    const std::uint32_t signs = draw_signs(problem.options, facet);
    for (std::size_t draw = 0; draw < draw_count; ++draw) {
      const double deviation = solution.deviation[i * draw_count + draw];
      totals[draw] +=
          area * deviation * (1 - c + c * out) + arrives * c * sign(signs, draw) * half.out;
    }
  }
  double squares = 0;
  for (const double total : totals) squares += total * total;
  audit.balance_std_error = std::sqrt(squares / draw_count) / audit.emitted;
  return audit;
}

FluxField field_of(const FluxProblem& problem, const RayPlan& plan, const View& view,
                   const std::vector<float>& direct) {
  std::vector<float> reemitted(plan.rays.size());
  double unseen = 0;
  for (std::size_t rank = 0; rank < reemitted.size(); ++rank) {
    const std::uint32_t f = plan.curve.facet_at[rank];
    reemitted[rank] = 1 - problem.sticking[f];
    unseen = std::max(unseen, problem.scene.area(f) / (plan.rays[rank] * set_count));
  }
  const Solution solution = solve_exchange_of(problem, plan, view, direct, reemitted);
  FluxEstimate estimated =
      estimate(problem.scene, problem.patches,
               {.flux = [&](std::size_t f) { return solution.flux[plan.curve.rank_of[f]]; },
                .deviation =
                    [&](std::size_t f, std::size_t draw) {
                      return solution.deviation[plan.curve.rank_of[f] * draw_count + draw];
                    },
                .deviations = draw_count,
                .divisor = draw_count,
                .unseen = unseen});
  return {.tallies = {std::move(estimated.tally)},
          .audit = audit_of(problem, plan, view, reemitted, solution),
          .rays = plan.total(),
          .segments = view.flights,
          .error = estimated.error,
          .max_facet_error = estimated.max_facet_error};
}

// The error of a Sobol sequence falls faster than one over the square root of the number of rays;
// three quarters is the power seen on patches.
double predicted_growth(double error, double target) {
  const double ratio = error / target;
  return std::clamp(1.15 * ratio * std::cbrt(ratio), 1.3, 8.0);
}

std::uint64_t most_rays(const FluxOptions& options, std::size_t facet_count) {
  const std::uint64_t least = facet_count * set_count * least_set;
  const std::uint64_t fit = options.memory_limit / sizeof(std::uint32_t);
  if (fit < least) {
    throw InputError("flux.memory_limit: " + std::to_string(options.memory_limit) +
                     " bytes hold fewer than 4 rays for each of " + std::to_string(facet_count) +
                     " facets; allow at least " + std::to_string(least * sizeof(std::uint32_t)) +
                     " bytes");
  }
  return std::min(fit, options.rays > 0 ? options.rays : options.max_rays);
}

}  // namespace

std::vector<FluxField> gather(std::span<const FluxProblem> problems) {
  if (problems.empty()) return {};
  const RayScene& scene = problems.front().scene;
  const FluxOptions& options = problems.front().options;
  double surface = 0;
  for (std::size_t f = 0; f < scene.facet_count(); ++f) surface += scene.area(f);
  const std::uint64_t cap = most_rays(options, scene.facet_count());

  RayPlan plan{.curve = curve_through(scene), .rays = {}, .first = {}};
  double rays = options.rays > 0 ? static_cast<double>(cap)
                                 : first_rays_per_facet * static_cast<double>(scene.facet_count());
  for (std::uint64_t last_total = 0;;) {
    plan_rays(scene, rays / surface, cap, plan);
    const View view = Viewer(problems, plan).view();
    std::vector<FluxField> fields;
    double error = 0;
    for (std::size_t p = 0; p < problems.size(); ++p) {
      fields.push_back(field_of(problems[p], plan, view, view.direct[p]));
      error = std::max(error, fields.back().error);
      fields.back().target_reached =
          options.rays > 0 || fields.back().error <= options.target_error;
    }
    const bool is_last =
        options.rays > 0 || rays >= static_cast<double>(cap) || plan.total() == last_total;
    if (is_last || error <= options.target_error) return fields;
    last_total = plan.total();
    rays = std::min(rays * predicted_growth(error, options.target_error), static_cast<double>(cap));
  }
}

}  // namespace scarp
