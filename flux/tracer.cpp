#include "flux/tracer.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/parallel.h"
#include "flux/sampling.h"
#include "flux/spatial_order.h"

namespace scarp {

namespace {

// Of rays that fly together: more of them have more of the scene in common, fewer fit in the cache
// and share out among threads.
constexpr std::size_t least_pool = std::size_t{1} << 12;
constexpr std::size_t most_pool = std::size_t{1} << 16;
constexpr std::size_t pools_per_thread = 2;

// Of a pool, while their ends fit in the cache.
constexpr std::size_t flights_at_once = 4096;

// How many turns ahead the memory is asked for what will be needed.
constexpr std::size_t ahead = 16;

constexpr std::uint32_t unit_weight = Particle::unit_weight;

// Below the first a particle goes on with the second or not at all.
constexpr std::uint32_t roulette_below = unit_weight / 10;
constexpr std::uint32_t roulette_weight = 3 * (unit_weight / 10);

template <class Number>
void add(Number& sum, Number term) {
  std::atomic_ref<Number>(sum).fetch_add(term, std::memory_order_relaxed);
}

// Goes on with probability weight / roulette_weight, so the weight is kept on average; returns the
// weight that is added.
std::int64_t play_roulette(Particle& particle) {
  if (particle.weight == 0) return 0;
  const std::uint32_t before = particle.weight;
  const bool goes_on =
      std::uint64_t{particle.random.bits()} * roulette_weight < (std::uint64_t{before} << 32);
  particle.weight = goes_on ? roulette_weight : 0;
  return std::int64_t{particle.weight} - std::int64_t{before};
}

}  // namespace

void turn(Particle& particle, Vec3d u, bool two_dimensional) {
  if (two_dimensional) {
    particle.along_slice = static_cast<float>(u.y);
    u = project_to_cross_section(u);
  }
  particle.ray.u = u;
}

Tracer::Tracer(const FluxProblem& problem)
    : problem_(problem),
      absorbed_weight_(problem.scene.facet_count()),
      units_(1 + problem.species.yields.size(), 1),
      sums_(units_.size() * batch_count, absorbed_weight_.size()) {
  for (std::size_t f = 0; f < absorbed_weight_.size(); ++f) {
    const double sticking = problem.sticking[f];
    absorbed_weight_[f] = static_cast<std::uint32_t>(std::floor(sticking * unit_weight + 0.5));
  }
  for (std::size_t k = 0; k < problem.species.yields.size(); ++k)
    units_[k + 1] = problem.species.yields[k].largest(problem.species.ions->energy.largest());
}

// Sums are whole numbers, which do not tell how large a pool was.
void Tracer::trace(std::uint64_t count, const std::function<Particle(std::uint64_t)>& start) {
  const std::size_t pool = std::clamp(
      count / (pools_per_thread * static_cast<std::size_t>(thread_count())), least_pool, most_pool);
  parallel_for(count, pool, [&](std::size_t first, std::size_t end) {
    Books books(sums_);
    Counts& counts = books.counts;
    std::vector<Particle> particles;
    particles.reserve(end - first);
    for (std::uint64_t k = first; k < end; ++k) {
      Particle particle = start(k);
      counts.emitted += particle.weight;
      const bool starts = particle.ray.from == Ray::no_facet || particle.is_emitted;
      const bool flies = starts || leave(particle, impact_of(particle), counts);
      if (flies) particles.push_back(particle);
    }
    trace_pool(std::move(particles), books);
    add(counts_.emitted, counts.emitted);
    add(counts_.absorbed, counts.absorbed);
    add(counts_.escaped, counts.escaped);
    add(counts_.lost_back_face, counts.lost_back_face);
    add(counts_.lost_below, counts.lost_below);
    add(counts_.lost_side_limit, counts.lost_side_limit);
    add(counts_.roulette, counts.roulette);
    add(counts_.segments, counts.segments);
  });
}

// All particles of a pool fly once, then all that go on fly again.
void Tracer::trace_pool(std::vector<Particle> particles, Books& books) {
  std::vector<Particle> sorted;
  std::vector<Ray> rays(flights_at_once);
  std::vector<Flight> flights(flights_at_once);
  while (!particles.empty()) {
    books.counts.segments += static_cast<std::int64_t>(particles.size());
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
        if (k + ahead < count) prefetch(flights[k + ahead]);
        Particle& particle = sorted[first + k];
        if (arrive(particle, flights[k], books)) particles.push_back(particle);
      }
    }
  }
}

// Asks for what arrive() will need from memory.
void Tracer::prefetch(const Flight& flight) const {
  if (flight.end != Flight::End::front) return;
  __builtin_prefetch(&absorbed_weight_[flight.facet]);
  problem_.scene.prefetch(flight.facet);
}

