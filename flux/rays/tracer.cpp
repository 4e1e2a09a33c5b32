#include "flux/rays/tracer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>

#include "core/parallel.h"
#include "core/vector_kernel.h"
#include "flux/rays/spatial_order.h"
#include "flux/sampling/sampling.h"

namespace scarp {

namespace {

// Of rays that fly together: more of them have more of the scene in common, fewer fit in the cache
// and share out among threads.
constexpr std::size_t least_pool = std::size_t{1} << 12;
constexpr std::size_t most_pool = std::size_t{1} << 16;
constexpr std::size_t pools_per_thread = 2;

// How many turns ahead the memory is asked for what will be needed.
constexpr std::size_t ahead = 16;

constexpr std::uint32_t unit_weight = Particle::unit_weight;

// Below the first a particle goes on with the second or not at all.
constexpr std::uint32_t roulette_below = unit_weight / 10;
constexpr std::uint32_t roulette_weight = 3 * (unit_weight / 10);

std::uint32_t batch_of(const Particle& particle) {
  return static_cast<std::uint32_t>(particle.ray % batch_count);
}

Ray ray_of(const Particle& particle) {
  return {.r = particle.r, .u = normalized(Vec3d(particle.u)), .from = particle.facet};
}

// What sticks of a weight, and what its rest becomes by roulette: that goes on with probability
// rest / roulette_weight, so the weight is kept on average.
struct Rest {
  std::uint32_t absorbed;
  std::uint32_t before;
  std::uint32_t after;
};

inline Rest rest_of(std::uint32_t weight, std::uint32_t sticking, std::uint32_t random) {
  const auto absorbed = static_cast<std::uint32_t>(
      (std::uint64_t{weight} * sticking + unit_weight / 2) / unit_weight);
  const std::uint32_t before = weight - absorbed;
  const bool goes_on = std::uint64_t{random} * roulette_weight < std::uint64_t{before} << 32;
  const std::uint32_t played = goes_on ? roulette_weight : 0;
  return {absorbed, before, before < roulette_below ? played : before};
}

template <class Number>
void add(Number& sum, Number term) {
  std::atomic_ref<Number>(sum).fetch_add(term, std::memory_order_relaxed);
}

}  // namespace

// Particles about to fly, each with the key of its place in the order of flights: those that start
// close together in about the same direction follow each other.
class Tracer::Pool {
 public:
  Pool(const RayScene& scene, std::size_t capacity)
      : lowest_(scene.lowest()),
        per_size_{1 / scene.upper().x, 1 / scene.upper().y,
                  1 / (scene.source_height() - scene.lowest())} {
    particles_.reserve(capacity);
    keys_.reserve(capacity);
  }

  void add(const Particle& particle) {
    particles_.push_back(particle);
    const Vec3d from_lowest = particle.r - Vec3d{0, 0, lowest_};
    last_.add(Vec3f(Vec3d{from_lowest.x * per_size_.x, from_lowest.y * per_size_.y,
                          from_lowest.z * per_size_.z}),
              particle.u);
    if (last_.count == FlightStarts::most) find_last_keys();
  }

  void clear() {
    particles_.clear();
    keys_.clear();
  }

  std::size_t size() const { return particles_.size(); }
  const Particle& operator[](std::size_t i) const { return particles_[i]; }
  std::vector<std::uint32_t> order() {
    find_last_keys();
    return sorted_order(keys_);
  }

 private:
  void find_last_keys() {
    find_keys(last_);
    keys_.insert(keys_.end(), last_.key.begin(),
                 last_.key.begin() + static_cast<std::ptrdiff_t>(last_.count));
    last_.count = 0;
  }

  double lowest_;
  Vec3d per_size_;
  LargeVector<Particle> particles_;
  std::vector<std::uint32_t> keys_;
  FlightStarts last_;  // whose keys are yet to be found
};

// As many as are sent on at once.
struct Tracer::Arrivals {
  static constexpr std::size_t most = CosineSamples::most;
  static_assert(most == RandomStreams::Blocks::most);

  std::array<Particle, most> particles;
  std::array<std::uint32_t, most> sticking;  // out of unit_weight
  std::size_t count = 0;

