#include "mesh/simplify/regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "core/parallel.h"

namespace scarp {

Regions::Regions(const std::vector<bool>& is_feature, std::vector<float> size_limit, Sizes sizes)
    : sizes_(sizes),
      region_(is_feature.size()),
      size_{sizes.l0},
      size_limit_(std::move(size_limit)) {
  for (std::size_t v = 0; v < region_.size(); ++v) region_[v] = is_feature[v] ? 0 : outside;
}

std::vector<float> Regions::sizes() const {
  std::vector<float> sizes(region_.size());
  for (std::size_t v = 0; v < sizes.size(); ++v) {
    sizes[v] = static_cast<float>(region_[v] == outside ? size_.back() : size_[region_[v]]);
    if (!size_limit_.empty()) sizes[v] = std::min(sizes[v], size_limit_[v]);
  }
  return sizes;
}

void Regions::merge(std::span<const std::uint32_t> merged_into) {
  for (std::uint32_t v = 0; v < merged_into.size(); ++v) {
    if (merged_into[v] == v) continue;
    std::uint32_t last = merged_into[v];
    while (merged_into[last] != last) last = merged_into[last];
    region_[last] = std::min(region_[last], region_[v]);
    if (!size_limit_.empty()) size_limit_[last] = std::min(size_limit_[last], size_limit_[v]);
  }
}

bool Regions::coarsen() {
  double next = size_.back() + sizes_.step_length;
  if (sizes_.l_max > 0) next = std::min(next, sizes_.l_max);
  if (!(next > size_.back()) || size_.size() + 1 >= outside) return false;
  size_.push_back(next);
  return true;
}

bool Regions::enclose_ring(const CollapseMesh& mesh) {
  std::vector<std::uint32_t> ring;
  for (std::uint32_t v = 0; v < region_.size(); ++v) {
    if (mesh.topology.outgoing(v) == HalfEdges::none || region_[v] != outside) continue;
    bool touches = false;
    mesh.topology.for_each_neighbour(
        v, [&](std::uint32_t w) { touches = touches || region_[w] != outside; });
    if (touches) ring.push_back(v);
  }
  for (const std::uint32_t v : ring) region_[v] = static_cast<std::uint16_t>(size_.size() - 1);
  return !ring.empty();
}

void Regions::release_rest() {
  size_.push_back(sizes_.l_max > 0 ? sizes_.l_max : std::numeric_limits<double>::infinity());
}

void Regions::raise(double l0) {
  for (double& size : size_) size = std::max(size, l0);
}

std::vector<bool> find_features(std::span<const double> curvature, double threshold,
                                std::size_t most) {
  std::vector<double> modulus(curvature.size());
  for (std::size_t v = 0; v < modulus.size(); ++v) modulus[v] = std::abs(curvature[v]);
  std::vector<bool> is_feature(modulus.size());
  const auto count = static_cast<std::size_t>(std::count_if(
      modulus.begin(), modulus.end(), [threshold](double kappa) { return kappa > threshold; }));
  if (count > most) {
    std::vector<double> sorted = modulus;
    const auto place = sorted.begin() + static_cast<std::ptrdiff_t>(most);
    std::nth_element(sorted.begin(), place, sorted.end(), std::greater<>());
    threshold = *place;
  }
  for (std::size_t v = 0; v < modulus.size(); ++v) is_feature[v] = modulus[v] > threshold;
  return is_feature;
}

double mean_feature_edge(const CollapseMesh& mesh, const std::vector<bool>& is_feature) {
  /// Of all edges, and of those between features.
  struct Lengths {
    std::array<double, 2> sum{};
    std::array<std::size_t, 2> count{};
  };
  constexpr std::size_t grain = 8192;
  const std::uint32_t stride = mesh.stride_of_sample();
  const auto of_range = [&](std::size_t begin, std::size_t end) {
    Lengths lengths;
    for (auto f = static_cast<std::uint32_t>(begin); f < end; f += stride) {
      if (!mesh.topology.alive(f)) continue;
      for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
        if (!mesh.topology.is_edge(h)) continue;
        const bool inside =
            is_feature[mesh.topology.origin(h)] && is_feature[mesh.topology.target(h)];
        const double length = std::sqrt(mesh.squared_length(h));
        for (std::size_t i = 0; i <= (inside ? 1 : 0); ++i) {
          lengths.sum[i] += length;
          ++lengths.count[i];
        }
      }
    }
    return lengths;
  };
  const Lengths lengths = parallel_reduce(mesh.normals.size(), grain, Lengths{}, of_range,
                                          [](Lengths all, const Lengths& part) {
                                            for (std::size_t i = 0; i < 2; ++i) {
                                              all.sum[i] += part.sum[i];
                                              all.count[i] += part.count[i];
                                            }
                                            return all;
                                          });
  const int chosen = lengths.count[1] > 0 ? 1 : 0;
  return lengths.count[chosen] > 0
             ? lengths.sum[chosen] / static_cast<double>(lengths.count[chosen])
             : 0;
}

}  // namespace scarp
