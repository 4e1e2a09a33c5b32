#include "flux/rays/patches.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/disjoint_sets.h"
#include "core/parallel.h"
#include "flux/rays/spatial_order.h"

namespace scarp {

namespace {

constexpr double patch_width = 4;

// The connected part of the surface to which each facet belongs, numbered by their lowest vertices.
std::vector<std::uint32_t> parts_of_facets(const TriMesh& mesh, std::uint32_t& count) {
  DisjointSets vertices(mesh.vertices.size());
  for (const Triangle& t : mesh.triangles) {
    vertices.join(t[0], t[1]);
    vertices.join(t[0], t[2]);
  }
  std::vector<char> is_lowest(mesh.vertices.size());
  for (const Triangle& t : mesh.triangles) is_lowest[vertices.lowest(t[0])] = 1;
  std::vector<std::uint32_t> part_of(mesh.vertices.size());
  for (std::uint32_t v = 0; v < part_of.size(); ++v)
    if (is_lowest[v] != 0) part_of[v] = count++;
  std::vector<std::uint32_t> parts(mesh.triangles.size());
  for (std::size_t f = 0; f < parts.size(); ++f)
    parts[f] = part_of[vertices.lowest(mesh.triangles[f][0])];
  return parts;
}

// Of a patch with a main direction along an axis, in a domain that may be narrower than a cell.
double whole_area(Vec3d upper, int axis) {
  double area = patch_width * patch_width;
  for (int side = 0; side < 2; ++side)
    if (side != axis) area *= std::min(1.0, upper[side] / patch_width);
  return area;
}

// What arrives on a ring is one number, whose error is less than that of each facet.
void take_rings_together(const RayScene& scene, const Patches& patches, const Patches::Patch& patch,
                         const FluxSpread& spread, Tally& tally) {
  const std::span<const std::uint32_t> rings = patches.rings();
  std::vector<double> sums(spread.count);
  std::vector<double> of_facet(spread.count);
  std::size_t end = 0;
  for (std::size_t first = 0; first < patch.facets.size(); first = end) {
    std::ranges::fill(sums, 0.0);
    double area = 0;
    double arrives = 0;
    for (; end < patch.facets.size() && rings[patch.facets[end]] == rings[patch.facets[first]];
         ++end) {
      const std::uint32_t f = patch.facets[end];
      spread.deviations(f, of_facet);
      for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += of_facet[k] * scene.area(f);
      area += scene.area(f);
      arrives += spread.flux(f) * scene.area(f);
    }
    double squares = 0;
    for (const double sum : sums) squares += sum * sum;
    const double error = arrives > 0 ? std::sqrt(squares / spread.divisor) : spread.unseen;
    for (std::size_t k = first; k < end; ++k) {
      tally.mean[patch.facets[k]] = static_cast<float>(arrives / area);
      tally.std_error[patch.facets[k]] = static_cast<float>(error / area);
    }
  }
}

// In lanes, which need not wait for each other.
double sum_of_squares(std::span<const double> numbers) {
  constexpr std::size_t lane_count = 8;
  std::array<double, lane_count> lanes{};
  std::size_t k = 0;
  for (; k + lane_count <= numbers.size(); k += lane_count)
    for (std::size_t lane = 0; lane < lane_count; ++lane)
      lanes[lane] += numbers[k + lane] * numbers[k + lane];
  double sum = 0;
  for (; k < numbers.size(); ++k) sum += numbers[k] * numbers[k];
  for (const double lane : lanes) sum += lane;
  return sum;
}

Tally tally_of(const RayScene& scene, const Patches& patches, const FluxSpread& spread) {
  Tally tally;
  tally.mean.resize(scene.facet_count());
  tally.std_error.resize(scene.facet_count());
  tally.patch_mean.resize(patches.list().size());
  tally.patch_std_error.resize(patches.list().size());
  parallel_for(patches.list().size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<double> sums(spread.count);
    std::vector<double> of_facet(spread.count);
    for (std::size_t p = begin; p < end; ++p) {
      const Patches::Patch& patch = patches.list()[p];
      std::fill(sums.begin(), sums.end(), 0.0);
      double mean = 0;
      for (const std::uint32_t f : patch.facets) {
        const double flux = spread.flux(f);
        spread.deviations(f, of_facet);
        const double area = scene.area(f);
        for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += of_facet[k] * area;
        const double squares = sum_of_squares(of_facet);
        mean += flux * area / patch.area;
        tally.mean[f] = static_cast<float>(flux);
        tally.std_error[f] = static_cast<float>(flux > 0 ? std::sqrt(squares / spread.divisor)
                                                         : spread.unseen / area);
      }
      double squares = 0;
      for (const double sum : sums) squares += sum * sum;
      const double std_error = mean > 0 ? std::sqrt(squares / spread.divisor) : spread.unseen;
      tally.patch_mean[p] = static_cast<float>(mean);
      tally.patch_std_error[p] = static_cast<float>(std_error / patch.area);
      if (!patches.rings().empty()) take_rings_together(scene, patches, patch, spread, tally);
    }
  });
  return tally;
}

// What is unknown of facets on which nothing arrived is no more than what arrives around them.
void bound_unseen(const Patches& patches, Tally& tally) {
  if (std::ranges::none_of(tally.mean, [](float flux) { return flux == 0; })) return;
  const TriMesh& mesh = patches.mesh();
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<std::uint32_t> largest(mesh.vertices.size(), none);
  const auto area = [&](std::uint32_t p) { return p == none ? 0 : patches.list()[p].area; };
  for (std::uint32_t p = 0; p < patches.list().size(); ++p)
    for (const std::uint32_t f : patches.list()[p].facets)
      for (const std::uint32_t v : mesh.triangles[f])
        if (area(p) > area(largest[v])) largest[v] = p;
  for (std::size_t f = 0; f < tally.mean.size(); ++f) {
    if (tally.mean[f] > 0) continue;
    const Triangle& t = mesh.triangles[f];
    const std::uint32_t v = *std::ranges::max_element(
        t, [&](std::uint32_t a, std::uint32_t b) { return area(largest[a]) < area(largest[b]); });
    const std::uint32_t p = largest[v];
    const double mean = tally.patch_mean[p];
    const double error = tally.patch_std_error[p];
    const double most = std::sqrt(mean * mean + error * error);
    tally.std_error[f] = std::min(tally.std_error[f], static_cast<float>(most));
  }
}

}  // namespace

