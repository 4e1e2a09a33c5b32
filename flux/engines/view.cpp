#include "flux/engines/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/parallel.h"

namespace scarp {

namespace {

// Rays. The memory that more of them need would be asked for anew for each pool.
constexpr std::size_t pool_size = std::size_t{1} << 12;

// Rays by Lambert's law that see more of the sky than this see it well enough.
constexpr double little_sky = 0.05;

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
  void view_by_lambert(std::size_t begin, std::size_t end, View& view) const;
  void view_by_lobe(std::size_t begin, std::size_t end, std::size_t problem, View& view) const;
  std::uint32_t seen(std::size_t rank) const;
  std::uint64_t new_rays() const;
  // Nearly along a facet what is seen changes by less: hills around hide it.
  Vec3d along_light(const Shot& shot) const {
    constexpr double least_cosine = 0.2;
    return shot.u / std::max(dot(shot.u, problems_.front().normal(shot.ray.from)), least_cosine);
  }
  Vec3d middle_of_rank(std::size_t rank) const {
    return plan_.elements().middle(plan_.element_at(rank));
  }

  std::span<const FluxProblem> problems_;
  const RayPlan& plan_;
  const View& earlier_;
};

void Viewer::view_by_lambert(std::size_t begin, std::size_t end, View& view) const {
  const Shooter shooter(problems_.front(), plan_, Shooter::Law::lambert);
  const std::vector<Shot> shots =
      shooter.shoot(begin, end, [this](std::size_t rank) { return seen(rank); });
  const std::vector<Flight> flights = shooter.fly(shots);
  const auto element_count = static_cast<std::uint32_t>(plan_.elements().count());
  const auto hit_of = [&](const Flight& flight) {
    switch (flight.end) {
      case Flight::End::front:
        return plan_.rank_at(flight.facet, flight.r);
      case Flight::End::back:
        return element_count + to_back;
      case Flight::End::below:
        return element_count + to_below;
      case Flight::End::side_limit:
        return element_count + to_side_limit;
      case Flight::End::sky:
        break;
    }
    return element_count + to_sky;
  };
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const auto& [rank, index, set, image] = shots[i].name;
    const float weight = shots[i].weight;
    const std::size_t ray = (plan_.first(rank) + index) * set_count + set;
    const std::uint32_t hit = hit_of(flights[i]);
    view.matrix.rays[ray] = {hit, weight};
    if (hit < element_count) view.places[ray] = Vec3f(flights[i].r - middle_of_rank(hit));
    if (flights[i].end != Flight::End::sky) continue;
    view.places[ray] = Vec3f(shots[i].ray.r - middle_of_rank(rank));
    const Vec3f per_cosine(along_light(shots[i]));
    view.skyward[rank] += weight * per_cosine;
    for (std::size_t p = 0; p < problems_.size(); ++p) {
      const float seen =
          weight * static_cast<float>(sky_weight(shots[i], flights[i], problems_[p]));
      view.direct[p][rank * set_count + set] += seen;
      view.direct_squares[p][rank] += seen * seen;
      view.light[p][rank] += seen * per_cosine;
    }
  }
}

void Viewer::view_by_lobe(std::size_t begin, std::size_t end, std::size_t problem,
                          View& view) const {
  const Shooter shooter(problems_[problem], plan_, Shooter::Law::lobe);
  const std::vector<Shot> shots =
      shooter.shoot(begin, end, [this](std::size_t rank) { return seen(rank); });
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

std::uint64_t Viewer::new_rays() const { return plan_.total() - earlier_.matrix.rays.size(); }

SetSums sums_of_sets(const ExchangeMatrix& matrix, std::size_t row) {
  SetSums sums{};
  const auto rays = matrix.row(row);
  for (std::size_t k = 0; k < rays.size(); ++k) {
    WeightSums& of_set = sums[k % set_count];
    (rays[k].hit == matrix.size() + to_sky ? of_set.sky : of_set.others) +=
        static_cast<double>(rays[k].weight);
  }
  for (WeightSums& of_set : sums)
    of_set.lacking = static_cast<double>(rays.size() / set_count) - of_set.sky - of_set.others;
  return sums;
}

// What a set tells is its sum, and what its weights lack of a whole times the mean over rays that
// did not reach the sky. Lacking is zero on average, and the mean is that of the other set, which
// is independent of it: so is their product, however few the rays. Where the other set has no such
// ray it is left out.
void scale_rows(ExchangeMatrix& matrix, std::vector<SetSums>& all_sums) {
  static_assert(set_count == 2);
  all_sums.resize(matrix.size());
  parallel_for(matrix.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SetSums& sums = all_sums[i] = sums_of_sets(matrix, i);
      for (std::size_t set = 0; set < set_count; ++set) {
        const double others = sums[set].others;
        const double lacking = others > 0 ? sums[1 - set].lacking / others : 0;
        matrix.scale[i][set] = (1 + lacking) / static_cast<double>(matrix.row(i).size());
      }
    }
  });
}

