#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/random.h"
#include "core/system/huge_pages.h"
#include "flux/rays/patches.h"
#include "flux/rays/problem.h"
#include "flux/rays/ray.h"
#include "flux/sampling/shared_sums.h"

namespace scarp {

/// Independent parts of all particles, whose spread gives the standard error.
inline constexpr std::uint32_t batch_count = 32;

/// A particle, at the start of a flight or where it has arrived. One line of memory.
struct alignas(64) Particle {
  /// Weights are whole numbers, so that every split and every sum is exact in any order: 2^30 is
  /// the weight of a particle at its start, and 2^32 of them fit in a sum.
  static constexpr std::uint32_t unit_weight = 1U << 30;

  Vec3d r{};
  Vec3f u{};  ///< to the length of 1 in single precision
  std::uint32_t facet = Ray::no_facet;
  std::uint32_t weight = unit_weight;
  float energy = 0;         ///< of ions
  float along_slice = 0;    ///< y of the direction before it was projected on a cross-section
  std::uint32_t block = 0;  ///< of random numbers, for where it arrives next
  std::uint64_t ray = 0;    ///< of the random numbers; its remainder by batch_count is the batch
};

/// Sets the direction of a particle: of its flight, and, in sections, its own in space.
void turn(const FluxProblem& problem, Particle& particle, Vec3d u);
/// The latter, as turn() was given it.
Vec3d direction_of(const FluxProblem& problem, const Particle& particle);

/// Follows particles until they stick or leave, and sums up what arrives where.
///
/// Neutral particles are re-emitted by the cosine law, ions as their species says. Below a tenth of
/// its weight a particle plays roulette.
class Tracer {
 public:
  explicit Tracer(const FluxProblem& problem);

  /// Puts particles number first, first + 1, ..., at most CosineSamples::most of them, where they
  /// start, on any thread; it is faster if those of a batch follow each other.
  using Start = std::function<void(std::uint64_t first, std::span<Particle> particles)>;

  /// Follows particles at the start of their first flight. The sums are over all so far.
  void trace(std::uint64_t count, const Start& start);
  /// Follows particles that have arrived: what does not stick of them.
  void trace_on(std::uint64_t count, const Start& arrival);

  /// Arrivals (tally 0) or yields on the facets, if a particle stands for so much flux times area
  /// (squared spacings); deviations are those of batches. Valid while the tracer lives.
  FluxSpread spread(std::size_t tally, double worth) const;

  /// In particles.
  FluxAudit audit() const;
  std::uint64_t segments() const { return static_cast<std::uint64_t>(counts_.segments); }

 private:
  struct Counts {
    std::int64_t emitted = 0;
    std::int64_t absorbed = 0;
    std::array<std::int64_t, Flight::end_count> ended{};  // of flights, by how
    std::int64_t roulette = 0;
    std::int64_t segments = 0;
  };
  // What the particles of a pool do.
  struct Books {
    explicit Books(SharedSums& sums) : arrivals(sums) {}
    Counts counts;
    SharedSums::Buffer arrivals;
  };

  struct Impact {
    Vec3d n;
    Vec3d d;               // in space
    double half_sine = 0;  // of half the angle between them
  };

  class Pool;
  struct Flying;
  struct Arrivals;

  template <class Send>
  void trace_pools(std::uint64_t count, const Start& start, const Send& send);
  void trace_pool(Pool& pool, Books& books) const;
  void land(Flying& flying, Pool& next, Books& books) const;
  void prefetch(std::size_t facet) const;
  void arrive(const Particle& particle, const Flight& flight, Arrivals& arrivals,
              SharedSums::Buffer& sums) const;
  void count_yields(const Particle& particle, SharedSums::Buffer& sums) const;
  void send_on(Arrivals& arrivals, Pool& pool, Counts& counts) const;
  void send_on_neutrals(Arrivals& arrivals, Pool& pool, Counts& counts) const;
  bool send_on_ion(Particle& ion, std::uint32_t sticking, Counts& counts) const;
  Impact impact_of(const Particle& ion) const;

  // A pool meets few batches, and all facets.
  static std::size_t row_of(std::size_t tally, std::size_t batch) {
    return tally * batch_count + batch;
  }

  const FluxProblem& problem_;
  RandomStreams random_;
  std::vector<std::uint32_t> absorbed_weight_;  // of a particle of unit weight, per facet
  std::vector<double> units_;  // of the weights of each tally: 1, the largest yield of a law
  SharedSums sums_;            // of weights, by tally, batch and facet
  Counts counts_;
};

}  // namespace scarp
