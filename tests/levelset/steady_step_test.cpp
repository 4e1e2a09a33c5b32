// What the stages of a time step ask the allocator for when others went before, and that nothing
// depends on what those left in memory that is used again.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <vector>

#include "levelset/grid/band.h"
#include "levelset/motion/advect.h"
#include "levelset/motion/extend.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "surfaces.h"
#include "tests/levelset/speeds.h"
#include "tests/sanitizers.h"

namespace {

std::atomic<std::size_t> large_size{std::numeric_limits<std::size_t>::max()};
std::atomic<int> large_count{0};

void count(std::size_t size) {
  if (size >= large_size) ++large_count;
}

}  // namespace

#ifdef SCARP_UNDER_ASAN

// The sanitizer's own operators check what they are given, so they stay, and tell what they do.
// g++ has the function but not its header.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void*,
                                                                           std::size_t),
                                                         void (*on_free)(const volatile void*));

namespace {

const int hooks = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t size) { count(size); }, [](const volatile void*) {});

}  // namespace

#else

namespace {

void* counted(std::size_t size, std::size_t alignment) {
  count(size);
  // A multiple of the alignment, as aligned_alloc wants it.
  void* memory = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

// Those for arrays, and those that do not throw, call these.
void* operator new(std::size_t size) { return counted(size, __STDCPP_DEFAULT_NEW_ALIGNMENT__); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

#endif

namespace scarp {
namespace {

/// How often a stage asks for as much as a byte per node of the leaves at once.
template <class Stage>
int large_allocations(const Layers& layers, const Stage& stage) {
  large_count = 0;
  large_size = layers.top().band().leaves().size() * leaf_size;
  stage();
  large_size = std::numeric_limits<std::size_t>::max();
  return large_count;
}

/// Speeds of the two materials.
struct Motion {
  float substrate;
  float mask;
};

/// A trench in a substrate below a mask, which may stand still.
struct Wafer {
  explicit Wafer(int cells)
      : layers{.frame = {.spacing = 1, .cells = {cells, cells}}, .stack = {}} {
    const auto into_trench = [](Vec3d r) { return std::max(8.4 - std::abs(r.x), -12.3 - r.z); };
    const auto substrate = [=](Vec3d r) { return std::max(r.z + 4.3, into_trench(r)); };
    const auto mask = [=](Vec3d r) { return std::max(r.z - 0.3, into_trench(r)); };
    layers.stack.push_back({0, LevelSet(layers.frame, substrate, -20, 8)});
    layers.stack.push_back({1, LevelSet(layers.frame, mask, -20, 8)});
  }

  void look(const Motion& motion) {
    gas = open_gas(layers);
    facets = extract_surface(layers, gas);
    of_layers[0].speed.assign(facets.triangles.size(),
                              {motion.substrate, motion.substrate, motion.substrate});
    of_layers[1].speed.assign(facets.triangles.size(), {motion.mask, motion.mask, motion.mask});
  }

  SpeedField speeds() {
    FacetTree tree(facets);
    tree.room = &layers.top().band().scratch(0);
    return extend_speeds(layers, gas, tree, of_layers, {}, dt, close_facets);
  }

  void step(const Motion& motion, Scheme scheme) {
    look(motion);
    advect(layers, speeds(), dt, scheme);
  }

  static constexpr double dt = 0.3;
  Layers layers;
  OpenGas gas;
  TriMesh facets;
  std::array<LayerSpeeds, 2> of_layers;
};

/// All move; a mask stands still while the substrate is etched; or while a film grows.
constexpr Motion motions[]{{-1, -0.5F}, {-1, 0}, {1, 0}};

class SteadyStep : public testing::TestWithParam<Scheme> {};

// Small things per leaf or range of leaves remain, those of the threads, and of the tree where
// leaves come and go. Large are: the speeds, which are what comes out, two arrays of the tree over
// the facets and one for its making, and one to tell which facets are creased. They do not stay:
// for the rest of the step others need that memory.
TEST_P(SteadyStep, AsksForNoMoreLargeArraysThanItGives) {
  for (const Motion& motion : motions) {
    Wafer wafer(64);
    wafer.step(motion, GetParam());
    wafer.look(motion);
    SpeedField field;
    EXPECT_LE(large_allocations(wafer.layers, [&] { field = wafer.speeds(); }), 5);
    EXPECT_EQ(large_allocations(wafer.layers,
                                [&] { advect(wafer.layers, field, Wafer::dt, GetParam()); }),
              0);
  }
}

TEST_P(SteadyStep, DoesNotDependOnWhatWasInMemoryBefore) {
  for (const Motion& motion : motions) {
    Wafer fresh(64);
    Wafer used(64);
    for (int n = 0; n < 2; ++n) {
      fresh.step(motion, GetParam());
      for (const int which : {0, 1}) {
        Band& band = used.layers.top().band();
        std::fill_n(band.scratch(which)[0], band.leaves().size() * leaf_size, 1e30F * n - 2);
      }
      used.step(motion, GetParam());
      EXPECT_EQ(hash(fresh.layers), hash(used.layers));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Schemes, SteadyStep,
                         testing::Values(Scheme::first_order, Scheme::eno2, Scheme::weno5));

}  // namespace
}  // namespace scarp
