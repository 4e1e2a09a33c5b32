#include "flux/engines/first_arrivals.h"

#include <algorithm>
#include <iterator>

#include "core/parallel.h"
#include "flux/sampling/angle_table.h"

namespace scarp {

namespace {

constexpr std::size_t pool_size = std::size_t{1} << 16;  // rays

class Looker {
 public:
  Looker(const FluxProblem& problem, const RayPlan& plan, FirstArrivals& found)
      : problem_(problem), plan_(plan), shooter_(problem, plan, Shooter::Law::lobe), found_(found) {
    // What the energies do to a yield is known before any ray flies.
    for (const YieldLaw& law : problem.species.yields)
      mean_yields_.emplace_back(law, problem.species.ions->energy);
  }

  void look();

 private:
  struct Part {
    std::vector<FirstArrivals::Lit> lit;
    std::uint64_t flights = 0;
  };
  void look(std::size_t begin, std::size_t end, Part& part);
  void book(const Shot& shot, const Flight& flight, Part& part);

  const FluxProblem& problem_;
  const RayPlan& plan_;
  Shooter shooter_;
  std::vector<MeanYield> mean_yields_;
  FirstArrivals& found_;
};

// A ray along the lobe that meets the source stands for a flux of cosine / height: of particles
// that cross the source plane as often in all directions of the lobe, a facet gets more the more it
// faces them, and the brighter the source is where the ray ends.
void Looker::book(const Shot& shot, const Flight& flight, Part& part) {
  const std::uint32_t rank = shot.name.rank;
  const std::size_t at = rank * set_count + shot.name.set;
  const double cosine = dot(shot.u, problem_.normal(shot.ray.from));
  const double flux = cosine / shot.u.z * problem_.source_density(flight.r);
  const double half_sine = AngleTable::half_sine(cosine);
  found_.sums.front()[at] += flux;
  for (std::size_t k = 0; k < mean_yields_.size(); ++k)
    found_.sums[k + 1][at] += flux * mean_yields_[k].at(half_sine);
  double sticking = problem_.sticking[shot.ray.from];
  if (problem_.species.ions) sticking *= problem_.species.ions->sticking.at(half_sine);
  const auto goes_on = static_cast<float>(flux * (1 - sticking));
  if (!(goes_on > 0)) return;
  found_.sums.back()[at] += goes_on;
  part.lit.push_back({.name = shot.name, .goes_on = goes_on});
}

void Looker::look(std::size_t begin, std::size_t end, Part& part) {
  const std::vector<Shot> shots =
      shooter_.shoot(begin, end, [this](std::size_t rank) { return found_.rays[rank]; });
  const std::vector<Flight> flights = shooter_.fly(shots);
  part.flights = flights.size();
  for (std::size_t i = 0; i < shots.size(); ++i) {
    ++found_.flown[shots[i].name.rank];
    if (!shooter_.meets_source(shots[i], flights[i])) continue;
    ++found_.met[shots[i].name.rank];
    book(shots[i], flights[i], part);
  }
}

void Looker::look() {
  const std::size_t size = plan_.size();
  found_.rays.resize(size);
  found_.flown.resize(size);
  found_.met.resize(size);
  found_.sums.resize(mean_yields_.size() + 2, std::vector<double>(size * set_count));
  std::uint64_t new_rays = plan_.total();
  for (const std::uint32_t rays : found_.rays) new_rays -= rays * set_count;
  if (new_rays == 0) return;

  const std::size_t grain = std::max<std::size_t>(1, pool_size * size / new_rays);
  std::vector<Part> parts((size + grain - 1) / grain);
  parallel_for(size, grain,
               [&](std::size_t begin, std::size_t end) { look(begin, end, parts[begin / grain]); });
  const auto middle = static_cast<std::ptrdiff_t>(found_.lit.size());
  for (const Part& part : parts) {
    found_.lit.insert(found_.lit.end(), part.lit.begin(), part.lit.end());
    found_.flights += part.flights;
  }
  std::inplace_merge(found_.lit.begin(), found_.lit.begin() + middle, found_.lit.end(),
                     [](const auto& a, const auto& b) { return a.name.rank < b.name.rank; });
  for (std::size_t rank = 0; rank < size; ++rank) found_.rays[rank] = plan_.rays(rank);
}

}  // namespace

FirstArrivals look_for_source(const FluxProblem& problem, const RayPlan& plan,
                              FirstArrivals earlier) {
  Looker(problem, plan, earlier).look();
  return earlier;
}

bool sticks_at_once(const FluxProblem& problem) {
  const bool at_all_angles = !problem.species.ions || problem.species.ions->sticking.least() == 1;
  return at_all_angles && std::ranges::all_of(problem.sticking, [](float s) { return s == 1; });
}

}  // namespace scarp
