#include "flux/engines/onward.h"

#include <array>

namespace scarp {

namespace {

// Of 32 arrivals in a row, close together on the surface, each goes to another batch.
std::vector<std::uint8_t> batches_of(RandomStream random, std::size_t count) {
  static_assert(batch_count == 32);
  std::vector<std::uint8_t> batches(count);
  std::uint32_t shuffle = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i % batch_count == 0) shuffle = random.bits();
    batches[i] = static_cast<std::uint8_t>((i ^ shuffle) % batch_count);
  }
  return batches;
}

}  // namespace

// In each batch, particles follow at equal steps of the flux that goes on.
OnwardParticles::OnwardParticles(const FluxProblem& problem, const RayPlan& plan,
                                 const FirstArrivals& arrivals, std::uint64_t wanted,
                                 std::uint64_t first)
    : problem_(problem),
      arrivals_(arrivals),
      shooter_(problem, plan, Shooter::Law::lobe),
      random_({problem.options.seed, problem.options.time_step, problem.species_index, 0}),
      first_(first) {
  const auto flux_area = [&](const FirstArrivals::Lit& lit) {
    const std::size_t rank = lit.name.rank;
    const double area = plan.elements().area(plan.element_at(rank));
    return lit.goes_on * area / (1.0 * arrivals.rays[rank] * set_count);
  };
  for (const FirstArrivals::Lit& lit : arrivals.lit) total_ += flux_area(lit);
  if (wanted == 0) return;
  const double step = total_ / static_cast<double>(wanted);
  // The stream lies above those of all particles.
  RandomStream random = random_.of_ray((std::uint64_t{1} << 63) + first);
  std::array<double, batch_count> to_next{};
  for (double& rest : to_next) rest = step * random.uniform();
  const std::vector<std::uint8_t> batches = batches_of(random, arrivals.lit.size());
  std::array<std::vector<Start>, batch_count> starts;
  for (std::uint32_t i = 0; i < batches.size(); ++i) {
    double& rest = to_next[batches[i]];
    rest -= flux_area(arrivals.lit[i]);
    for (; rest < 0; rest += step) starts[batches[i]].push_back({.lit = i, .batch = batches[i]});
  }
  for (const std::vector<Start>& of_batch : starts)
    starts_.insert(starts_.end(), of_batch.begin(), of_batch.end());
}

Particle OnwardParticles::start(std::uint64_t k) const {
  const auto [lit, batch] = starts_[k];
  const Shot shot = shooter_.shot(arrivals_.lit[lit].name);
  Particle particle{
      .r = shot.ray.r, .facet = shot.ray.from, .ray = (first_ + k) * batch_count + batch};
  turn(problem_, particle, -shot.u);
  if (problem_.species.ions) {
    RandomStream random = random_.of_ray(particle.ray);
    const double quantile = random.uniform();
    particle.energy = static_cast<float>(problem_.species.ions->energy.quantile(quantile));
    particle.block = random.next_block();
  }
  return particle;
}

}  // namespace scarp
