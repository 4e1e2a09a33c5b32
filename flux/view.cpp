#include "flux/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/parallel.h"
#include "core/random.h"
#include "flux/portable_math.h"
#include "flux/sampling.h"
#include "flux/sobol.h"
#include "flux/spatial_order.h"

namespace scarp {

namespace {

constexpr std::size_t pool_size = std::size_t{1} << 16;  // rays
constexpr std::uint32_t most_in_set = 1U << 16;

// The part of the direct flux that a ray to the sky along u stands for. For n = 1 rays by
// Lambert's law all count the same; otherwise they share the work with rays along the lobe.
double sky_weight(Vec3d u, Vec3d n, double power) {
  if (power == 1) return 1;
  const double cosine = dot(u, n);
  if (cosine <= 0 || u.z <= 0) return 0;
  const double radiance = (power + 1) / (2 * std::numbers::pi) * portable_power(u.z, power - 1);
  return radiance * cosine / (cosine / std::numbers::pi + radiance * u.z);
}

class Viewer {
 public:
  Viewer(std::span<const FluxProblem> problems, const RayPlan& plan, const View& earlier)
      : problems_(problems),
        scene_(problems.front().scene),
        options_(problems.front().options),
        plan_(plan),
        earlier_(earlier) {}

  View look() const;

 private:
  // A ray from a facet, with its direction before projection to a cross-section.
  struct Shot {
    Ray ray;
    Vec3d u;
    std::uint32_t rank = 0;
    std::uint32_t index = 0;  // in its set
    std::uint32_t set = 0;
  };

  void shoot(std::size_t rank, const FluxProblem* lobe, std::vector<Shot>& shots) const;
  std::vector<Shot> shoot_all(std::size_t begin, std::size_t end, const FluxProblem* lobe) const;
  std::vector<Flight> fly(const std::vector<Shot>& shots) const;
  void view_by_lambert(std::size_t begin, std::size_t end, View& view) const;
  void view_by_lobe(std::size_t begin, std::size_t end, std::size_t problem, View& view) const;
  Vec3d normal(std::size_t rank) const;
  std::uint32_t seen(std::size_t rank) const;
  std::uint64_t new_rays() const;

  std::span<const FluxProblem> problems_;
  const RayScene& scene_;
  const FluxOptions& options_;
  const RayPlan& plan_;
  const View& earlier_;
};

Vec3d Viewer::normal(std::size_t rank) const {
  const Vec3d n = scene_.normal(plan_.elements().facet_of(plan_.element_at(rank)));
  return options_.two_dimensional ? project_to_cross_section(n) : n;
}

void Viewer::shoot(std::size_t rank, const FluxProblem* lobe, std::vector<Shot>& shots) const {
  const std::uint32_t element = plan_.element_at(rank);
  const auto& [a, b, c] = plan_.elements().corners(element);
  const Vec3d n = normal(rank);
  // Hemisphere rays serve all species, lobe rays their own.
  const std::uint32_t user = lobe == nullptr ? 0xFFFFFFFFU : ~lobe->species_index - 1;
  RandomStream random({options_.seed, options_.time_step, user, element});
  std::vector<ScrambledSobol> sets;
  for (std::size_t set = 0; set < set_count; ++set)
    sets.emplace_back(std::array{random.bits(), random.bits(), random.bits(), random.bits()});
  for (std::uint32_t ray = seen(rank); ray < plan_.rays(rank); ++ray) {
    for (std::uint32_t set = 0; set < set_count; ++set) {
      const auto xi = sets[set].point(ray);
      const Vec3d weights = sample_triangle({xi[2], xi[3]});
      const Vec3d u = lobe == nullptr
                          ? sample_cosine({xi[0], xi[1]}, n)
                          : -sample_source({xi[0], xi[1]}, lobe->species.source.cosine_power);
      shots.push_back({.ray = {.r = weights.x * a + weights.y * b + weights.z * c,
                               .u = options_.two_dimensional ? project_to_cross_section(u) : u,
                               .from = plan_.elements().facet_of(element)},
                       .u = u,
                       .rank = static_cast<std::uint32_t>(rank),
                       .index = ray,
                       .set = set});
    }
  }
}

std::vector<Viewer::Shot> Viewer::shoot_all(std::size_t begin, std::size_t end,
                                            const FluxProblem* lobe) const {
  std::vector<Shot> shots;
  for (std::size_t rank = begin; rank < end; ++rank) shoot(rank, lobe, shots);
  return shots;
}

std::vector<Flight> Viewer::fly(const std::vector<Shot>& shots) const {
  const auto order =
      flight_order(scene_, shots.size(), [&](std::size_t i) -> const Ray& { return shots[i].ray; });
  std::vector<Ray> rays(shots.size());
  for (std::size_t k = 0; k < rays.size(); ++k) rays[k] = shots[order[k]].ray;
  std::vector<Flight> sorted(shots.size());
  scene_.fly(rays, sorted);
  std::vector<Flight> flights(shots.size());
  for (std::size_t k = 0; k < rays.size(); ++k) flights[order[k]] = sorted[k];
  return flights;
}

void Viewer::view_by_lambert(std::size_t begin, std::size_t end, View& view) const {
  const std::vector<Shot> shots = shoot_all(begin, end, nullptr);
  const std::vector<Flight> flights = fly(shots);
  const auto element_count = static_cast<std::uint32_t>(plan_.elements().count());
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const auto& [ray, u, rank, index, set] = shots[i];
    std::uint32_t& hit = view.matrix.hits[(plan_.first(rank) + index) * set_count + set];
    switch (flights[i].end) {
      case Flight::End::front:
        hit = plan_.rank_of(plan_.elements().at(flights[i].facet, flights[i].r));
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
          const double weight =
              sky_weight(u, normal(rank), problems_[p].species.source.cosine_power);
          view.direct[p][rank * set_count + set] += static_cast<float>(weight);
        }
    }
  }
}