std::vector<Vec3f> moments_of(const View& view) {
  const ExchangeMatrix& matrix = view.matrix;
  const ExchangeRows& rows = view.rows;
  std::vector<Vec3f> moments(rows.seen.size());
  parallel_for(matrix.size(), 512, [&](std::size_t begin, std::size_t end) {
    std::vector<Vec3d> of_hit(matrix.size());
    for (std::size_t i = begin; i < end; ++i) {
      const auto rays = matrix.row(i);
      for (std::size_t k = 0; k < rays.size(); ++k) {
        if (rays[k].hit >= matrix.size()) continue;
        const double part = matrix.scale[i][k % set_count] * static_cast<double>(rays[k].weight);
        of_hit[rays[k].hit] += part * Vec3d(view.places[matrix.first[i] + k]);
      }
      for (std::uint64_t k = rows.first[i]; k < rows.first[i + 1]; ++k)
        moments[k] = Vec3f(std::exchange(of_hit[rows.seen[k].hit], Vec3d{}));
    }
  });
  return moments;
}

View Viewer::look() const {
  View view;
  const std::size_t size = plan_.size();
  ExchangeMatrix& matrix = view.matrix;
  matrix.scale.resize(size);
  matrix.first.resize(size + 1);
  for (std::size_t rank = 0; rank <= size; ++rank)
    matrix.first[rank] = plan_.first(rank) * set_count;
  matrix.rays.resize(plan_.total());
  view.places.resize(plan_.total());
  view.direct = earlier_.direct;
  view.direct.resize(problems_.size(), std::vector<float>(size * set_count));
  view.direct_squares = earlier_.direct_squares;
  view.direct_squares.resize(problems_.size(), std::vector<float>(size));
  view.skyward = earlier_.skyward;
  view.skyward.resize(size);
  view.light = earlier_.light;
  view.light.resize(problems_.size(), std::vector<Vec3f>(size));

  const std::size_t grain =
      std::max<std::size_t>(1, pool_size * size / std::max<std::uint64_t>(1, new_rays()));
  parallel_for(size, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t rank = begin; rank < end; ++rank) {
      const auto row =
          std::span(matrix.rays)
              .subspan(matrix.first[rank], matrix.first[rank + 1] - matrix.first[rank]);
      std::ranges::fill(row, ExchangeMatrix::Ray{static_cast<std::uint32_t>(rank), 0});
      if (seen(rank) == 0) continue;
      std::ranges::copy(earlier_.matrix.row(rank), row.begin());
      std::copy_n(&earlier_.places[earlier_.matrix.first[rank]], seen(rank) * set_count,
                  &view.places[matrix.first[rank]]);
    }
    view_by_lambert(begin, end, view);
    for (std::size_t p = 0; p < problems_.size(); ++p)
      if (is_looked_for(problems_[p])) view_by_lobe(begin, end, p, view);
  });
  scale_rows(matrix, view.sums);
  view.rows = ExchangeRows(matrix);
  view.moments = moments_of(view);
  view.flights = earlier_.flights + new_rays();
  for (const FluxProblem& problem : problems_)
    if (is_looked_for(problem)) view.flights += new_rays();
  return view;
}

}  // namespace

bool is_looked_for(const FluxProblem& problem) {
  return problem.has_source() && !problem.species.source.is_lambert();
}

std::uint64_t aim_at_sky(const FluxProblem& problem, RayPlan& plan) {
  const Shooter shooter(problem, plan, Shooter::Law::lambert);
  const std::span<const RayPlan::Window> windows = plan.windows();
  std::vector<char> is_deep(windows.size());
  parallel_for(windows.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<Shot> shots;
    for (std::size_t w = begin; w < end; ++w) shooter.scout(windows[w], shots);
    const std::vector<Flight> flights = shooter.fly(shots);
    auto flight = flights.begin();
    for (std::size_t w = begin; w < end; ++w) {
      const auto count = windows[w].back().end - windows[w].front().begin;
      const auto to_the_sky =
          std::ranges::count(flight, flight + count, Flight::End::sky, &Flight::end);
      is_deep[w] = static_cast<double>(to_the_sky) < little_sky * count;
      flight += count;
    }
  });
  for (std::size_t w = 0; w < windows.size(); ++w)
    if (is_deep[w] != 0) plan.aim_at_sky(windows[w]);
  return plan.size();
}

std::vector<Vec3d> change_with_normal(const View& view, std::size_t problem,
                                      std::span<const double> flux) {
  std::vector<Vec3d> change(flux.size());
  const std::vector<float>& direct = view.direct[problem];
  parallel_for(flux.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t rank = begin; rank < end; ++rank) {
      const auto rays = static_cast<double>(view.matrix.row(rank).size());
      double sky = 0;
      double from_source = 0;
      const SetSums& sums = view.sums[rank];
      for (std::size_t set = 0; set < set_count; ++set) {
        sky += sums[set].sky / rays;
        from_source += static_cast<double>(direct[rank * set_count + set]) / rays;
      }
      const double elsewhere = sky < 1 ? std::max(flux[rank] - from_source, 0.0) / (1 - sky) : 0;
      change[rank] =
          (Vec3d(view.light[problem][rank]) - elsewhere * Vec3d(view.skyward[rank])) / rays;
    }
  });
  return change;
}

View look(std::span<const FluxProblem> problems, const RayPlan& plan, const View& earlier) {
  return Viewer(problems, plan, earlier).look();
}

}  // namespace scarp
