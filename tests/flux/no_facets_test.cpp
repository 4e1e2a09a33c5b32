// That no ray finds a facet but by Embree: its trees are given none, and every ray escapes.

#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <atomic>
#include <ostream>
#include <vector>

#include "flux/solve.h"
#include "tests/flux/ion_traces.h"
#include "tests/flux/shapes.h"

namespace {

std::atomic<bool> trees_are_empty = false;

}  // namespace

// In place of Embree's, which it calls.
extern "C" void rtcSetGeometryUserPrimitiveCount(RTCGeometry geometry, unsigned int count) {
  using Function = void (*)(RTCGeometry, unsigned int);
  static const auto embrees =
      reinterpret_cast<Function>(dlsym(RTLD_NEXT, "rtcSetGeometryUserPrimitiveCount"));
  embrees(geometry, trees_are_empty ? 0 : count);
}

namespace scarp {
namespace {

class EmptyTrees {
 public:
  EmptyTrees() { trees_are_empty = true; }
  ~EmptyTrees() { trees_are_empty = false; }
  EmptyTrees(const EmptyTrees&) = delete;
  EmptyTrees& operator=(const EmptyTrees&) = delete;
};

struct Mode {
  const char* name;
  Species species;
  FluxOptions options;
  double open_flux = 1;  ///< on a level facet that nothing shades
};

// NOLINTNEXTLINE(readability-identifier-naming): GoogleTest calls it
void PrintTo(const Mode& mode, std::ostream* out) { *out << mode.name; }

std::vector<Mode> modes() {
  using Engine = FluxOptions::Engine;
  const Species gas{.name = "gas"};
  const Species beam{.name = "beam",
                     .source = {.kind = SourceLobe::Kind::beam, .direction = {0.6, 0, -0.8}}};
  const auto forward = [](FluxOptions options) {
    options.engine = Engine::forward;
    options.rays = 1 << 12;
    return options;
  };
  const auto gather = [](FluxOptions options) {
    options.engine = Engine::gather;
    options.rays = 1 << 16;
    return options;
  };
  return {{"forward", gas, forward({})},
          {"gather", gas, gather({})},
          {"lobe", {.name = "lobe", .source = {.cosine_power = 20}}, gather({})},
          {"ions_forward", exact::plasma_ions(), forward({})},
          {"ions_gather", exact::plasma_ions(), gather({})},
          {"beam", beam, {}, 0.8},
          {"forward_2d", gas, forward({.two_dimensional = true})},
          {"gather_2d", gas, gather({.two_dimensional = true})},
          {"beam_2d", beam, {.two_dimensional = true}, 0.8},
          {"forward_axisymmetric", gas, forward({.axisymmetric = true})},
          {"gather_axisymmetric", gas, gather({.axisymmetric = true})}};
}

// Half a trench of width 20 and depth 80, or, about x = 0, a hole: a strip of one spacing along y.
exact::Shape half_feature() {
  constexpr double depth = 80;
  const Vec3d y{0, 1, 0};
  exact::Builder builder;
  builder.grid({0, 0, -depth}, {10, 0, 0}, 10, y, 1);
  builder.grid({10, 0, -depth}, {0, 0, depth}, 40, y, 1);
  builder.grid({10, 0, 0}, {4, 0, 0}, 4, y, 1);
  return {builder.mesh, {.lower = {0, 0}, .upper = {14, 1}}};
}

class WithoutFacets : public ::testing::TestWithParam<Mode> {};

TEST_P(WithoutFacets, EveryRayEscapes) {
  const Mode& mode = GetParam();
  const exact::Shape shape = half_feature();
  const auto at_bottom = [](Vec3d r) { return r.z < -79.9; };
  const auto bottom_of = [&](const FluxField& flux) {
    return exact::mean_of(shape.mesh, flux.arrivals(), at_bottom);
  };
  const exact::Mean shaded = bottom_of(exact::trace(shape, mode.species, mode.options));
  EXPECT_LT(shaded.value, 0.9 * mode.open_flux);
  const EmptyTrees none;
  const FluxField flux = exact::trace(shape, mode.species, mode.options);
  if (flux.engine == FluxEngine::forward) {
    EXPECT_EQ(flux.audit.absorbed, 0);
    EXPECT_EQ(flux.audit.escaped + flux.audit.lost_below, flux.audit.emitted);
    for (const float mean : flux.arrivals().mean) EXPECT_EQ(mean, 0);
  } else {
    const exact::Mean open = bottom_of(flux);
    EXPECT_NEAR(open.value, mode.open_flux, 5 * open.error + 1e-6);
  }
  EXPECT_EQ(flux.audit.lost_back_face, 0);
}

INSTANTIATE_TEST_SUITE_P(OfEachEngineAndMode, WithoutFacets, ::testing::ValuesIn(modes()),
                         [](const auto& mode) { return mode.param.name; });

}  // namespace
}  // namespace scarp
