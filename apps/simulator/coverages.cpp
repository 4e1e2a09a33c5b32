#include "apps/simulator/coverages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "core/parallel.h"
#include "core/triangle_tree.h"

namespace scarp {

namespace {

// Of four pieces alike.
constexpr std::size_t samples_per_facet = 4;

// The middles of a facet's pieces between its corners and the middles of its edges.
std::array<Vec3d, samples_per_facet> samples(const TriMesh& mesh, std::size_t f) {
  const auto [a, b, c] = corners(mesh, f);
  const Vec3d middle = (a + b + c) / 3.0;
  return {middle, (middle + a) / 2.0, (middle + b) / 2.0, (middle + c) / 2.0};
}

// For every sample of a mesh the closest facet of another one.
std::vector<std::uint32_t> closest_facets(const TriMesh& mesh, const TriMesh& other,
                                          const TriangleTree& tree, double reach) {
  std::vector<std::uint32_t> closest(samples_per_facet * mesh.triangles.size());
  parallel_for(mesh.triangles.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      std::size_t k = f * samples_per_facet;
      const std::array places = samples(mesh, f);
      const std::uint32_t of_middle = tree.closest(places.front(), reach).triangle;
      closest[k++] = of_middle;
      for (const Vec3d& r : std::span(places).subspan(1)) {
        // No further away, but for rounding, than what is closest to the middle: found sooner
        // within that.
        double within = reach;
        if (of_middle != ClosestPoint::none) {
          const double of_same = closest_on_triangle(r, corners(other, of_middle)).distance;
          within = std::min(reach, of_same + 1e-9 * reach);
        }
        closest[k++] = tree.closest(r, within).triangle;
      }
    }
  });
  return closest;
}

// The area of each facet, of those of its pieces that are found: is_found(number, place of sample).
template <class Found>
std::vector<double> found_areas(const TriMesh& mesh, std::vector<double> areas,
                                const Found& is_found) {
  parallel_for(areas.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      std::size_t k = f * samples_per_facet;
      int missed = 0;
      for (const Vec3d& r : samples(mesh, f)) missed += is_found(k++, r) ? 0 : 1;
      areas[f] *= 1 - static_cast<double>(missed) / samples_per_facet;
    }
  });
  return areas;
}

double integral(std::span<const double> areas, std::span<const float> values) {
  double sum = 0;
  for (std::size_t f = 0; f < areas.size(); ++f) sum += areas[f] * static_cast<double>(values[f]);
  return sum;
}

// Coverages on facets whose integrals are brought to what they have to be.
class Balance {
 public:
  // Shape: kept is the part of each facet that may be covered, in [0, 1].
  Balance(std::vector<std::vector<float>>& values, std::span<const double> areas,
          std::vector<float> kept)
      : values_(values), areas_(areas), bare_(std::move(kept)) {
    for (const std::vector<float>& each : values_) take_away(each);
  }

  // The integrals together must not be more than what may be covered.
  void bring_to(std::span<const double> integrals) {
    // What is too much makes the room for what is too little.
    for (std::size_t k = 0; k < values_.size(); ++k) lower(values_[k], integrals[k]);
    for (std::size_t k = 0; k < values_.size(); ++k) raise(values_[k], integrals[k]);
  }

 private:
  void take_away(const std::vector<float>& values) {
    for (std::size_t f = 0; f < bare_.size(); ++f) bare_[f] = std::max(0.0F, bare_[f] - values[f]);
  }

  void lower(std::vector<float>& values, double wanted) {
    const double there = integral(areas_, values);
    if (there <= wanted) return;
    for (std::size_t f = 0; f < values.size(); ++f) {
      const auto less = static_cast<float>(values[f] * (wanted / there));
      bare_[f] += values[f] - less;
      values[f] = less;
    }
  }

  void raise(std::vector<float>& values, double wanted) {
    const double missing = wanted - integral(areas_, values);
    const double room = integral(areas_, bare_);
    if (missing <= 0 || room <= 0) return;
    const double part = std::min(1.0, missing / room);
    for (std::size_t f = 0; f < values.size(); ++f) {
      const auto more = static_cast<float>(part * static_cast<double>(bare_[f]));
      values[f] += more;
      bare_[f] = std::max(0.0F, bare_[f] - more);
    }
  }

  std::vector<std::vector<float>>& values_;
  std::span<const double> areas_;
  std::vector<float> bare_;
};

// The mean over the samples of each facet, 0 for those that found nothing.
std::vector<float> means(std::span<const float> old, std::span<const std::uint32_t> closest) {
  std::vector<float> values(closest.size() / samples_per_facet);
  for (std::size_t k = 0; k < closest.size(); ++k)
    if (closest[k] != ClosestPoint::none)
      values[k / samples_per_facet] += old[closest[k]] / samples_per_facet;
  return values;
}

}  // namespace

