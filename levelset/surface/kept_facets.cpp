#include "levelset/surface/kept_facets.h"

#include <utility>

namespace scarp {

void KeptFacets::prepare(const Band& band) {
  std::vector<LeafAnswers> leaves;
  leaves.reserve(band.leaves().size());
  // Both are in the order of origins.
  auto before = leaves_.begin();
  for (const Leaf& leaf : band.leaves()) {
    while (before != leaves_.end() && before->origin < leaf.origin) ++before;
    leaves.push_back({.origin = leaf.origin});
    if (before != leaves_.end() && before->origin == leaf.origin)
      leaves.back().facets = std::move(before->facets);
  }
  leaves_ = std::move(leaves);
}

std::span<std::uint32_t> KeptFacets::of_leaf(std::size_t leaf) {
  std::vector<std::uint32_t>& facets = leaves_[leaf].facets;
  if (facets.empty()) facets.assign(leaf_size, ClosestPoint::none);
  return facets;
}

}  // namespace scarp