void Viewer::view_by_lobe(std::size_t begin, std::size_t end, std::size_t problem,
                          View& view) const {
  std::vector<Shot> shots = shoot_all(begin, end, &problems_[problem]);
  std::erase_if(shots, [&](const Shot& shot) { return dot(shot.u, normal(shot.rank)) <= 0; });
  const std::vector<Flight> flights = fly(shots);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (flights[i].end != Flight::End::sky) continue;
    const auto& [ray, u, rank, index, set] = shots[i];
    const double weight =
        sky_weight(u, normal(rank), problems_[problem].species.source.cosine_power);
    view.direct[problem][rank * set_count + set] += static_cast<float>(weight);
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
      if (problems_[p].species.source.cosine_power != 1) view_by_lobe(begin, end, p, view);
  });
  view.flights = earlier_.flights + new_rays();
  for (const FluxProblem& problem : problems_)
    if (problem.species.source.cosine_power != 1) view.flights += new_rays();
  return view;
}

}  // namespace

RayPlan::RayPlan(const RayScene& scene, const Elements& elements) : elements_(&elements) {
  std::vector<std::uint64_t> keys(elements.count());
  const Vec3d size{scene.upper().x, scene.upper().y, scene.source_height() - scene.lowest()};
  const double largest = std::max({size.x, size.y, size.z});
  for (std::size_t e = 0; e < keys.size(); ++e) {
    const auto& [a, b, c] = elements.corners(e);
    const Vec3d r = (a + b + c) / 3.0;
    keys[e] = curve_key({r.x / largest, r.y / largest, (r.z - scene.lowest()) / largest},
                        main_direction(scene.normal(elements.facet_of(e))));
  }
  element_at_.resize(keys.size());
  std::iota(element_at_.begin(), element_at_.end(), 0U);
  std::sort(element_at_.begin(), element_at_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return keys[a] != keys[b] ? keys[a] < keys[b] : a < b;
  });
  rank_of_.resize(keys.size());
  for (std::uint32_t rank = 0; rank < keys.size(); ++rank) rank_of_[element_at_[rank]] = rank;
  rays_.resize(keys.size());
  first_.resize(keys.size() + 1);
}

// Of elements in a row a fraction takes the next power of two; the fractions are spread evenly by
// the rank's bits in reverse.
std::vector<std::uint32_t> RayPlan::wanted(double rays_per_area) const {
  std::vector<std::uint32_t> wanted(size());
  for (std::uint32_t rank = 0; rank < wanted.size(); ++rank) {
    const double share = rays_per_area * elements_->area(element_at_[rank]) / set_count;
    std::uint32_t rays = least_set;
    while (rays < most_in_set && 2 * rays <= share) rays *= 2;
    const double threshold = reverse_bits(rank) * 0x1.0p-32;
    if (share / rays - 1 > threshold) rays *= 2;
    wanted[rank] = std::max(rays, rays_[rank]);
  }
  return wanted;
}

void RayPlan::grow(double rays_per_area, std::uint64_t cap) {
  cap = std::max({cap, total(), std::uint64_t{size() * set_count * least_set}});
  std::vector<std::uint32_t> rays = wanted(rays_per_area);
  while (std::accumulate(rays.begin(), rays.end(), std::uint64_t{0}) * set_count > cap) {
    rays_per_area *= 0.95;
    rays = wanted(rays_per_area);
  }
  rays_ = std::move(rays);
  for (std::size_t rank = 0; rank < size(); ++rank) first_[rank + 1] = first_[rank] + rays_[rank];
}

View look(std::span<const FluxProblem> problems, const RayPlan& plan, const View& earlier) {
  return Viewer(problems, plan, earlier).look();
}

}  // namespace scarp