  Particle& add(const Particle& particle, std::uint32_t part) {
    sticking[count] = part;
    return particles[count++] = particle;
  }
};

namespace {

struct Weights {
  std::array<std::uint32_t, CosineSamples::most> weight;
  std::int64_t absorbed = 0;
  std::int64_t roulette = 0;
};

// Takes two numbers of each block for the direction, one for roulette.
SCARP_WIDE_KERNEL void draw(const RandomStreams::Blocks& random,
                            const std::array<std::uint32_t, CosineSamples::most>& sticking,
                            CosineSamples& samples, Weights& weights) {
  std::int64_t absorbed = 0;
  std::int64_t roulette = 0;
  for (std::size_t k = 0; k < random.count; ++k) {
    samples.xi1[k] = random.words[0][k] * 0x1.0p-32;
    samples.xi2[k] = random.words[1][k] * 0x1.0p-32;
    const Rest rest = rest_of(weights.weight[k], sticking[k], random.words[2][k]);
    absorbed += rest.absorbed;
    roulette += std::int64_t{rest.after} - std::int64_t{rest.before};
    weights.weight[k] = rest.after;
  }
  weights.absorbed = absorbed;
  weights.roulette = roulette;
}

}  // namespace

void turn(const FluxProblem& problem, Particle& particle, Vec3d u) {
  if (problem.options.is_section()) particle.along_slice = static_cast<float>(u.y);
  particle.u = Vec3f(problem.in_section(u));
}

Vec3d direction_of(const FluxProblem& problem, const Particle& particle) {
  const Vec3d u(particle.u);
  if (!problem.options.is_section()) return u;
  const double y = particle.along_slice;
  Vec3d direction = std::sqrt(1 - y * y) * u;
  direction.y = y;
  return direction;
}

Tracer::Tracer(const FluxProblem& problem)
    : problem_(problem),
      random_({problem.options.seed, problem.options.time_step, problem.species_index, 0}),
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

void Tracer::trace(std::uint64_t count, const Start& start) {
  trace_pools(count, start, [](std::span<const Particle> particles, Pool& pool, Counts&) {
    for (const Particle& particle : particles) pool.add(particle);
  });
}

void Tracer::trace_on(std::uint64_t count, const Start& arrival) {
  trace_pools(count, arrival, [&](std::span<const Particle> particles, Pool& pool, Counts& counts) {
    Arrivals arrivals;
    for (const Particle& particle : particles) arrivals.add(particle, 0);
    send_on(arrivals, pool, counts);
  });
}

// Sums are whole numbers, which do not tell how large a pool was.
template <class Send>
void Tracer::trace_pools(std::uint64_t count, const Start& start, const Send& send) {
  const std::size_t pool_size = std::clamp(
      count / (pools_per_thread * static_cast<std::size_t>(thread_count())), least_pool, most_pool);
  parallel_for(count, pool_size, [&](std::size_t first, std::size_t end) {
    Books books(sums_);
    Counts& counts = books.counts;
    Pool pool(problem_.scene, end - first);
    std::array<Particle, Arrivals::most> particles;
    for (std::uint64_t k = first; k < end; k += particles.size()) {
      const auto some = std::span(particles).first(std::min(particles.size(), end - k));
      std::ranges::fill(some, Particle{});
      start(k, some);
      for (const Particle& particle : some) counts.emitted += particle.weight;
      send(some, pool, counts);
    }
    trace_pool(pool, books);
    add(counts_.emitted, counts.emitted);
    add(counts_.absorbed, counts.absorbed);
    for (std::size_t end = 0; end < Flight::end_count; ++end)
      add(counts_.ended[end], counts.ended[end]);
    add(counts_.roulette, counts.roulette);
    add(counts_.segments, counts.segments);
  });
}

// Particles of a pool that fly together, and what each did.
struct Tracer::Flying {
  std::array<const Particle*, Arrivals::most> particles;
  std::array<Ray, Arrivals::most> rays;
  std::array<Flight, Arrivals::most> flights;
  std::size_t count = 0;
  Arrivals arrivals;
};

// All particles of a pool fly once, then all that go on fly again.
void Tracer::trace_pool(Pool& pool, Books& books) const {
  Pool next(problem_.scene, pool.size());
  const auto flying = std::make_unique<Flying>();
  for (; pool.size() > 0; std::swap(pool, next), next.clear()) {
    books.counts.segments += static_cast<std::int64_t>(pool.size());
    const std::vector<std::uint32_t> order = pool.order();
    for (std::size_t first = 0; first < order.size(); first += flying->count) {
      flying->count = std::min(flying->particles.size(), order.size() - first);
      for (std::size_t k = 0; k < flying->count; ++k) {
        if (first + k + ahead < order.size()) __builtin_prefetch(&pool[order[first + k + ahead]]);
        flying->particles[k] = &pool[order[first + k]];
        flying->rays[k] = ray_of(*flying->particles[k]);
      }
      const auto flights = std::span(flying->flights).first(flying->count);
      problem_.scene.fly(std::span(flying->rays).first(flying->count), flights);
      land(*flying, next, books);
    }
  }
}

// What arrives goes to the next pool.
void Tracer::land(Flying& flying, Pool& next, Books& books) const {
  // Whether a flight arrives cannot be foreseen: no branch asks.
  std::array<std::uint32_t, Arrivals::most> arrived;
  std::size_t arrived_count = 0;
  for (std::size_t k = 0; k < flying.count; ++k) {
    const Flight::End end = flying.flights[k].end;
    books.counts.ended[static_cast<std::size_t>(end)] += flying.particles[k]->weight;
    arrived[arrived_count] = static_cast<std::uint32_t>(k);
    arrived_count += end == Flight::End::front ? 1 : 0;
  }
  const auto landed = std::span(arrived).first(arrived_count);
  for (const std::uint32_t k : landed) prefetch(flying.flights[k].facet);
  for (const std::uint32_t k : landed)
    arrive(*flying.particles[k], flying.flights[k], flying.arrivals, books.arrivals);
  send_on(flying.arrivals, next, books.counts);
}

// Asks for what arrive() will need from memory.
void Tracer::prefetch(std::size_t facet) const {
  __builtin_prefetch(&absorbed_weight_[facet]);
  problem_.scene.prefetch(facet);
}

void Tracer::arrive(const Particle& particle, const Flight& flight, Arrivals& arrivals,
                    SharedSums::Buffer& sums) const {
  Particle& arrived = arrivals.add(particle, absorbed_weight_[flight.facet]);
  arrived.r = flight.r;
  arrived.u = Vec3f(flight.u);
  arrived.facet = flight.facet;
  sums.add(row_of(0, batch_of(particle)), flight.facet, particle.weight);
  if (units_.size() > 1) count_yields(arrived, sums);
}

void Tracer::count_yields(const Particle& particle, SharedSums::Buffer& sums) const {
  const double half_sine = impact_of(particle).half_sine;
  for (std::size_t k = 1; k < units_.size(); ++k) {
    const double yield = problem_.species.yields[k - 1].at(particle.energy, half_sine);
    if (!(yield > 0)) continue;
    const double part = yield / units_[k];
    sums.add(row_of(k, batch_of(particle)), particle.facet,
             static_cast<std::uint32_t>(std::floor(particle.weight * part + 0.5)));
  }
}

void Tracer::send_on(Arrivals& arrivals, Pool& pool, Counts& counts) const {
  if (problem_.species.ions) {
    for (std::size_t k = 0; k < arrivals.count; ++k)
      if (send_on_ion(arrivals.particles[k], arrivals.sticking[k], counts))
        pool.add(arrivals.particles[k]);
  } else {
    send_on_neutrals(arrivals, pool, counts);
  }
  arrivals.count = 0;
}

void Tracer::send_on_neutrals(Arrivals& arrivals, Pool& pool, Counts& counts) const {
  RandomStreams::Blocks random;
  CosineSamples samples;
  Weights weights;
  for (std::size_t k = 0; k < arrivals.count; ++k) {
    const Particle& particle = arrivals.particles[k];
    random.add(particle.ray, particle.block);
    samples.add({}, problem_.normal(particle.facet));
    weights.weight[k] = particle.weight;
  }
  random_.draw(random);
  draw(random, arrivals.sticking, samples, weights);
  sample_cosines(samples);
  counts.absorbed += weights.absorbed;
  counts.roulette += weights.roulette;
  for (std::size_t k = 0; k < arrivals.count; ++k) {
    if (weights.weight[k] == 0) continue;
    Particle& particle = arrivals.particles[k];
    particle.weight = weights.weight[k];
    ++particle.block;
    turn(problem_, particle, samples.direction(k));
    pool.add(particle);
  }
}

Tracer::Impact Tracer::impact_of(const Particle& ion) const {
  Impact impact{.n = problem_.normal(ion.facet), .d = direction_of(problem_, ion)};
  impact.half_sine = AngleTable::half_sine(-dot(impact.d, impact.n));
  return impact;
}

// False if it ends where it has arrived.
bool Tracer::send_on_ion(Particle& ion, std::uint32_t sticking, Counts& counts) const {
  const Ions& ions = *problem_.species.ions;
  const Impact impact = impact_of(ion);
  RandomStream random = random_.of_ray(ion.ray, ion.block);
  const double part = ions.sticking.at(impact.half_sine) * sticking;
  const Rest rest =
      rest_of(ion.weight, static_cast<std::uint32_t>(std::floor(part + 0.5)), random.bits());
  counts.absorbed += rest.absorbed;
  counts.roulette += std::int64_t{rest.after} - std::int64_t{rest.before};
  ion.weight = rest.after;
  if (ion.weight == 0) return false;
  const double kept = ions.energy_kept.at(impact.half_sine);
  ion.energy *= static_cast<float>(sample_kept_energy(kept, ions.energy_deviation, random));
  if (ion.energy < ions.least_energy) {
    counts.absorbed += ion.weight;
    return false;
  }
  const double cone = ions.cone.at(impact.half_sine);
  turn(problem_, ion, sample_reflection(impact.d, impact.n, cone, random));
  ion.block = random.next_block();
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
  const auto ended = [&](Flight::End end) {
    return particles(counts_.ended[static_cast<std::size_t>(end)]);
  };
  return {.emitted = particles(counts_.emitted),
          .absorbed = particles(counts_.absorbed),
          .escaped = ended(Flight::End::sky),
          .lost_back_face = ended(Flight::End::back),
          .lost_below = ended(Flight::End::below),
          .lost_side_limit = ended(Flight::End::side_limit),
          .roulette = particles(counts_.roulette)};
}

}  // namespace scarp
