#include "flux/engines/kept_hits.h"

#include <gtest/gtest.h>

#include "flux/solve.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;

// The upper part of a trench is of another material.
Shape two_materials() {
  Shape shape = exact::trench(2);
  for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f)
    shape.mesh.materials.push_back(corners(shape.mesh, f)[0].z < -20 ? 1 : 0);
  return shape;
}

FluxOptions options_of(const Shape& shape) {
  return {.engine = FluxOptions::Engine::gather,
          .sides = shape.sides,
          .spacing = 1,
          .target_error = 0.02};
}

void expect_same_bits(const std::vector<FluxField>& a, const std::vector<FluxField>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t s = 0; s < a.size(); ++s) {
    EXPECT_EQ(a[s].arrivals().mean, b[s].arrivals().mean);
    EXPECT_EQ(a[s].arrivals().std_error, b[s].arrivals().std_error);
    EXPECT_EQ(a[s].segments, b[s].segments);
    EXPECT_EQ(a[s].rays, b[s].rays);
    EXPECT_EQ(a[s].error, b[s].error);
    EXPECT_EQ(a[s].audit.escaped, b[s].audit.escaped);
  }
}

// By turns two chemistries, one of which needs more rays.
TEST(KeptHits, ChangeNoBitOfAFluxAndAreNotSentAgain) {
  const Shape shape = two_materials();
  const std::vector<std::vector<Species>> chemistries{
      {{.name = "a", .sticking = {0.5F, 0.4F}}},
      {{.name = "b", .sticking = {0.01F, 0.02F}}, {.name = "c", .sticking = {1.0F, 1.0F}}}};
  KeptHits hits;
  std::uint64_t sent = 0;
  for (int round = 0; round < 3; ++round) {
    for (const std::vector<Species>& species : chemistries) {
      expect_same_bits(solve_flux(shape.mesh, species, options_of(shape), {}, {}, &hits),
                       solve_flux(shape.mesh, species, options_of(shape)));
    }
    if (round == 0) sent = hits.sent();
    EXPECT_GT(sent, 4096U);
    EXPECT_EQ(hits.sent(), sent) << round;
  }
}

// From deep down some rays are aimed at the sky, and weighed.
TEST(KeptHits, ChangeNoBitOfAFluxInADeepHole) {
  const Shape shape = exact::hole(8, 11, 2, 12);
  KeptHits hits;
  for (const float sticking : {0.1F, 0.2F, 0.1F}) {
    const std::vector<Species> species{{.name = "a", .sticking = {sticking}}};
    expect_same_bits(solve_flux(shape.mesh, species, options_of(shape), {}, {}, &hits),
                     solve_flux(shape.mesh, species, options_of(shape)));
  }
  const std::vector<FluxField> anew = solve_flux(
      shape.mesh, std::vector<Species>{{.name = "a", .sticking = {0.1F}}}, options_of(shape));
  EXPECT_LT(hits.sent(), 2 * anew[0].rays);
}

// What is joined to elements depends on materials, and so do the rays: here stripes across a trench
// that cut as many cells of elements, with as many rays.
TEST(KeptHits, AreThoseOfTheMaterialsOfTheFacets) {
  Shape shape = exact::fine_trench();
  shape.mesh.materials.resize(shape.mesh.triangles.size());
  const std::vector<Species> species{{.name = "a", .sticking = {0.1F, 0.2F}}};
  KeptHits hits;
  std::uint64_t rays = 0;
  for (const double stripe : {0.0, 2.0}) {
    for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f) {
      const auto [a, b, c] = corners(shape.mesh, f);
      const double y = (a.y + b.y + c.y) / 3;
      shape.mesh.materials[f] = y > stripe && y < stripe + 2 ? 1 : 0;
    }
    FluxOptions options = options_of(shape);
    options.rays = 1;  // the least sets of all elements
    const std::vector<FluxField> flux = solve_flux(shape.mesh, species, options);
    expect_same_bits(solve_flux(shape.mesh, species, options, {}, {}, &hits), flux);
    if (rays == 0) rays = flux[0].rays;
    EXPECT_EQ(flux[0].rays, rays);
  }
}

// Rays that are weighed by where they meet the sky say more than what is kept of them.
TEST(KeptHits, AreNotUsedUnderASourceThatIsNotTheSameEverywhere) {
  const Shape shape = exact::trench(1);
  const std::vector<Species> gas{{.name = "gas", .sticking = {0.5F}}};
  std::vector<Species> lobe = gas;
  lobe[0].source.cosine_power = 5;
  KeptHits hits;
  for (const auto& species : {gas, lobe, gas, lobe}) {
    expect_same_bits(solve_flux(shape.mesh, species, options_of(shape), {}, {}, &hits),
                     solve_flux(shape.mesh, species, options_of(shape)));
  }
}

}  // namespace
}  // namespace scarp
