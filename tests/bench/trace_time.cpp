#include "tests/bench/trace_time.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "flux/rays/ray_scene.h"
#include "flux/sampling/sampling.h"
#include "tests/bench/cpu_time.h"

namespace scarp::bench {

namespace {

constexpr double sticking = 0.1;

// As many as stay in the cache between the clocks, and enough that a clock costs nothing.
constexpr std::uint64_t block_size = 1 << 13;

UnitSquare pair(RandomStream& random) {
  const double xi1 = random.uniform();
  return {xi1, random.uniform()};
}

std::vector<Ray> from_source(const RayScene& scene, std::uint64_t count, RandomStream& random) {
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    const UnitSquare place = pair(random);
    ray.r = {place.xi1 * scene.upper().x, place.xi2 * scene.upper().y, scene.source_height()};
    ray.u = sample_cosine(pair(random), {0, 0, -1});
  }
  return rays;
}

std::vector<Ray> sent_on(const RayScene& scene, const std::vector<Flight>& flights,
                         RandomStream& random) {
  std::vector<Ray> rays;
  for (const Flight& flight : flights) {
    if (flight.end != Flight::End::front || random.uniform() < sticking) continue;
    rays.push_back({.r = flight.r,
                    .u = sample_cosine(pair(random), scene.normal(flight.facet)),
                    .from = flight.facet});
  }
  return rays;
}

}  // namespace

double TraceTime::total() const {
  return std::accumulate(cpu_seconds.begin(), cpu_seconds.end(), 0.0);
}

void TraceTime::take_lesser(const TraceTime& again) {
  SCARP_ASSERT(again.cpu_seconds.size(), ==, cpu_seconds.size());
  std::ranges::transform(cpu_seconds, again.cpu_seconds, cpu_seconds.begin(),
                         [](double a, double b) { return std::min(a, b); });
}

TraceTime trace_time(const TriMesh& mesh, const Sides& sides, std::uint64_t particles) {
  TraceTime time;
  std::optional<RayScene> scene;
  time.cpu_seconds.push_back(cpu_seconds_of([&] { scene.emplace(mesh, sides, 1.0); }));
  std::vector<Flight> flights;
  for (std::uint64_t first = 0; first < particles; first += block_size) {
    RandomStream random({.seed = 1, .ray = first});
    double& of_block = time.cpu_seconds.emplace_back(0);
    for (std::vector<Ray> rays =
             from_source(*scene, std::min(block_size, particles - first), random);
         !rays.empty(); rays = sent_on(*scene, flights, random)) {
      flights.resize(rays.size());
      of_block += cpu_seconds_of([&] { scene->fly(rays, flights); });
      time.segments += rays.size();
    }
  }
  return time;
}

}  // namespace scarp::bench
