#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/random.h"
#include "flux/patches.h"
#include "flux/problem.h"
#include "flux/ray.h"
#include "flux/shared_sums.h"

namespace scarp {

/// Independent parts of all particles, whose spread gives the standard error.
inline constexpr std::uint32_t batch_count = 32;

/// A particle in flight. One that starts from a facet has just arrived there along its ray, unless
/// it is emitted there; it is that part of an arriving particle that does not stick.
struct Particle {
  /// Weights are whole numbers, so that every split and every sum is exact in any order: 2^30 is
  /// the weight of a particle at its start, and 2^33 of them fit in a sum.
  static constexpr std::uint32_t unit_weight = 1U << 30;

  Ray ray;
  std::uint32_t weight = unit_weight;
  std::uint32_t batch = 0;
  bool is_emitted = false;  ///< by its facet, along its ray
  float energy = 0;         ///< of ions
  float along_slice = 0;    ///< y of the direction before it was projected on a cross-section
  RandomStream random;
};

/// Sets the direction of a particle: of its flight, and, in two dimensions, its own.
void turn(Particle& particle, Vec3d u, bool two_dimensional);

/// Follows particles until they stick or leave, and sums up what arrives where.
///
/// Neutral particles are re-emitted by the cosine law, ions as their species says. Below a tenth of
/// its weight a particle plays roulette.
class Tracer {
 public:
  explicit Tracer(const FluxProblem& problem);

  /// Follows particles that start(0) to start(count - 1) give, on any thread; faster if those of a
  /// batch follow each other. The sums are over all so far.
  void trace(std::uint64_t count, const std::function<Particle(std::uint64_t k)>& start);

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
    std::int64_t escaped = 0;
    std::int64_t lost_back_face = 0;
    std::int64_t lost_below = 0;
    std::int64_t lost_side_limit = 0;
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
    Vec3d d{};             // in space
    double half_sine = 0;  // of half the angle between them; of ions
  };

  void trace_pool(std::vector<Particle> particles, Books& books);
  void prefetch(const Flight& flight) const;
  bool arrive(Particle& particle, const Flight& flight, Books& books);
  Impact impact_of(const Particle& particle) const;
  void count_yields(const Particle& particle, const Impact& impact, Books& books);
  std::uint32_t sticking_part(const Particle& particle, const Impact& impact) const;
  bool leave(Particle& particle, const Impact& impact, Counts& counts) const;

  // A pool meets few batches, and all facets.
  static std::size_t row_of(std::size_t tally, std::size_t batch) {
    return tally * batch_count + batch;
  }

  const FluxProblem& problem_;
  std::vector<std::uint32_t> absorbed_weight_;  // of a particle of unit weight, per facet
  std::vector<double> units_;  // of the weights of each tally: 1, the largest yield of a law
  SharedSums sums_;            // of weights, by tally, batch and facet
  Counts counts_;
};

}  // namespace scarp
