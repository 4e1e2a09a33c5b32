#include "levelset/facet_shares.h"

#include <algorithm>

#include "core/smooth_edge.h"

namespace scarp {

namespace {

/// Of its normal to the direction: a side does not count whose cosine is less by so much. A wall
/// that a floor left behind is not moved as the floor.
constexpr double cosine_room = 0.25;

bool is_nearer(const FacetShare& a, const FacetShare& b) {
  return a.point.distance != b.point.distance ? a.point.distance < b.point.distance
                                              : a.point.triangle < b.point.triangle;
}

}  // namespace

void share_out(const TriMesh& facets, Vec3d direction, double room,
               std::vector<FacetShare>& shares) {
  const FacetShare first = shares.front();
  const Vec3d normal_of_first = normalized(area_vector(facets, first.point.triangle));
  const auto material = [&](const FacetShare& of) {
    return facets.materials.empty() ? MaterialId{} : facets.materials[of.point.triangle];
  };
  std::erase_if(shares, [&](const FacetShare& each) { return material(each) != material(first); });
  if (shares.size() == 1) return;

  std::sort(shares.begin() + 1, shares.end(), is_nearer);
  const Vec3d along = normalized(direction);
  std::vector<Vec3d> sides;
  double sum = 0;
  for (FacetShare& each : shares) {
    const Vec3d normal = normalized(area_vector(facets, each.point.triangle));
    const bool is_new = std::ranges::none_of(
        sides, [&](const Vec3d& side) { return dot(normal, side) > smooth_cosine; });
    const double further = (each.point.distance - first.point.distance) / room;
    const double turned = dot(normal_of_first - normal, along) / cosine_room;
    each.share = is_new ? std::clamp(1 - further, 0.0, 1.0) * std::clamp(1 - turned, 0.0, 1.0) : 0;
    if (is_new) sides.push_back(normal);
    sum += each.share;
  }
  std::erase_if(shares, [](const FacetShare& each) { return each.share == 0; });
  for (FacetShare& each : shares) each.share /= sum;
}

}  // namespace scarp
