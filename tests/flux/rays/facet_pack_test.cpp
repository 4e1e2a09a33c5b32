#include "flux/rays/facet_pack.h"

#include <gtest/gtest.h>

#include <span>
#include <vector>

#include "core/random.h"
#include "tests/flux/random_facets.h"

namespace scarp {
namespace {

constexpr double room = 10 * 0x1p-24 * 3 * side;

// Of a flight without end on either side of its start.
bool is_met(const SceneFacet& facet, const Ray& ray) {
  NearestFacet ahead(ray, 1e9, room);
  NearestFacet behind({.r = ray.r, .u = -ray.u}, 1e9, room);
  return ahead.test(facet, 0) || behind.test(facet, 0);
}

PackView view_of(const Ray& ray) { return {RayView(ray), ray.from}; }

// Rays of one kind, at packs of the facets that one ray in four is sent at.
struct Looks {
  int met = 0;
  int met_unseen = 0;
  int seen_in_vain = 0;
};
Looks looks(int kind) {
  RandomStream random({.seed = 11, .ray = static_cast<std::uint64_t>(kind)});
  const std::vector<SceneFacet> facets = random_facets(200, random);
  Looks result;
  for (std::uint32_t f = 0; f + FacetPack::most <= facets.size(); f += FacetPack::most) {
    const FacetPack pack(facets, std::array{f, f + 1, f + 2, f + 3}, room);
    const auto own = std::vector(facets.begin() + f, facets.begin() + f + FacetPack::most);
    for (int i = 0; i < 200; ++i) {
      Ray ray = random_ray(i % 4 == 0 ? facets : own, kind, random);
      ray.from = Ray::no_facet;
      const auto may_meet = view_of(ray).may_meet(pack);
      for (std::uint32_t k = 0; k < FacetPack::most; ++k) {
        const bool is_seen = may_meet[k] != 0;
        const bool met = is_met(facets[f + k], ray);
        result.met += met ? 1 : 0;
        result.met_unseen += met && !is_seen ? 1 : 0;
        result.seen_in_vain += is_seen && !met ? 1 : 0;
      }
    }
  }
  return result;
}

class FacetPackLook : public ::testing::TestWithParam<int> {};

TEST_P(FacetPackLook, SeesAllThatIsMet) {
  const Looks found = looks(GetParam());
  EXPECT_GT(found.met, GetParam() < 2 ? 100 : 5000);
  EXPECT_EQ(found.met_unseen, 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, FacetPackLook, ::testing::Range(0, 5));

// Of rays in any direction few pass that close to an edge.
TEST(FacetPack, FewAreSeenInVain) {
  const Looks found = looks(0);
  EXPECT_LT(found.seen_in_vain, found.met / 10);
}

TEST(FacetPack, PlacesThatAreLeftAreNotMet) {
  const std::vector<SceneFacet> facets{facet_of({1, 1, 1}, {2, 1, 1}, {1, 2, 1})};
  const FacetPack pack(facets, std::array{0U}, room);
  const auto may_meet = view_of({.r = {1.2, 1.2, 5}, .u = {0, 0, -1}}).may_meet(pack);
  EXPECT_NE(may_meet[0], 0);
  for (std::uint32_t k = 1; k < FacetPack::most; ++k) EXPECT_EQ(may_meet[k], 0);
}

TEST(FacetPack, TheFacetOfTheStartIsNotMet) {
  const SceneFacet facet = facet_of({1, 1, 1}, {2, 1, 1}, {1, 2, 1});
  const std::vector<SceneFacet> facets{facet, facet};
  const FacetPack pack(facets, std::array{0U, 1U}, room);
  const auto may_meet = view_of({.r = {1.2, 1.2, 5}, .u = {0, 0, -1}, .from = 1}).may_meet(pack);
  EXPECT_NE(may_meet[0], 0);
  EXPECT_EQ(may_meet[1], 0);
}

}  // namespace
}  // namespace scarp
