#include "tests/bench/trace_time.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/sides.h"
#include "tests/mesh/generated_surface.h"

namespace scarp::bench {
namespace {

constexpr std::uint64_t particles = 20000;

// Each arrives, and nine of ten fly once more: to the sky.
TEST(TraceTime, FlatWafersSendParticlesBackOnce) {
  const TriMesh mesh = polygonised({.cells = {8, 8, 4}}, [](Vec3d r) { return r.z - 1.7; });

  const TraceTime time = trace_time(mesh, sides_of(mesh), particles);

  const double std_error = std::sqrt(particles * 0.9 * 0.1);
  EXPECT_NEAR(static_cast<double>(time.segments), 1.9 * particles, 5 * std_error);
  EXPECT_GT(time.total(), 0);
}

TEST(TraceTime, IsWhatNothingDisturbed) {
  TraceTime time{.cpu_seconds = {1, 5, 2}, .segments = 7};

  time.take_lesser({.cpu_seconds = {2, 3, 2}, .segments = 7});

  EXPECT_EQ(time.cpu_seconds, (std::vector<double>{1, 3, 2}));
  EXPECT_EQ(time.total(), 6);
}

TEST(TraceTime, TrenchesKeepParticlesForLonger) {
  const TriMesh mesh = polygonised({.cells = {16, 16, 36}}, deep_trenches(16, 16));

  EXPECT_GT(trace_time(mesh, sides_of(mesh), particles).segments, 3 * particles);
}

}  // namespace
}  // namespace scarp::bench
