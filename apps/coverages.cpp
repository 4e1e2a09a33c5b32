#include "apps/coverages.h"

#include <cmath>

#include "core/parallel.h"
#include "core/triangle_tree.h"

namespace scarp {

std::vector<std::vector<float>> carried(const SurfaceCoverages& coverages, const TriMesh& facets) {
  const TriangleTree tree(coverages.facets);
  std::vector<std::vector<float>> values(coverages.values.size(),
                                         std::vector<float>(facets.triangles.size()));
  parallel_for(facets.triangles.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto& [a, b, c] = facets.triangles[f];
      const Vec3d middle =
          (Vec3d(facets.vertices[a]) + Vec3d(facets.vertices[b]) + Vec3d(facets.vertices[c])) / 3.0;
      const std::uint32_t old = tree.closest(middle).triangle;
      for (std::size_t k = 0; k < values.size(); ++k) values[k][f] = coverages.values[k][old];
    }
  });
  return values;
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

std::vector<bool> species_by_coverage(const SurfaceModel& model, const SurfacePoints& points) {
  const SurfacePoints point{.material = points.material.first(1), .normal = points.normal.first(1)};
  const std::vector<std::vector<float>> bare(model.coverages().size(), {0.0F});
  std::vector<bool> species;
  for (const std::vector<float>& sticking : model.covered_sticking(point, bare))
    species.push_back(!sticking.empty());
  return species;
}

void set_covered_sticking(const SurfaceModel& model, const SurfacePoints& points,
                          std::span<const std::vector<float>> coverages,
                          std::vector<std::vector<float>>& sticking) {
  // Copied, not moved: the flux refers to these numbers where they are.
  const std::vector<std::vector<float>> covered = model.covered_sticking(points, coverages);
  for (std::size_t species = 0; species < covered.size(); ++species)
    if (!covered[species].empty()) sticking[species] = covered[species];
}

CoverageIteration::CoverageIteration(const SurfaceModel& model, const TriMesh& facets,
                                     const SurfaceCoverages& start, const CoverageOptions& options)
    : model_(model), facets_(facets), options_(options), normals_(facet_normals(facets)) {
  has_start_ = start.names == model.coverages();
  if (has_start_) coverages_ = carried(start, facets);
}

StickingFeedback CoverageIteration::feedback() {
  StickingFeedback feedback;
  feedback.species =
      species_by_coverage(model_, {.material = facets_.materials, .normal = normals_});
  feedback.update = [this](auto flux, auto& sticking) { return update(flux, sticking); };
  return feedback;
}

bool CoverageIteration::update(std::span<const std::span<const float>> flux,
                               std::vector<std::vector<float>>& sticking) {
  const SurfacePoints points{.material = facets_.materials, .normal = normals_};
  const bool keeps_start = !has_begun_ && has_start_;
  if (!keeps_start) {
    std::vector<std::vector<float>> next = model_.steady_coverages(points, flux);
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
  set_covered_sticking(model_, points, coverages_, sticking);
  return true;
}

}  // namespace scarp
