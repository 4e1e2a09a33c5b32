#include "flux/beam.h"

#include <algorithm>
#include <atomic>

#include "core/parallel.h"

namespace scarp {

namespace {

struct Visibility {
  int points = 0;
  int seen = 0;
  int flights = 0;
};

// The centroids of the divisions^2 equal triangles that a facet divides into.
template <class Visit>
void for_each_centroid(const std::array<Vec3f, 3>& corners, int divisions, const Visit& visit) {
  const Vec3d a = Vec3d(corners[0]);
  const Vec3d ab = (Vec3d(corners[1]) - a) / (3.0 * divisions);
  const Vec3d ac = (Vec3d(corners[2]) - a) / (3.0 * divisions);
  for (int i = 0; i < divisions; ++i) {
    for (int j = 0; i + j < divisions; ++j) {
      visit(a + (3.0 * i + 1) * ab + (3.0 * j + 1) * ac);
      if (i + j + 1 < divisions) visit(a + (3.0 * i + 2) * ab + (3.0 * j + 2) * ac);
    }
  }
}

Visibility visibility(const RayScene& scene, std::uint32_t facet, Vec3d towards_source) {
  Visibility result;
  for (const int divisions : {4, 8}) {
    result.points = 0;
    result.seen = 0;
    for_each_centroid(scene.corners(facet), divisions, [&](Vec3d r) {
      ++result.points;
      ++result.flights;
      const Flight flight = scene.fly({.r = r, .u = towards_source, .from = facet});
      if (flight.end == Flight::End::sky) ++result.seen;
    });
    if (result.seen == 0 || result.seen == result.points) break;
  }
  return result;
}

}  // namespace

FluxField trace_beam(const FluxProblem& problem) {
  const RayScene& scene = problem.scene;
  const Vec3d direction = normalized(problem.species.source.direction);
  const std::size_t facet_count = scene.facet_count();
  Tally tally{.mean = std::vector<float>(facet_count),
              .std_error = std::vector<float>(facet_count)};
  std::atomic<std::uint64_t> flights = 0;
  parallel_for(facet_count, 256, [&](std::size_t begin, std::size_t end) {
    std::uint64_t flown = 0;
    for (std::size_t f = begin; f < end; ++f) {
      const double cosine = -dot(direction, scene.normal(f));
      if (cosine <= 0) continue;
      const Visibility result = visibility(scene, static_cast<std::uint32_t>(f), -direction);
      flown += static_cast<std::uint64_t>(result.flights);
      tally.mean[f] = static_cast<float>(cosine * result.seen / result.points);
    }
    flights += flown;
  });

  FluxAudit audit{.emitted = -direction.z * scene.source_area()};
  for (std::size_t f = 0; f < facet_count; ++f) audit.absorbed += tally.mean[f] * scene.area(f);
  return {.tallies = {std::move(tally)}, .audit = audit, .rays = flights, .segments = flights};
}

}  // namespace scarp