std::vector<std::vector<float>> carried(std::span<const std::vector<float>> coverages,
                                        const TriMesh& from, const TriMesh& to, double reach,
                                        const Frame& frame) {
  const std::vector<std::uint32_t> closest = closest_facets(to, from, TriangleTree(from), reach);
  const TriangleTree tree(to);
  const std::vector<double> old_areas =
      found_areas(from, areas_around(from, frame),
                  [&](std::size_t, const Vec3d& r) { return tree.is_within(r, reach); });
  const std::vector<double> areas = areas_around(to, frame);
  const std::vector<double> new_areas = found_areas(
      to, areas, [&](std::size_t k, const Vec3d&) { return closest[k] != ClosestPoint::none; });
  std::vector<float> kept;
  for (std::size_t f = 0; f < areas.size(); ++f)
    kept.push_back(static_cast<float>(new_areas[f] / areas[f]));

  const double growth = std::accumulate(new_areas.begin(), new_areas.end(), 0.0) /
                        std::accumulate(old_areas.begin(), old_areas.end(), 0.0);
  std::vector<std::vector<float>> values;
  std::vector<double> integrals;
  for (const std::vector<float>& old : coverages) {
    values.push_back(means(old, closest));
    integrals.push_back(growth * integral(old_areas, old));
  }
  if (std::isfinite(growth)) Balance(values, areas, std::move(kept)).bring_to(integrals);
  return values;
}

std::vector<double> covered_areas(std::span<const double> areas,
                                  std::span<const std::vector<float>> coverages) {
  std::vector<double> covered;
  for (const std::vector<float>& each : coverages) covered.push_back(integral(areas, each));
  return covered;
}

CoverageChange largest_change(std::span<const std::vector<float>> before,
                              std::span<const std::vector<float>> after) {
  CoverageChange largest;
  for (std::size_t k = 0; k < after.size(); ++k) {
    for (std::size_t f = 0; f < after[k].size(); ++f) {
      const double change = std::abs(static_cast<double>(after[k][f]) - before[k][f]);
      if (change > largest.size) largest = {change, static_cast<std::uint32_t>(f)};
    }
  }
  return largest;
}

std::vector<bool> species_by_coverage(const Coverages& model, const SurfacePoints& points) {
  const SurfacePoints point{.material = points.material.first(1), .normal = points.normal.first(1)};
  const std::vector<std::vector<float>> bare(model.coverage_names().size(), {0.0F});
  std::vector<bool> species;
  for (const std::vector<float>& sticking : model.covered_sticking(point, bare))
    species.push_back(!sticking.empty());
  return species;
}

void set_covered_sticking(const Coverages& model, const SurfacePoints& points,
                          std::span<const std::vector<float>> coverages,
                          std::vector<std::vector<float>>& sticking) {
  // Copied, not moved: the flux refers to these numbers where they are.
  const std::vector<std::vector<float>> covered = model.covered_sticking(points, coverages);
  for (std::size_t species = 0; species < covered.size(); ++species)
    if (!covered[species].empty()) sticking[species] = covered[species];
}

CoverageIteration::CoverageIteration(const BalancedCoverages& model, const TriMesh& facets,
                                     std::vector<std::vector<float>> start,
                                     const CoverageOptions& options)
    : model_(model),
      facets_(facets),
      options_(options),
      normals_(facet_normals(facets)),
      coverages_(std::move(start)) {}

// No coverage changes by more than a relative change of the flux.
double flux_tolerance(const CoverageOptions& options) { return 0.1 * options.tolerance; }

StickingFeedback CoverageIteration::feedback() {
  StickingFeedback feedback;
  feedback.species = species_by_coverage(model_, points());
  feedback.update = [this](auto flux, auto& sticking) { return update(flux, sticking); };
  feedback.sticking_at = [this](auto flux) { return sticking_at(flux); };
  feedback.tolerance = flux_tolerance(options_);
  return feedback;
}

bool CoverageIteration::update(std::span<const std::span<const float>> flux,
                               std::vector<std::vector<float>>& sticking) {
  const bool keeps_start = !has_begun_ && !coverages_.empty();
  if (!keeps_start) {
    std::vector<std::vector<float>> next = model_.steady_coverages(points(), flux);
    if (has_begun_) {
      ++fit_.iterations;
      ++iterations_of_round_;
      const CoverageChange change = largest_change(coverages_, next);
      fit_.change = change.size;
      fit_.facet = change.facet;
    }
    coverages_ = std::move(next);
  }
  if (has_begun_) {
    fit_.reached = fit_.change <= options_.tolerance;
    if (fit_.reached || iterations_of_round_ >= options_.most_iterations) {
      iterations_of_round_ = 0;
      return false;
    }
  }
  has_begun_ = true;
  set_covered_sticking(model_, points(), coverages_, sticking);
  return true;
}

std::vector<std::vector<float>> CoverageIteration::sticking_at(
    std::span<const std::span<const float>> flux) const {
  return model_.covered_sticking(points(), model_.steady_coverages(points(), flux));
}

}  // namespace scarp
