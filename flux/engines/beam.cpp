#include "flux/engines/beam.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "flux/rays/patches.h"
#include "flux/sampling/sobol.h"

namespace scarp {

namespace {

// Points per set on a facet: a few and points near the corners, which tell whether a border crosses
// it; many where one does.
constexpr std::uint32_t few_points = 4;
constexpr std::uint32_t many_points = 128;
constexpr double near_corner = 0.01;
constexpr std::size_t set_count = 2;

constexpr std::size_t draw_count = 16;

// Facets of a wall along the beam lean to either side of it by about half a degree. Whether they
// are in sight must not depend on that: it would change with every mesh of the same wall. So those
// that face away by less than this cosine look for the source as well, though nothing arrives.
constexpr double facing_away = 0.02;

// From facets this near to the beam's direction flights start off the facet, by this part of its
// size, and leave it at this cosine at least: otherwise the wall hides itself.
constexpr double grazing = 0.01;
constexpr double off_facet = 0.01;

// What the rays of a facet see: per set, how many of them reach the sky.
using Lit = std::array<std::uint32_t, set_count>;

struct Visibility {
  double seen = 0;  // part of the facet
  double std_error = 0;
};

RandomStream stream_of(const FluxProblem& problem, std::size_t facet) {
  return RandomStream(
      {problem.options.seed, problem.options.time_step, problem.species_index, facet});
}

// The points of a facet from which it looks for the source.
class Facet {
 public:
  Facet(const FluxProblem& problem, std::uint32_t facet, Vec3d towards_source)
      : scene_(problem.scene),
        facet_(facet),
        towards_source_(towards_source),
        sets_(sets_of(problem, facet)) {
    const Vec3d n = scene_.normal(facet);
    const double cosine = dot(towards_source, n);
    if (cosine >= grazing) return;
    offset_ = off_facet * std::sqrt(scene_.area(facet)) * n;
    towards_source_ = normalized(towards_source + (grazing - cosine) * n);
  }

  void add_corners(std::vector<Ray>& rays) const {
    constexpr double far = 1 - 2 * near_corner;
    add(near_corner, near_corner, rays);
    add(far, near_corner, rays);
    add(near_corner, far, rays);
  }

  // The points first..end of each set, one set after the other.
  void add_points(std::uint32_t first, std::uint32_t end, std::vector<Ray>& rays) const {
    for (const ScrambledSobol& set : sets_) {
      for (std::uint32_t n = first; n < end; ++n) {
        const auto point = set.point(n);
        // Even in the unit square to even in the triangle.
        const double b = 1 - std::sqrt(point[0]);
        add(b, (1 - b) * point[1], rays);
      }
    }
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
  void add(double b, double c, std::vector<Ray>& rays) const {
    const auto& corners = scene_.corners(facet_);
    const Vec3d a = Vec3d(corners[0]);
    const Vec3d r = a + b * (Vec3d(corners[1]) - a) + c * (Vec3d(corners[2]) - a) + offset_;
    rays.push_back({.r = r, .u = towards_source_, .from = facet_});
  }

  const RayScene& scene_;
  std::uint32_t facet_;
  Vec3d towards_source_;
  std::array<ScrambledSobol, set_count> sets_;
  Vec3d offset_;
};

// How many of some flights in a row reach the sky.
std::uint32_t count_lit(std::span<const Flight> flights) {
  return static_cast<std::uint32_t>(std::ranges::count_if(
      flights, [](const Flight& flight) { return flight.end == Flight::End::sky; }));
}

std::vector<Flight> fly(const RayScene& scene, const std::vector<Ray>& rays) {
  std::vector<Flight> flights(rays.size());
  scene.fly(rays, flights);
  return flights;
}

// Two independent sets: half their difference is a fair sample of the error of their mean.
Visibility visibility_of(const Lit& lit) {
  constexpr double scale = 1.0 / (set_count * many_points);
  const double difference = static_cast<double>(lit[0]) - static_cast<double>(lit[1]);
  return {.seen = scale * (lit[0] + lit[1]), .std_error = scale * std::abs(difference)};
}

// Of facets that fly together: first from a few points of each, then from many of those that a
// border crosses. Returns the number of flights.
std::uint64_t look_at_source(const FluxProblem& problem, Vec3d towards_source,
                             std::span<const std::uint32_t> facets,
                             std::span<Visibility> visibilities) {
  constexpr std::size_t few_rays = 3 + set_count * few_points;
  std::vector<Ray> rays;
  for (const std::uint32_t f : facets) {
    const Facet facet(problem, f, towards_source);
    facet.add_corners(rays);
    facet.add_points(0, few_points, rays);
  }
  const std::vector<Flight> few = fly(problem.scene, rays);
  std::uint64_t flights = few.size();

  rays.clear();
  std::vector<std::size_t> crossed;  // by a border
  for (std::size_t k = 0; k < facets.size(); ++k) {
    const std::uint32_t lit = count_lit(std::span(few).subspan(k * few_rays, few_rays));
    visibilities[k] = {.seen = lit == 0 ? 0.0 : 1.0};
    if (lit == 0 || lit == few_rays) continue;
    crossed.push_back(k);
    Facet(problem, facets[k], towards_source).add_points(few_points, many_points, rays);
  }
  const std::vector<Flight> many = fly(problem.scene, rays);
  flights += many.size();

  constexpr std::size_t more_points = many_points - few_points;
  for (std::size_t n = 0; n < crossed.size(); ++n) {
    const std::size_t k = crossed[n];
    Lit lit{};
    for (std::size_t set = 0; set < set_count; ++set) {
      lit[set] =
          count_lit(std::span(few).subspan(k * few_rays + 3 + set * few_points, few_points)) +
          count_lit(std::span(many).subspan((n * set_count + set) * more_points, more_points));
    }
    visibilities[k] = visibility_of(lit);
  }
  return flights;
}

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
    std::vector<std::uint32_t> facets;
    for (std::size_t f = begin; f < end; ++f)
      if (dot(direction, scene.normal(f)) <= facing_away)
        facets.push_back(static_cast<std::uint32_t>(f));
    std::vector<Visibility> visibilities(facets.size());
    flights += look_at_source(problem, -direction, facets, visibilities);
    for (std::size_t k = 0; k < facets.size(); ++k) {
      const std::uint32_t f = facets[k];
      const double cosine = std::max(-dot(direction, scene.normal(f)), 0.0);
      visible.mean[f] = static_cast<float>(visibilities[k].seen);
      visible.std_error[f] = static_cast<float>(visibilities[k].std_error);
      mean[f] = cosine * visibilities[k].seen;
      std_error[f] = cosine * visibilities[k].std_error;
    }
  });

  FluxAudit audit{.emitted = -direction.z * scene.source_area()};
  for (std::size_t f = 0; f < facet_count; ++f) audit.absorbed += mean[f] * scene.area(f);
  FluxEstimate estimated = estimate(scene, problem.patches,
                                    {.flux = [&](std::size_t f) { return mean[f]; },
                                     .deviations =
                                         [&](std::size_t f, std::span<double> draws) {
                                           for (std::size_t k = 0; k < draws.size(); ++k)
                                             draws[k] = sign(problem, f, k) * std_error[f];
                                         },
                                     .count = draw_count,
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
