#include "flux/beam.h"

#include <array>
#include <atomic>
#include <cmath>

#include "core/parallel.h"
#include "core/random.h"
#include "flux/patches.h"
#include "flux/sobol.h"

namespace scarp {

namespace {

// Points per set on a facet: a few and points near the corners, which tell whether a border crosses
// it; many where one does.
constexpr std::uint32_t few_points = 4;
constexpr std::uint32_t many_points = 128;
constexpr double near_corner = 0.01;
constexpr std::size_t set_count = 2;

constexpr std::size_t draw_count = 16;

// Facets that face away by less than this are asked whether they see the source, though nothing
// arrives on them: a wall along the beam does.
constexpr double facing_away = 1e-6;

// On facets this near to the beam's direction flights start off the facet, by this part of its
// size: otherwise they run within the wall, which hides itself by rounding.
constexpr double grazing = 0.01;
constexpr double off_facet = 0.01;

struct Visibility {
  double seen = 0;  // part of the facet
  double std_error = 0;
  std::uint64_t flights = 0;
};

RandomStream stream_of(const FluxProblem& problem, std::size_t facet) {
  return RandomStream(
      {problem.options.seed, problem.options.time_step, problem.species_index, facet});
}

class Facet {
 public:
  Facet(const FluxProblem& problem, std::uint32_t facet, Vec3d towards_source)
      : scene_(problem.scene),
        facet_(facet),
        towards_source_(towards_source),
        sets_(sets_of(problem, facet)) {
    const Vec3d n = scene_.normal(facet);
    if (dot(towards_source, n) < grazing) offset_ = off_facet * std::sqrt(scene_.area(facet)) * n;
  }

  // Two independent sets: half their difference is a fair sample of the error of their mean.
  Visibility visibility() {
    const std::uint32_t at_corners = lit_corners();
    std::array<std::uint32_t, set_count> lit{count(0, 0, few_points), count(1, 0, few_points)};
    const std::uint32_t all = at_corners + lit[0] + lit[1];
    if (all == 0 || all == 3 + set_count * few_points) {
      return {.seen = all == 0 ? 0.0 : 1.0, .flights = flights_};
    }
    for (std::size_t s = 0; s < set_count; ++s) lit[s] += count(s, few_points, many_points);
    constexpr double scale = 1.0 / (set_count * many_points);
    const double difference = static_cast<double>(lit[0]) - static_cast<double>(lit[1]);
    return {.seen = scale * (lit[0] + lit[1]),
            .std_error = scale * std::abs(difference),
            .flights = flights_};
  }

 private:
  static std::array<ScrambledSobol, set_count> sets_of(const FluxProblem& problem,
                                                       std::uint32_t facet) {
    RandomStream random = stream_of(problem, facet);
    const auto set = [&] {
      std::array<std::uint32_t, 4> seeds{};
      for (std::uint32_t& seed : seeds) seed = random.bits();
      return ScrambledSobol(seeds);
    };
    return {set(), set()};
  }

  // At a + b (corner 1 - a) + c (corner 2 - a), from corner a.
  bool is_lit(double b, double c) {
    ++flights_;
    const auto& corners = scene_.corners(facet_);
    const Vec3d a = Vec3d(corners[0]);
    const Vec3d r = a + b * (Vec3d(corners[1]) - a) + c * (Vec3d(corners[2]) - a) + offset_;
    return scene_.fly({.r = r, .u = towards_source_, .from = facet_}).end == Flight::End::sky;
  }

  std::uint32_t lit_corners() {
    constexpr double far = 1 - 2 * near_corner;
    return static_cast<std::uint32_t>(is_lit(near_corner, near_corner)) +
           static_cast<std::uint32_t>(is_lit(far, near_corner)) +
           static_cast<std::uint32_t>(is_lit(near_corner, far));
  }

  std::uint32_t count(std::size_t set, std::uint32_t first, std::uint32_t end) {
    std::uint32_t lit = 0;
    for (std::uint32_t n = first; n < end; ++n) {
      const auto point = sets_[set].point(n);
      // Even in the unit square to even in the triangle.
      const double b = 1 - std::sqrt(point[0]);
      if (is_lit(b, (1 - b) * point[1])) ++lit;
    }
    return lit;
  }

  const RayScene& scene_;
  std::uint32_t facet_;
  Vec3d towards_source_;
  std::array<ScrambledSobol, set_count> sets_;
  Vec3d offset_;
  std::uint64_t flights_ = 0;
};

// Errors of different facets have nothing to do with each other: each draw gives them signs.
double sign(const FluxProblem& problem, std::size_t facet, std::size_t draw) {
  const std::uint32_t signs = stream_of(problem, facet).bits();
  return (signs >> draw) & 1U ? 1 : -1;
}

}  // namespace

FluxField trace_beam(const FluxProblem& problem) {
  const RayScene& scene = problem.scene;
  const Vec3d direction = normalized(problem.species.source.direction);
  const std::size_t facet_count = scene.facet_count();
  std::vector<double> mean(facet_count);
  std::vector<double> std_error(facet_count);
  Tally visible{.quantity = Tally::Quantity::visibility,
                .mean = std::vector<float>(facet_count),
                .std_error = std::vector<float>(facet_count)};
  std::atomic<std::uint64_t> flights = 0;
  parallel_for(facet_count, 256, [&](std::size_t begin, std::size_t end) {
    std::uint64_t flown = 0;
    for (std::size_t f = begin; f < end; ++f) {
      const double cosine = -dot(direction, scene.normal(f));
      if (cosine < -facing_away) continue;
      const Visibility result =
          Facet(problem, static_cast<std::uint32_t>(f), -direction).visibility();
      flown += result.flights;
      visible.mean[f] = static_cast<float>(result.seen);
      visible.std_error[f] = static_cast<float>(result.std_error);
      mean[f] = std::max(cosine, 0.0) * result.seen;
      std_error[f] = std::max(cosine, 0.0) * result.std_error;
    }
    flights += flown;
  });

  FluxAudit audit{.emitted = -direction.z * scene.source_area()};
  for (std::size_t f = 0; f < facet_count; ++f) audit.absorbed += mean[f] * scene.area(f);
  FluxEstimate estimated = estimate(
      scene, problem.patches,
      {.flux = [&](std::size_t f) { return mean[f]; },
       .deviation = [&](std::size_t f,
                        std::size_t draw) { return sign(problem, f, draw) * std_error[f]; },
       .deviations = draw_count,
       .divisor = draw_count,
       .unseen = 0});
  return {.tallies = {std::move(estimated.tally), std::move(visible)},
          .audit = audit,
          .rays = flights,
          .segments = flights,
          .error = estimated.error,
          .max_facet_error = estimated.max_facet_error};
}

}  // namespace scarp
