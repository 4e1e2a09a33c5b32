#include "mesh/regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "core/parallel.h"

namespace scarp {

RegionOrder::RegionOrder(const std::vector<bool>& is_feature, std::vector<float> size_limit,
                         Sizes sizes)
    : sizes_(sizes),
      region_(is_feature.size()),
      size_{sizes.l0},
      size_limit_(std::move(size_limit)) {
  for (std::size_t v = 0; v < region_.size(); ++v) region_[v] = is_feature[v] ? 0 : outside;
}

bool RegionOrder::wanted(const CollapseMesh& mesh, std::uint32_t h, double squared_length) const {
  const std::uint32_t u = mesh.topology.origin(h);
  const std::uint32_t v = mesh.topology.target(h);
  const std::uint16_t region = std::min(region_[u], region_[v]);
  double size = region == outside ? size_.back() : size_[region];
  if (!size_limit_.empty()) {
    size = std::min({size, double{size_limit_[u]}, double{size_limit_[v]}});
  }
  return squared_length < size * size;
}

void RegionOrder::merged(std::uint32_t u, std::uint32_t v) {
  region_[u] = std::min(region_[u], region_[v]);
  if (!size_limit_.empty()) size_limit_[u] = std::min(size_limit_[u], size_limit_[v]);
}

bool RegionOrder::coarsen() {
  double next = size_.back() + sizes_.step_length;
  if (sizes_.l_max > 0) next = std::min(next, sizes_.l_max);
  if (!(next > size_.back()) || size_.size() + 1 >= outside) return false;
  size_.push_back(next);
  return true;
}

bool RegionOrder::enclose_ring(const CollapseMesh& mesh) {
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

void RegionOrder::release_rest() {
  size_.push_back(sizes_.l_max > 0 ? sizes_.l_max : std::numeric_limits<double>::infinity());
}

void RegionOrder::raise(double l0) {
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
  const auto of_range = [&](std::size_t begin, std::size_t end) {
    Lengths lengths;
    for (auto h = static_cast<std::uint32_t>(begin); h < end; ++h) {
      if (!mesh.topology.alive(HalfEdges::facet(h)) || !mesh.topology.is_edge(h)) continue;
      const bool inside =
          is_feature[mesh.topology.origin(h)] && is_feature[mesh.topology.target(h)];
      const double length = std::sqrt(mesh.squared_length(h));
      for (std::size_t i = 0; i <= (inside ? 1 : 0); ++i) {
        lengths.sum[i] += length;
        ++lengths.count[i];
      }
    }
    return lengths;
  };
  const Lengths lengths = parallel_reduce(mesh.topology.half_edge_count(), grain, Lengths{},
                                          of_range, [](Lengths all, const Lengths& part) {
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