Patches::Patches(const TriMesh& mesh, const RayScene& scene, std::span<const std::uint32_t> rings)
    : mesh_(mesh), rings_(rings.begin(), rings.end()) {
  const std::vector<std::uint32_t> parts = parts_of_facets(mesh, part_count_);
  const SceneCells cells(scene, patch_width);
  std::vector<std::uint64_t> keys(scene.facet_count());
  std::uint32_t first = 0;  // of a ring, whose facets follow each other
  for (std::uint32_t f = 0; f < keys.size(); ++f) {
    if (rings.empty() || rings[f] != rings[first]) first = f;
    const auto& [a, b, c] = scene.corners(first);
    const Vec3d centroid = (Vec3d(a) + Vec3d(b) + Vec3d(c)) / 3.0;
    keys[f] = parts[f] * cells.count() + cells.key(centroid, main_direction(scene.normal(first)));
  }
  const std::vector<std::uint32_t> order = sorted_order(keys);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::uint32_t f = order[k];
    if (k == 0 || keys[f] != keys[order[k - 1]]) {
      const double whole = whole_area(scene.upper(), SceneCells::direction(keys[f]) / 2);
      patches_.push_back({.part = parts[f], .area = 0, .whole = whole, .facets = {}});
    }
    patches_.back().facets.push_back(f);
    patches_.back().area += scene.area(f);
  }
}

