#include "flux/forward.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/huge_pages.h"
#include "core/parallel.h"
#include "core/random.h"
#include "flux/sampling.h"
#include "flux/sobol.h"
#include "flux/spatial_order.h"

namespace scarp {

namespace {

constexpr std::uint32_t batch_count = 32;
constexpr std::uint64_t first_round = std::uint64_t{1} << 16;

// Of rays that fly together: more of them have more of the scene in common, fewer fit in the cache
// and share out among threads.
constexpr std::size_t least_pool = std::size_t{1} << 12;
constexpr std::size_t most_pool = std::size_t{1} << 16;
constexpr std::size_t pools_per_thread = 2;

// Of a pool, while their ends fit in the cache.
constexpr std::size_t flights_at_once = 4096;

// How many turns ahead the memory is asked for what will be needed.
constexpr std::size_t ahead = 16;

// Weights are whole numbers, so that every split and every sum is exact in any order: 2^30 is the
// weight of a particle at the source, and 2^33 of them fit in a sum.
constexpr std::uint32_t unit_weight = 1U << 30;

// Below the first a particle goes on with the second or not at all.
constexpr std::uint32_t roulette_below = unit_weight / 10;
constexpr std::uint32_t roulette_weight = 3 * (unit_weight / 10);

struct Particle {
  Ray ray;
  std::uint32_t weight = unit_weight;
  std::uint32_t batch = 0;
  float energy = 0;       // of ions
  float along_slice = 0;  // y of the direction before it was projected on a cross-section
  RandomStream random;
};

struct Counts {
  std::int64_t emitted = 0;
  std::int64_t absorbed = 0;
  std::int64_t escaped = 0;
  std::int64_t lost_back_face = 0;
  std::int64_t lost_below = 0;
  std::int64_t lost_side_limit = 0;
  std::int64_t roulette = 0;
  std::int64_t segments = 0;
};

using Tallies = std::vector<std::int64_t, HugePages<std::int64_t>>;

class Tracer {
 public:
  explicit Tracer(const FluxProblem& problem);

  // Follows the rays first..end; the sums are over all rays so far.
  void trace(std::uint64_t first, std::uint64_t end);

  FluxEstimate estimate_flux() const;
  std::vector<Tally> yields() const;
  const Counts& counts() const { return counts_; }
  std::uint64_t rays() const { return rays_; }

 private:
  Particle emit(std::uint64_t ray) const;
  Vec3d source_direction(UnitSquare xi, RandomStream& random) const;
  void turn(Particle& particle, Vec3d u) const;
  void trace_pool(std::vector<Particle> particles);
  void prefetch(const Flight& flight, const Particle& particle) const;
  bool arrive(Particle& particle, const Flight& flight, Counts& counts);
  bool hit(Particle& particle, const Flight& flight, Counts& counts);
  bool absorb(Particle& particle, std::uint32_t part, Counts& counts) const;
  Vec3d emission_normal(std::uint32_t facet) const;
  FluxEstimate estimate_of(std::span<const std::int64_t> tallies, double unit) const;
  static bool play_roulette(Particle& particle, Counts& counts);

  // A pool meets few batches, and all facets.
  std::size_t tally_index(std::size_t batch, std::size_t facet) const {
    return batch * problem_.scene.facet_count() + facet;
  }

