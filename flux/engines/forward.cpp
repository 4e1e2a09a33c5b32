#include "flux/engines/forward.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/random.h"
#include "flux/rays/tracer.h"
#include "flux/sampling/sobol.h"

namespace scarp {

namespace {

constexpr std::uint64_t first_round = std::uint64_t{1} << 16;

// Where all particles come from: the plane above the wafer, and facets that emit.
class Starts {
 public:
  explicit Starts(const FluxProblem& problem)
      : problem_(problem),
        random_({problem.options.seed, problem.options.time_step, problem.species_index, 0}),
        emitted_(problem.emitted()) {
    for (std::uint32_t b = 0; b < batch_count; ++b) {
      // Ray numbers of the scramblings lie above those of all rays.
      RandomStream random = random_.of_ray((std::uint64_t{1} << 63) + b);
      points_.emplace_back(std::array{random.bits(), random.bits(), random.bits(), random.bits()});
    }
    double sum = problem.has_source() ? problem.scene.source_area() : 0;
    from_plane_ = sum / emitted_;
    for (std::size_t f = 0; f < problem.species.emission.size(); ++f) {
      below_.push_back(sum / emitted_);
      sum += problem.scene.area(f) * static_cast<double>(problem.species.emission[f]);
    }
  }

  /// Flux times area (squared spacings) of all particles together.
  double emitted() const { return emitted_; }

  /// Puts particles, at most CosineSamples::most, where those of their ray numbers start.
  void emit(std::span<Particle> particles) const {
    std::array<Particle*, CosineSamples::most> from_plane;
    CosineSamples directions;
    for (Particle& particle : particles) {
      const std::uint64_t ray = particle.ray;
      const auto xi =
          points_[ray % batch_count].point(static_cast<std::uint32_t>(ray / batch_count));
      // The first number says where from, and what it has left where there.
      if (xi[0] < from_plane_) {
        put_on_plane({xi[0] / from_plane_, xi[1]}, particle);
        from_plane[directions.count] = &particle;
        directions.add({xi[2], xi[3]}, {});
      } else {
        leave_facet(xi[0], xi[1], {xi[2], xi[3]}, particle);
      }
    }
    if (directions.count == 0) return;
    sample_upright(problem_.species.source, directions);
    for (std::size_t k = 0; k < directions.count; ++k)
      leave_plane(directions.direction(k), *from_plane[k]);
  }

 private:
  void put_on_plane(UnitSquare place, Particle& particle) const {
    const RayScene& scene = problem_.scene;
    const SourceMap& map = problem_.species.source.map;
    const auto [x, y] = map.empty() ? std::array{place.xi1, place.xi2} : map.place(place);
    particle.r = {x * scene.upper().x, y * scene.upper().y, scene.source_height()};
    if (scene.has_diagonal() && particle.r.y > particle.r.x) std::swap(particle.r.x, particle.r.y);
  }

  void leave_plane(Vec3d upright, Particle& particle) const {
    RandomStream random = random_.of_ray(particle.ray);
    const Vec3d u = about_lobe_axis(problem_.species.source, upright, random);
    turn(problem_, particle, u);
    if (problem_.species.ions) {
      const double quantile = random.uniform();
      particle.energy = static_cast<float>(problem_.species.ions->energy.quantile(quantile));
    }
    particle.block = random.next_block();
  }

  void leave_facet(double xi1, double xi2, UnitSquare direction, Particle& particle) const {
    const auto above = std::upper_bound(below_.begin(), below_.end(), xi1);
    const double end = above == below_.end() ? 1 : *above;
    const double begin = *(above - 1);
    const auto f = static_cast<std::uint32_t>(above - below_.begin() - 1);
    const Vec3d weights = sample_triangle({(xi1 - begin) / (end - begin), xi2});
    const auto& [a, b, c] = problem_.scene.corners(f);
    particle.r = weights.x * Vec3d(a) + weights.y * Vec3d(b) + weights.z * Vec3d(c);
    particle.facet = f;
    turn(problem_, particle, sample_cosine(direction, problem_.normal(f)));
  }

  const FluxProblem& problem_;
  RandomStreams random_;
  double emitted_ = 0;
  double from_plane_ = 1;               // part of them
  std::vector<double> below_;           // part of them from the plane and the facets before
  std::vector<ScrambledSobol> points_;  // one set per batch
};

// Follows the rays first..end, one batch after the other, so that a pool adds to few of the sums of
// a facet.
void trace(Tracer& tracer, const Starts& starts, std::uint64_t first, std::uint64_t end) {
  const std::uint64_t in_batch = (end - first) / batch_count;
  tracer.trace(end - first, [&](std::uint64_t k, std::span<Particle> particles) {
    for (Particle& particle : particles) {
      particle.ray = first + k % in_batch * batch_count + k / in_batch;
      ++k;
    }
    starts.emit(particles);
  });
}

std::uint64_t whole_batches(std::uint64_t rays) {
  return (rays + batch_count - 1) / batch_count * batch_count;
}

// The error falls with one over the square root of the number of rays; a tenth more makes another
// round unlikely, and at most eight times as many keeps a poor first estimate from overshooting.
std::uint64_t predicted_rays(std::uint64_t rays, double error, double target) {
  const double ratio = std::clamp(1.1 * (error / target) * (error / target), 1.1, 8.0);
  return static_cast<std::uint64_t>(static_cast<double>(rays) * ratio);
}

}  // namespace

FluxField trace_forward(const FluxProblem& problem, std::uint64_t least_rays) {
  const FluxOptions& options = problem.options;
  const bool fixed = options.rays > 0;
  // A cap is never passed, unless it is below one batch.
  const std::uint64_t most = options.max_rays / batch_count * batch_count;
  const std::uint64_t cap = whole_batches(fixed ? options.rays : std::max<std::uint64_t>(most, 1));
  const Starts starts(problem);
  Tracer tracer(problem);
  const auto spread = [&](std::size_t tally, std::uint64_t rays) {
    return tracer.spread(tally, starts.emitted() / static_cast<double>(rays));
  };
  const auto estimated = [&](std::size_t tally, std::uint64_t rays) {
    return estimate(problem.scene, problem.patches, spread(tally, rays));
  };
  FluxField field;
  for (std::uint64_t rays = fixed ? cap
                                  : std::min(cap, whole_batches(std::max(first_round, least_rays)));
       ;) {
    trace(tracer, starts, field.rays, rays);
    field.rays = rays;
    FluxEstimate flux = estimated(0, rays);
    field.tallies = {std::move(flux.tally)};
    field.error = flux.error;
    field.max_facet_error = flux.max_facet_error;
    field.response_error =
        response_error(problem, [&](std::size_t tally) { return spread(tally, rays); });
    if (fixed || field.target_measure() <= options.target_error) break;
    if (rays == cap) {
      field.missed_by = RayCap::rays;
      break;
    }
    rays = std::min(
        cap, whole_batches(predicted_rays(rays, field.target_measure(), options.target_error)));
  }
  field.audit = tracer.audit();
  field.segments = tracer.segments();
  for (std::size_t k = 0; k < problem.species.yields.size(); ++k) {
    field.tallies.push_back(estimated(k + 1, field.rays).tally);
    field.tallies.back().quantity = Tally::Quantity::yield;
  }
  return field;
}

}  // namespace scarp
