#include "flux/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"

namespace scarp {

namespace {

// Rays. The memory that more of them need would be asked for anew for each pool.
constexpr std::size_t pool_size = std::size_t{1} << 12;

// The part of the direct flux that a ray to the sky along u stands for. Under a Lambert source rays
// by Lambert's law all count the same; otherwise they share the work with rays along the lobe.
double lobe_weight(Vec3d u, Vec3d n, const SourceLobe& source) {
  if (source.is_lambert()) return 1;
  const double cosine = dot(u, n);
  if (cosine <= 0 || u.z <= 0) return 0;
  const double L = radiance(source, u.z);
  return L * cosine / (cosine / std::numbers::pi + L * u.z);
}

// The same of a source that is not equally bright everywhere.
double sky_weight(const Shot& shot, const Flight& flight, const FluxProblem& problem) {
  if (!problem.has_source()) return 0;
  return lobe_weight(shot.u, problem.normal(shot.ray.from), problem.species.source) *
         problem.source_density(flight.r);
}

class Viewer {
 public:
  Viewer(std::span<const FluxProblem> problems, const RayPlan& plan, const View& earlier)
      : problems_(problems), plan_(plan), earlier_(earlier) {}

  View look() const;

 private:
  std::vector<Shot> shoot(std::size_t begin, std::size_t end, const Shooter& shooter) const;
  void view_by_lambert(std::size_t begin, std::size_t end, View& view) const;
  void view_by_lobe(std::size_t begin, std::size_t end, std::size_t problem, View& view) const;
  std::uint32_t seen(std::size_t rank) const;
  std::uint64_t new_rays() const;

  std::span<const FluxProblem> problems_;
  const RayPlan& plan_;
  const View& earlier_;
};

std::vector<Shot> Viewer::shoot(std::size_t begin, std::size_t end, const Shooter& shooter) const {
  std::vector<Shot> shots;
  std::size_t count = 0;
  for (std::size_t rank = begin; rank < end; ++rank) count += plan_.rays(rank) - seen(rank);
  shots.reserve(count * set_count);
  for (std::size_t rank = begin; rank < end; ++rank) shooter.shoot(rank, seen(rank), shots);
  return shots;
}

void Viewer::view_by_lambert(std::size_t begin, std::size_t end, View& view) const {
  const Shooter shooter(problems_.front(), plan_, Shooter::Law::lambert);
  const std::vector<Shot> shots = shoot(begin, end, shooter);
  const std::vector<Flight> flights = shooter.fly(shots);
  const auto element_count = static_cast<std::uint32_t>(plan_.elements().count());
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const auto& [rank, index, set, image] = shots[i].name;
    std::uint32_t& hit = view.matrix.hits[(plan_.first(rank) + index) * set_count + set];
    switch (flights[i].end) {
      case Flight::End::front:
        hit = plan_.rank_at(flights[i].facet, flights[i].r);
        break;
      case Flight::End::back:
        hit = element_count + to_back;
        break;
      case Flight::End::below:
        hit = element_count + to_below;
        break;
      case Flight::End::side_limit:
        hit = element_count + to_side_limit;
        break;
      case Flight::End::sky:
        hit = element_count + to_sky;
        for (std::size_t p = 0; p < problems_.size(); ++p) {
          const double weight = sky_weight(shots[i], flights[i], problems_[p]);
          view.direct[p][rank * set_count + set] += static_cast<float>(weight);
        }
    }
  }
}

void Viewer::view_by_lobe(std::size_t begin, std::size_t end, std::size_t problem,
                          View& view) const {
  const Shooter shooter(problems_[problem], plan_, Shooter::Law::lobe);
  const std::vector<Shot> shots = shoot(begin, end, shooter);
  const std::vector<Flight> flights = shooter.fly(shots);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (flights[i].end != Flight::End::sky) continue;
    const ShotName& name = shots[i].name;
    const double weight = sky_weight(shots[i], flights[i], problems_[problem]);
    view.direct[problem][name.rank * set_count + name.set] += static_cast<float>(weight);
  }
}

// Rays of each set that the earlier view holds.
std::uint32_t Viewer::seen(std::size_t rank) const {
  const auto& first = earlier_.matrix.first;
  if (first.empty()) return 0;
  return static_cast<std::uint32_t>((first[rank + 1] - first[rank]) / set_count);
}

std::uint64_t Viewer::new_rays() const { return plan_.total() - earlier_.matrix.hits.size(); }

View Viewer::look() const {
  View view;
  const std::size_t size = plan_.size();
  view.matrix.first.resize(size + 1);
  for (std::size_t rank = 0; rank <= size; ++rank)
    view.matrix.first[rank] = plan_.first(rank) * set_count;
  view.matrix.hits.resize(plan_.total());
  for (std::size_t rank = 0; rank < size; ++rank) {
    if (earlier_.matrix.first.empty()) break;
    std::copy_n(
        earlier_.matrix.hits.begin() + static_cast<std::ptrdiff_t>(earlier_.matrix.first[rank]),
        seen(rank) * set_count,
        view.matrix.hits.begin() + static_cast<std::ptrdiff_t>(view.matrix.first[rank]));
  }
  view.direct = earlier_.direct;
  view.direct.resize(problems_.size(), std::vector<float>(size * set_count));

  const std::size_t grain =
      std::max<std::size_t>(1, pool_size * size / std::max<std::uint64_t>(1, new_rays()));
  parallel_for(size, grain, [&](std::size_t begin, std::size_t end) {
    view_by_lambert(begin, end, view);
    for (std::size_t p = 0; p < problems_.size(); ++p)
      if (is_looked_for(problems_[p])) view_by_lobe(begin, end, p, view);
  });
  view.flights = earlier_.flights + new_rays();
  for (const FluxProblem& problem : problems_)
    if (is_looked_for(problem)) view.flights += new_rays();
  return view;
}

}  // namespace

bool is_looked_for(const FluxProblem& problem) {
  return problem.has_source() && !problem.species.source.is_lambert();
}

View look(std::span<const FluxProblem> problems, const RayPlan& plan, const View& earlier) {
  return Viewer(problems, plan, earlier).look();
}

}  // namespace scarp
