#pragma once

#include <cstdint>
#include <vector>

#include "flux/engines/first_arrivals.h"
#include "flux/rays/tracer.h"

namespace scarp {

/// Particles that go on from first arrivals, equally spaced in the list of these by what goes on.
class OnwardParticles {
 public:
  /// About `wanted` of them; earlier ones have the numbers below `first`.
  OnwardParticles(const FluxProblem& problem, const RayPlan& plan, const FirstArrivals& arrivals,
                  std::uint64_t wanted, std::uint64_t first);

  std::uint64_t count() const { return starts_.size(); }
  /// The flux times area (squared spacings) that all of them stand for.
  double total() const { return total_; }
  /// As it arrives. Those of a batch follow each other.
  Particle start(std::uint64_t k) const;

 private:
  struct Start {
    std::uint32_t lit = 0;
    std::uint32_t batch = 0;
  };

  const FluxProblem& problem_;
  const FirstArrivals& arrivals_;
  Shooter shooter_;
  RandomStreams random_;
  std::uint64_t first_ = 0;
  double total_ = 0;
  std::vector<Start> starts_;
};

}  // namespace scarp