  const FluxProblem& problem_;
  std::vector<ScrambledSobol> starts_;          // one per batch
  std::vector<std::uint32_t> absorbed_weight_;  // of a particle of unit weight, per facet
  Tallies tallies_;
  std::vector<Tallies> yield_tallies_;  // of yields over the largest of their law
  std::vector<double> largest_yield_;
  Counts counts_;
  std::uint64_t rays_ = 0;
};

template <class Number>
void add(Number& sum, Number term) {
  std::atomic_ref<Number>(sum).fetch_add(term, std::memory_order_relaxed);
}

void add(Counts& sum, const Counts& term) {
  add(sum.emitted, term.emitted);
  add(sum.absorbed, term.absorbed);
  add(sum.escaped, term.escaped);
  add(sum.lost_back_face, term.lost_back_face);
  add(sum.lost_below, term.lost_below);
  add(sum.lost_side_limit, term.lost_side_limit);
  add(sum.roulette, term.roulette);
  add(sum.segments, term.segments);
}

Tracer::Tracer(const FluxProblem& problem)
    : problem_(problem),
      absorbed_weight_(problem.scene.facet_count()),
      tallies_(problem.scene.facet_count() * batch_count) {
  const FluxOptions& options = problem.options;
  for (std::size_t f = 0; f < absorbed_weight_.size(); ++f) {
    const double sticking = problem.sticking[f];
    absorbed_weight_[f] = static_cast<std::uint32_t>(std::floor(sticking * unit_weight + 0.5));
  }
  for (const YieldLaw& law : problem.species.yields) {
    yield_tallies_.emplace_back(tallies_.size());
    largest_yield_.push_back(law.largest(problem.species.ions->energy.largest()));
  }
  for (std::uint32_t b = 0; b < batch_count; ++b) {
    // Ray numbers of the scramblings lie above those of all rays.
    RandomStream random(
        {options.seed, options.time_step, problem.species_index, (std::uint64_t{1} << 63) + b});
    starts_.emplace_back(std::array{random.bits(), random.bits(), random.bits(), random.bits()});
  }
}

Particle Tracer::emit(std::uint64_t ray) const {
  const FluxOptions& options = problem_.options;
  const RayScene& scene = problem_.scene;
  const auto batch = static_cast<std::uint32_t>(ray % batch_count);
  const auto xi = starts_[batch].point(static_cast<std::uint32_t>(ray / batch_count));
  Particle particle{
      .ray = {.r = {xi[0] * scene.upper().x, xi[1] * scene.upper().y, scene.source_height()},
              .u = {}},
      .batch = batch,
      .random = RandomStream({options.seed, options.time_step, problem_.species_index, ray})};
  turn(particle, source_direction({xi[2], xi[3]}, particle.random));
  if (problem_.species.ions) {
    const double u = particle.random.uniform_double();
    particle.energy = static_cast<float>(problem_.species.ions->energy.quantile(u));
  }
  return particle;
}

Vec3d Tracer::source_direction(UnitSquare xi, RandomStream& random) const {
  const SourceLobe& source = problem_.species.source;
  Vec3d u = sample_source(xi, source.cosine_power);
  Vec3d axis = source.direction;
  if (source.rotating) {
    const double tilt = std::sqrt(axis.x * axis.x + axis.y * axis.y);
    const auto [sine, cosine] = sample_azimuth(random.uniform_double());
    axis = {tilt * cosine, tilt * sine, axis.z};
  }
  if (axis.x == 0 && axis.y == 0) return u;
  constexpr double horizon = -1e-6;
  while ((u = about_axis(u.x, u.y, -u.z, axis)).z > horizon) {
    const double xi1 = random.uniform_double();
    u = sample_source({xi1, random.uniform_double()}, source.cosine_power);
  }
  return normalized(u);
}

// Sets the direction of a particle: of its flight, and, in two dimensions, its own.
void Tracer::turn(Particle& particle, Vec3d u) const {
  if (problem_.options.two_dimensional) {
    particle.along_slice = static_cast<float>(u.y);
    u = project_to_cross_section(u);
  }
  particle.ray.u = u;
}

// One batch after the other, so that a pool adds to few of the sums of a facet. These are whole
// numbers, which do not tell how large a pool was.
void Tracer::trace(std::uint64_t first, std::uint64_t end) {
  const std::uint64_t count = end - first;
  const std::uint64_t in_batch = count / batch_count;
  const std::size_t pool = std::clamp(
      count / (pools_per_thread * static_cast<std::size_t>(thread_count())), least_pool, most_pool);
  parallel_for(count, pool, [&](std::size_t pool_first, std::size_t pool_end) {
    std::vector<Particle> particles;
    particles.reserve(pool_end - pool_first);
    for (std::uint64_t k = pool_first; k < pool_end; ++k)
      particles.push_back(emit(first + k % in_batch * batch_count + k / in_batch));
    trace_pool(std::move(particles));
  });
  rays_ = end;
}

// All particles of a pool fly once, then all that go on fly again.
void Tracer::trace_pool(std::vector<Particle> particles) {
  Counts counts;
  counts.emitted = static_cast<std::int64_t>(particles.size()) * unit_weight;
  std::vector<Particle> sorted;
  std::vector<Ray> rays(flights_at_once);
  std::vector<Flight> flights(flights_at_once);
  while (!particles.empty()) {
    counts.segments += static_cast<std::int64_t>(particles.size());
    const auto order = flight_order(problem_.scene, particles.size(),
                                    [&](std::size_t i) -> const Ray& { return particles[i].ray; });
    sorted.clear();
    sorted.reserve(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      if (k + ahead < order.size()) __builtin_prefetch(&particles[order[k + ahead]]);
      sorted.push_back(particles[order[k]]);
    }
    particles.clear();
    for (std::size_t first = 0; first < sorted.size(); first += flights_at_once) {
      const std::size_t count = std::min(flights_at_once, sorted.size() - first);
      for (std::size_t k = 0; k < count; ++k) rays[k] = sorted[first + k].ray;
      problem_.scene.fly(std::span(rays).first(count), flights);
      for (std::size_t k = 0; k < count; ++k) {
        if (k + ahead < count) prefetch(flights[k + ahead], sorted[first + k + ahead]);
        Particle& particle = sorted[first + k];
        if (arrive(particle, flights[k], counts)) particles.push_back(particle);
      }
    }
  }
  add(counts_, counts);
}

// Asks for what arrive() will need from memory.
void Tracer::prefetch(const Flight& flight, const Particle& particle) const {
  if (flight.end != Flight::End::front) return;
  __builtin_prefetch(&absorbed_weight_[flight.facet]);
  problem_.scene.prefetch(flight.facet);
  __builtin_prefetch(&tallies_[tally_index(particle.batch, flight.facet)], 1);
}

Vec3d Tracer::emission_normal(std::uint32_t facet) const {
  const Vec3d n = problem_.scene.normal(facet);
  return problem_.options.two_dimensional ? project_to_cross_section(n) : n;
}

// Books the end of a flight and starts the next; false if there is none.
bool Tracer::arrive(Particle& particle, const Flight& flight, Counts& counts) {
  switch (flight.end) {
    case Flight::End::sky:
      counts.escaped += particle.weight;
      return false;
    case Flight::End::back:
      counts.lost_back_face += particle.weight;
      return false;
    case Flight::End::below:
      counts.lost_below += particle.weight;
      return false;
    case Flight::End::side_limit:
      counts.lost_side_limit += particle.weight;
      return false;
    case Flight::End::front:
      break;
  }
  const std::uint32_t f = flight.facet;
  add(tallies_[tally_index(particle.batch, f)], std::int64_t{particle.weight});
  particle.ray.r = flight.r;
  particle.ray.from = f;
  if (problem_.species.ions) return hit(particle, flight, counts);
  if (!absorb(particle, absorbed_weight_[f], counts)) return false;
  const UnitSquare xi{particle.random.uniform_double(), particle.random.uniform_double()};
  turn(particle, sample_cosine(xi, emission_normal(f)));
  return true;
}

// An ion: counts what it does at a facet and reflects it; false if it stays there.
bool Tracer::hit(Particle& particle, const Flight& flight, Counts& counts) {
  const Ions& ions = *problem_.species.ions;
  const std::uint32_t f = flight.facet;
  const Vec3d n = emission_normal(f);
  Vec3d d = flight.u;
  if (problem_.options.two_dimensional) {
    const double y = particle.along_slice;
    d = std::sqrt(1 - y * y) * d;
    d.y = y;
  }
  const double half_sine = AngleTable::half_sine(-dot(d, n));
  for (std::size_t k = 0; k < yield_tallies_.size(); ++k) {
    const double yield = problem_.species.yields[k].at(particle.energy, half_sine);
    if (!(yield > 0)) continue;
    const double part = yield / largest_yield_[k];
    add(yield_tallies_[k][tally_index(particle.batch, f)],
        static_cast<std::int64_t>(std::floor(particle.weight * part + 0.5)));
  }
  const auto part = static_cast<std::uint32_t>(
      std::floor(ions.sticking.at(half_sine) * absorbed_weight_[f] + 0.5));
  if (!absorb(particle, part, counts)) return false;
  particle.energy *= static_cast<float>(
      sample_kept_energy(ions.energy_kept.at(half_sine), ions.energy_deviation, particle.random));
  if (particle.energy < ions.least_energy) {
    counts.absorbed += particle.weight;
    return false;
  }
  turn(particle, sample_reflection(d, n, ions.cone.at(half_sine), particle.random));
  return true;
}

// Leaves a part of the weight at a facet, out of unit_weight; false if nothing goes on.
bool Tracer::absorb(Particle& particle, std::uint32_t part, Counts& counts) const {
  const auto absorbed = static_cast<std::uint32_t>(
      (std::uint64_t{particle.weight} * part + unit_weight / 2) / unit_weight);
  counts.absorbed += absorbed;
  particle.weight -= absorbed;
  return particle.weight >= roulette_below || play_roulette(particle, counts);
}

// Goes on with probability weight / roulette_weight, so the weight is kept on average.
bool Tracer::play_roulette(Particle& particle, Counts& counts) {
  if (particle.weight == 0) return false;
  const bool goes_on = std::uint64_t{particle.random.bits()} * roulette_weight <
                       (std::uint64_t{particle.weight} << 32);
  const std::uint32_t weight = goes_on ? roulette_weight : 0;
  counts.roulette += std::int64_t{weight} - std::int64_t{particle.weight};
  particle.weight = weight;
  return goes_on;
}

FluxEstimate Tracer::estimate_flux() const { return estimate_of(tallies_, 1); }

std::vector<Tally> Tracer::yields() const {
  std::vector<Tally> result;
  for (std::size_t k = 0; k < yield_tallies_.size(); ++k) {
    result.push_back(estimate_of(yield_tallies_[k], largest_yield_[k]).tally);
    result.back().quantity = Tally::Quantity::yield;
  }
  return result;
}

// Of sums of weights times a quantity in the given unit.
FluxEstimate Tracer::estimate_of(std::span<const std::int64_t> tallies, double unit) const {
  const RayScene& scene = problem_.scene;
  const double scale = unit * scene.source_area() / (static_cast<double>(rays_) * unit_weight);
  std::vector<double> sums(scene.facet_count());
  for (std::size_t k = 0; k < tallies.size(); ++k)
    sums[k % sums.size()] += static_cast<double>(tallies[k]);
  // Of a batch: its own estimate less that of all.
  const auto deviation = [&](std::size_t f, std::size_t b) {
    const auto own = static_cast<double>(tallies[tally_index(b, f)]);
    return (own * batch_count - sums[f]) * scale / scene.area(f);
  };
  return estimate(scene, problem_.patches,
                  {.flux = [&](std::size_t f) { return sums[f] * scale / scene.area(f); },
                   .deviation = deviation,
                   .deviations = batch_count,
                   .divisor = batch_count * (batch_count - 1),
                   .unseen = unit * scene.source_area() / static_cast<double>(rays_)});
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

FluxAudit audit_of(const Counts& counts) {
  const auto particles = [](std::int64_t weight) {
    return static_cast<double>(weight) / unit_weight;
  };
  return {.emitted = particles(counts.emitted),
          .absorbed = particles(counts.absorbed),
          .escaped = particles(counts.escaped),
          .lost_back_face = particles(counts.lost_back_face),
          .lost_below = particles(counts.lost_below),
          .lost_side_limit = particles(counts.lost_side_limit),
          .roulette = particles(counts.roulette)};
}

}  // namespace

FluxField trace_forward(const FluxProblem& problem) {
  const FluxOptions& options = problem.options;
  const bool fixed = options.rays > 0;
  // A cap is never passed, unless it is below one batch.
  const std::uint64_t most = options.max_rays / batch_count * batch_count;
  const std::uint64_t cap = whole_batches(fixed ? options.rays : std::max<std::uint64_t>(most, 1));
  Tracer tracer(problem);
  FluxEstimate estimate;
  for (std::uint64_t rays = fixed ? cap : std::min(cap, first_round);;) {
    tracer.trace(tracer.rays(), rays);
    estimate = tracer.estimate_flux();
    if (estimate.error <= options.target_error || rays == cap) break;
    rays = std::min(cap, whole_batches(predicted_rays(rays, estimate.error, options.target_error)));
  }
  std::vector<Tally> tallies = tracer.yields();
  tallies.insert(tallies.begin(), std::move(estimate.tally));
  return {.tallies = std::move(tallies),
          .audit = audit_of(tracer.counts()),
          .rays = tracer.rays(),
          .segments = static_cast<std::uint64_t>(tracer.counts().segments),
          .error = estimate.error,
          .max_facet_error = estimate.max_facet_error,
          .target_reached = fixed || estimate.error <= options.target_error};
}

}  // namespace scarp