// Books the end of a flight and starts the next; false if there is none.
bool Tracer::arrive(Particle& particle, const Flight& flight, Books& books) {
  Counts& counts = books.counts;
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
  books.arrivals.add(row_of(0, particle.batch), f, particle.weight);
  particle.ray = {.r = flight.r, .u = flight.u, .from = f};
  const Impact impact = impact_of(particle);
  count_yields(particle, impact, books);
  const auto absorbed = static_cast<std::uint32_t>(
      (std::uint64_t{particle.weight} * sticking_part(particle, impact) + unit_weight / 2) /
      unit_weight);
  counts.absorbed += absorbed;
  particle.weight -= absorbed;
  if (particle.weight < roulette_below) counts.roulette += play_roulette(particle);
  return particle.weight > 0 && leave(particle, impact, counts);
}

Tracer::Impact Tracer::impact_of(const Particle& particle) const {
  Impact impact{.n = problem_.normal(particle.ray.from), .d = particle.ray.u};
  if (!problem_.species.ions) return impact;
  if (problem_.options.two_dimensional) {
    const double y = particle.along_slice;
    impact.d = std::sqrt(1 - y * y) * impact.d;
    impact.d.y = y;
  }
  impact.half_sine = AngleTable::half_sine(-dot(impact.d, impact.n));
  return impact;
}

void Tracer::count_yields(const Particle& particle, const Impact& impact, Books& books) {
  for (std::size_t k = 1; k < units_.size(); ++k) {
    const double yield = problem_.species.yields[k - 1].at(particle.energy, impact.half_sine);
    if (!(yield > 0)) continue;
    const double part = yield / units_[k];
    books.arrivals.add(row_of(k, particle.batch), particle.ray.from,
                       static_cast<std::uint32_t>(std::floor(particle.weight * part + 0.5)));
  }
}

// Out of unit_weight.
std::uint32_t Tracer::sticking_part(const Particle& particle, const Impact& impact) const {
  const std::uint32_t of_material = absorbed_weight_[particle.ray.from];
  if (!problem_.species.ions) return of_material;
  const double by_angle = problem_.species.ions->sticking.at(impact.half_sine);
  return static_cast<std::uint32_t>(std::floor(by_angle * of_material + 0.5));
}

// Sends a particle on from a facet; false if its energy ends there.
bool Tracer::leave(Particle& particle, const Impact& impact, Counts& counts) const {
  const bool two_dimensional = problem_.options.two_dimensional;
  if (!problem_.species.ions) {
    const UnitSquare xi{particle.random.uniform_double(), particle.random.uniform_double()};
    turn(particle, sample_cosine(xi, impact.n), two_dimensional);
    return true;
  }
  const Ions& ions = *problem_.species.ions;
  const double kept = ions.energy_kept.at(impact.half_sine);
  particle.energy *=
      static_cast<float>(sample_kept_energy(kept, ions.energy_deviation, particle.random));
  if (particle.energy < ions.least_energy) {
    counts.absorbed += particle.weight;
    return false;
  }
  const double cone = ions.cone.at(impact.half_sine);
  turn(particle, sample_reflection(impact.d, impact.n, cone, particle.random), two_dimensional);
  return true;
}

FluxSpread Tracer::spread(std::size_t tally, double worth) const {
  const RayScene& scene = problem_.scene;
  const double unit = units_[tally];
  const double scale = unit * worth / unit_weight;
  std::vector<double> sums(scene.facet_count());
  for (std::size_t b = 0; b < batch_count; ++b)
    for (std::size_t f = 0; f < sums.size(); ++f)
      sums[f] += static_cast<double>(sums_.at(row_of(tally, b), f));
  // Of a batch: its own estimate less that of all.
  const auto deviations = [this, &scene, tally, sums, scale](std::size_t f,
                                                             std::span<double> of_facet) {
    const double per_area = scale / scene.area(f);
    for (std::size_t b = 0; b < of_facet.size(); ++b) {
      const auto own = static_cast<double>(sums_.at(row_of(tally, b), f));
      of_facet[b] = (own * batch_count - sums[f]) * per_area;
    }
  };
  return {.flux = [&scene, sums, scale](std::size_t f) { return sums[f] * scale / scene.area(f); },
          .deviations = deviations,
          .count = batch_count,
          .divisor = batch_count * (batch_count - 1),
          .unseen = unit * worth};
}

FluxAudit Tracer::audit() const {
  const auto particles = [](std::int64_t weight) {
    return static_cast<double>(weight) / unit_weight;
  };
  return {.emitted = particles(counts_.emitted),
          .absorbed = particles(counts_.absorbed),
          .escaped = particles(counts_.escaped),
          .lost_back_face = particles(counts_.lost_back_face),
          .lost_below = particles(counts_.lost_below),
          .lost_side_limit = particles(counts_.lost_side_limit),
          .roulette = particles(counts_.roulette)};
}

}  // namespace scarp