FluxEstimate estimate(const RayScene& scene, const Patches& patches, const FluxSpread& spread) {
  FluxEstimate result{.tally = tally_of(scene, patches, spread)};
  Tally& tally = result.tally;
  bound_unseen(patches, tally);
  std::vector<char> exposed(patches.part_count());
  for (std::size_t p = 0; p < tally.patch_mean.size(); ++p)
    if (tally.patch_mean[p] > 0) exposed[patches.list()[p].part] = 1;

  double area = 0;
  double squares = 0;
  for (std::size_t p = 0; p < tally.patch_mean.size(); ++p) {
    const Patches::Patch& patch = patches.list()[p];
    if (exposed[patch.part] == 0) {
      for (const std::uint32_t f : patch.facets) tally.std_error[f] = 0;
      tally.patch_std_error[p] = 0;
      continue;
    }
    const double relative =
        tally.patch_std_error[p] / std::max<double>(tally.patch_mean[p], small_flux);
    area += patch.area;
    squares += patch.area * relative * relative * std::min(1.0, patch.area / patch.whole);
    for (const std::uint32_t f : patch.facets) {
      const double flux = std::max<double>(tally.mean[f], small_flux);
      result.max_facet_error = std::max(result.max_facet_error, tally.std_error[f] / flux);
    }
  }
  result.error = area > 0 ? std::sqrt(squares / area) : 0;
  return result;
}

FluxSpread sum_of_responses(std::vector<FluxSpread> spreads,
                            std::span<const std::vector<float>> responses) {
  const std::size_t count = spreads.front().count;
  const double divisor = spreads.front().divisor;
  const auto for_each = [responses, spreads = std::move(spreads)](std::size_t f, const auto& use) {
    for (std::size_t t = 0; t < spreads.size(); ++t) {
      const double response = static_cast<double>(responses[t][f]);
      if (response != 0) use(spreads[t], response);
    }
  };
  return {.flux =
              [for_each](std::size_t f) {
                double sum = 0;
                for_each(f, [&](const FluxSpread& spread, double response) {
                  sum += response * spread.flux(f);
                });
                return sum;
              },
          .deviations =
              [for_each](std::size_t f, std::span<double> of_facet) {
                std::ranges::fill(of_facet, 0.0);
                std::vector<double> of_spread(of_facet.size());
                for_each(f, [&](const FluxSpread& spread, double response) {
                  spread.deviations(f, of_spread);
                  for (std::size_t k = 0; k < of_facet.size(); ++k)
                    of_facet[k] += response * of_spread[k];
                });
              },
          .count = count,
          .divisor = divisor};
}

double response_error(const RayScene& scene, const Patches& patches,
                      std::span<const FluxSpread> spreads,
                      std::span<const std::vector<float>> responses, const FluxSpread& sum) {
  struct OfPatch {
    double squares = 0;
    bool is_exposed = false;
  };
  std::vector<OfPatch> of_patch(patches.list().size());
  parallel_for(of_patch.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<double> sums(sum.count);
    std::vector<double> of_facet(sum.count);
    for (std::size_t p = begin; p < end; ++p) {
      const Patches::Patch& patch = patches.list()[p];
      std::fill(sums.begin(), sums.end(), 0.0);
      double unseen = 0;
      for (const std::uint32_t f : patch.facets) {
        if (spreads.front().flux(f) > 0) of_patch[p].is_exposed = true;
        for (std::size_t t = 0; t < spreads.size(); ++t)
          unseen =
              std::max(unseen, std::abs(static_cast<double>(responses[t][f])) * spreads[t].unseen);
        sum.deviations(f, of_facet);
        for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += scene.area(f) * of_facet[k];
      }
      double squares = 0;
      for (const double each : sums) squares += each * each;
      const double variance = of_patch[p].is_exposed ? squares / sum.divisor : unseen * unseen;
      of_patch[p].squares = variance / (patch.area * patch.area);
    }
  });
  std::vector<char> exposed(patches.part_count());
  for (std::size_t p = 0; p < of_patch.size(); ++p)
    if (of_patch[p].is_exposed) exposed[patches.list()[p].part] = 1;
  double area = 0;
  double squares = 0;
  for (std::size_t p = 0; p < of_patch.size(); ++p) {
    const Patches::Patch& patch = patches.list()[p];
    if (exposed[patch.part] == 0) continue;
    area += patch.area;
    squares += patch.area * of_patch[p].squares * std::min(1.0, patch.area / patch.whole);
  }
  return area > 0 ? std::sqrt(squares / area) : 0;
}

}  // namespace scarp
