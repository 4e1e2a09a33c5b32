#include "levelset/surface/facet_shares.h"

#include <algorithm>
#include <span>

#include "core/smooth_edge.h"

namespace scarp {

namespace {

/// Of its normal to the direction: a side does not count whose cosine is less by so much. A wall
/// that a floor left behind is not moved as the floor.
constexpr double cosine_room = 0.25;

/// Rooms: a mesh cuts off edges by facets that are narrower.
constexpr double width_of_bevels = 50;

struct Side {
  FacetShare share;
  Vec3d normal;
  double width;  ///< the least altitude of its nearest facet
};

double width(const TriMesh& facets, std::uint32_t facet) {
  const auto [a, b, c] = corners(facets, facet);
  const double longest = std::max({length(b - a), length(c - b), length(a - c)});
  return 2 * length(area_vector(facets, facet)) / longest;
}

/// Whether a side lies between two others that face less alike than it does either of them.
bool is_between(const Side& side, std::span<const Side> sides) {
  for (const Side& a : sides) {
    for (const Side& b : sides) {
      const double apart = dot(a.normal, b.normal);
      if (&a != &side && &b != &side && dot(side.normal, a.normal) > apart &&
          dot(side.normal, b.normal) > apart)
        return true;
    }
  }
  return false;
}

bool is_nearer(const FacetShare& a, const FacetShare& b) {
  return a.point.distance != b.point.distance ? a.point.distance < b.point.distance
                                              : a.point.triangle < b.point.triangle;
}

}  // namespace

void share_out(const TriMesh& facets, Vec3d direction, double room,
               std::vector<FacetShare>& shares) {
  const FacetShare first = shares.front();
  const auto material = [&](const FacetShare& of) {
    return facets.materials.empty() ? MaterialId{} : facets.materials[of.point.triangle];
  };
  std::erase_if(shares, [&](const FacetShare& each) { return material(each) != material(first); });
  if (shares.size() == 1) return;

  std::sort(shares.begin() + 1, shares.end(), is_nearer);
  std::vector<Side> sides;
  for (const FacetShare& each : shares) {
    const Vec3d normal = normalized(area_vector(facets, each.point.triangle));
    const bool is_new = std::ranges::none_of(
        sides, [&](const Side& side) { return dot(normal, side.normal) > smooth_cosine; });
    if (is_new) sides.push_back({each, normal, width(facets, each.point.triangle)});
  }
  const auto is_bevel = [&](const Side& side) {
    return side.width < width_of_bevels * room && is_between(side, sides);
  };
  // Only of slivers that lie criss-cross all may be between others.
  if (std::ranges::all_of(sides, is_bevel)) sides.resize(1);
  const Vec3d along = normalized(direction);
  const auto first_side = std::ranges::find_if_not(sides, is_bevel);
  double sum = 0;
  shares.clear();
  for (const Side& side : sides) {
    const double further = (side.share.point.distance - first_side->share.point.distance) / room;
    const double turned = dot(first_side->normal - side.normal, along) / cosine_room;
    const double share = std::clamp(1 - further, 0.0, 1.0) * std::clamp(1 - turned, 0.0, 1.0);
    if (share == 0 || is_bevel(side)) continue;
    shares.push_back({.point = side.share.point, .share = share});
    sum += share;
  }
  for (FacetShare& each : shares) each.share /= sum;
}

std::optional<std::size_t> leading_side(const TriMesh& facets, std::span<const FacetShare> sides,
                                        std::span<const float> speeds) {
  const auto [lowest, highest] = std::ranges::minmax_element(speeds);
  if (*lowest == *highest) return std::nullopt;
  const auto slow = static_cast<std::size_t>(lowest - speeds.begin());
  const auto fast = static_cast<std::size_t>(highest - speeds.begin());
  const std::uint32_t facet = sides[slow].point.triangle;
  const auto [a, b, c] = corners(facets, facet);
  const auto [d, e, f] = corners(facets, sides[fast].point.triangle);
  const bool stands_out = dot(area_vector(facets, facet), (d + e + f) - (a + b + c)) < 0;
  if (stands_out && *lowest < 0) return slow;
  if (!stands_out && *highest > 0) return fast;
  return std::nullopt;
}

}  // namespace scarp
