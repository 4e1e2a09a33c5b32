#include "levelset/facet_shares.h"

#include <algorithm>
#include <vector>

namespace scarp {

namespace {

/// Between the normals of facets on one side of an edge: of 40 degrees.
constexpr double least_cosine = 0.766;

/// Of its normal to the direction: a side does not count whose cosine is less by so much. A wall
/// that a floor left behind is not moved as the floor.
constexpr double cosine_room = 0.25;

}  // namespace

void share_out(const TriMesh& facets, Vec3d direction, double room, std::span<FacetShare> shares) {
  if (shares.size() < 2) return;
  const auto is_nearer = [](const FacetShare& a, const FacetShare& b) {
    return a.point.distance != b.point.distance ? a.point.distance < b.point.distance
                                                : a.point.triangle < b.point.triangle;
  };
  std::sort(shares.begin() + 1, shares.end(), is_nearer);
  const auto material = [&](const FacetShare& of) {
    return facets.materials.empty() ? MaterialId{} : facets.materials[of.point.triangle];
  };
  const Vec3d along = normalized(direction);
  const auto normal_of = [&](const FacetShare& of) {
    return normalized(area_vector(facets, of.point.triangle));
  };
  const FacetShare& first = shares.front();
  const double cosine_of_first = dot(normal_of(first), along);
  std::vector<Vec3d> sides;
  double sum = 0;
  for (FacetShare& each : shares) {
    const Vec3d normal = normal_of(each);
    const bool is_new = std::ranges::none_of(
        sides, [&](const Vec3d& side) { return dot(side, normal) > least_cosine; });
    const double further = (each.point.distance - first.point.distance) / room;
    const double turned = (cosine_of_first - dot(normal, along)) / cosine_room;
    const bool counts = is_new && material(each) == material(first);
    each.share = counts ? std::clamp(1 - further, 0.0, 1.0) * std::clamp(1 - turned, 0.0, 1.0) : 0;
    if (counts) sides.push_back(normal);
    sum += each.share;
  }
  for (FacetShare& each : shares) each.share /= sum;
}

}  // namespace scarp
