#include "levelset/operations/necks.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/error.h"

namespace scarp {

namespace {

/// Gas that is joined by ways as wide as the narrowest of its nodes so far.
class Regions {
 public:
  explicit Regions(std::size_t count) : parent_(count, none), widest_(count, 0) {}

  bool has(std::size_t node) const { return parent_[node] != none; }

  void begin(std::size_t node, float clearance) {
    parent_[node] = static_cast<std::uint32_t>(node);
    widest_[node] = clearance;
  }

  std::size_t find(std::size_t node) {
    while (parent_[node] != node) {
      parent_[node] = parent_[parent_[node]];
      node = parent_[node];
    }
    return node;
  }

  float widest(std::size_t root) const { return widest_[root]; }

  /// The first takes the second.
  void join(std::size_t root, std::size_t other) {
    parent_[other] = static_cast<std::uint32_t>(root);
    widest_[root] = std::max(widest_[root], widest_[other]);
  }

 private:
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  std::vector<std::uint32_t> parent_;
  std::vector<float> widest_;
};

}  // namespace

std::vector<double> shutting_thicknesses(const NodeBox& box, std::vector<float> clearance,
                                         const std::function<int(int axis, int index)>& fold,
                                         double thickness, double spacing) {
  SCARP_ASSERT(box.size(), <, std::size_t{1} << 32);
  // What a film does not reach has no order.
  for (float& each : clearance) each = std::min(each, static_cast<float>(thickness));

  std::vector<std::uint32_t> order;
  for (std::size_t n = 0; n < clearance.size(); ++n)
    if (clearance[n] > 0) order.push_back(static_cast<std::uint32_t>(n));
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](std::uint32_t node) { return clearance[node]; });

  Regions regions(clearance.size() + 1);
  const std::size_t source = clearance.size();
  regions.begin(source, static_cast<float>(thickness));
  std::vector<double> thicknesses;
  const auto join = [&](std::size_t node, std::size_t other) {
    const std::size_t a = regions.find(node);
    const std::size_t b = regions.find(other);
    if (a == b) return;
    const std::size_t open = regions.find(source);
    if (a != open && b != open) return regions.join(a, b);
    const std::size_t cut_off = a == open ? b : a;
    const double neck = std::min(clearance[node], static_cast<float>(thickness));
    if (regions.widest(cut_off) - neck > least_cut_off * spacing) thicknesses.push_back(neck);
    regions.join(open, cut_off);
  };
  for (const std::uint32_t node : order) {
    regions.begin(node, clearance[node]);
    const auto column = node / box.height();
    const int k = box.lowest + static_cast<int>(node % box.height());
    const int i = static_cast<int>(column / static_cast<std::size_t>(box.count[1]));
    const int j = static_cast<int>(column % static_cast<std::size_t>(box.count[1]));
    if (k == box.highest) join(node, source);
    const auto join_if_there = [&](int x, int y, int z) {
      if (z < box.lowest || z > box.highest) return;
      const std::size_t other = box.index(fold(0, x), fold(1, y), z);
      if (regions.has(other)) join(node, other);
    };
    for (const int side : {-1, 1}) {
      join_if_there(i + side, j, k);
      join_if_there(i, j + side, k);
      join_if_there(i, j, k + side);
    }
  }
  std::ranges::sort(thicknesses);
  return thicknesses;
}

}  // namespace scarp
