// Half of a square that is its own mirror image across x = y.

#include <gtest/gtest.h>

#include <cmath>

#include "flux/solve.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

struct DiagonalCase {
  const char* name;
  FluxOptions::Engine engine;
  double cosine_power;
  float sticking;
};

class Diagonal : public ::testing::TestWithParam<DiagonalCase> {
 protected:
  static FluxField solve(const exact::Shape& shape, std::uint64_t rays) {
    const Species species{.name = "gas",
                          .source = {.cosine_power = GetParam().cosine_power},
                          .sticking = {GetParam().sticking}};
    const FluxOptions options{
        .engine = GetParam().engine, .sides = shape.sides, .spacing = 1, .rays = rays, .seed = 2};
    return solve_flux(shape.mesh, {&species, 1}, options).front();
  }
};

TEST_P(Diagonal, FluxOfAHalfIsThatOfBothWithinTheirErrors) {
  const exact::Shape half = exact::rough_triangle(1, 12);
  const FluxField of_half = solve(half, 1 << 17);
  const FluxField of_both = solve(exact::with_image(half), 1 << 18);
  double squares = 0;
  double difference = 0;
  double flux = 0;
  const std::size_t count = half.mesh.triangles.size();
  const std::vector<double> areas = facet_areas(half.mesh);
  for (std::size_t f = 0; f < count; ++f) {
    const Tally& a = of_half.arrivals();
    const Tally& b = of_both.arrivals();
    const double apart = static_cast<double>(a.mean[f]) - b.mean[f];
    squares += std::pow(apart / std::hypot(a.std_error[f] + 1e-4, b.std_error[f] + 1e-4), 2);
    difference += areas[f] * apart;
    flux += areas[f] * b.mean[f];
  }
  const double normalised = std::sqrt(squares / static_cast<double>(count));
  EXPECT_LT(normalised, 1.2);
  EXPECT_GT(normalised, 0.5);
  EXPECT_LT(std::abs(difference), 0.005 * flux);
  const FluxAudit& audit = of_half.audit;
  EXPECT_EQ(audit.lost(), 0);
  EXPECT_NEAR(of_half.audit.absorbed / of_half.audit.emitted,
              of_both.audit.absorbed / of_both.audit.emitted, 0.005);
}

INSTANTIATE_TEST_SUITE_P(
    Engines, Diagonal,
    ::testing::Values(DiagonalCase{"forward", FluxOptions::Engine::forward, 1, 0.3F},
                      DiagonalCase{"gather", FluxOptions::Engine::gather, 1, 0.3F},
                      DiagonalCase{"forward_lobe", FluxOptions::Engine::forward, 40, 0.3F},
                      DiagonalCase{"gather_lobe", FluxOptions::Engine::gather, 40, 0.3F}),
    [](const auto& info) { return info.param.name; });

TEST(DiagonalBeam, CastsTheShadowsOfBothHalves) {
  const exact::Shape half = exact::rough_triangle(4, 12);
  const Species beam{.name = "ions", .source = {.kind = SourceLobe::Kind::beam}};
  const auto solve = [&](const exact::Shape& shape) {
    return solve_flux(shape.mesh, {&beam, 1}, {.sides = shape.sides, .spacing = 1}).front();
  };
  const FluxField of_half = solve(half);
  const FluxField of_both = solve(exact::with_image(half));
  for (std::size_t f = 0; f < half.mesh.triangles.size(); ++f)
    EXPECT_NEAR(of_half.arrivals().mean[f], of_both.arrivals().mean[f], 1e-6);
  EXPECT_NEAR(of_half.audit.emitted, 200, 1e-9);
  EXPECT_NEAR(of_half.audit.absorbed, 200, 0.5);
}

}  // namespace
}  // namespace scarp
