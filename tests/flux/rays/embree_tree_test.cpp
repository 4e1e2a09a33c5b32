#include "flux/rays/embree_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tests/flux/random_facets.h"
#include "tests/sanitizers.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

std::vector<std::string> instruction_sets() {
  std::vector<std::string> sets{"", "isa=sse2"};
  if (__builtin_cpu_supports("avx2") != 0) sets.emplace_back("isa=avx2");
  if (__builtin_cpu_supports("avx512vl") != 0) sets.emplace_back("isa=avx512");
  return sets;
}

// What is beyond the nearest facet, but for the thickness of a ridge, is not looked for.
void expect_same_end(const NearestFacet& found, const NearestFacet& of_all) {
  EXPECT_EQ(found.t_nearest(), of_all.t_nearest());
  EXPECT_EQ(found.is_at_front(), of_all.is_at_front());
  if (of_all.is_at_front()) {
    EXPECT_EQ(found.front().facet, of_all.front().facet);
    EXPECT_EQ(found.front().t, of_all.front().t);
  } else {
    EXPECT_EQ(found.back().facet, of_all.back().facet);
  }
}

TEST(EmbreeTree, FindsWhatTestsOfAllFacetsFind) {
  RandomStream random({.seed = 1});
  const std::vector<SceneFacet> facets = random_facets(1500, random);
  std::vector<EmbreeTree> trees;
  for (const std::string& set : instruction_sets()) trees.emplace_back(facets, 3 * side, set);
  int met = 0;
  for (int i = 0; i < 4000; ++i) {
    const Ray ray = random_ray(facets, i % 5, random);
    const double t_end = i % 11 == 0 ? random_between(random, 0, side) : 2 * side;
    NearestFacet of_all(ray, t_end, 10 * 0x1p-24 * 3 * side);
    for (std::uint32_t f = 0; f < facets.size(); ++f) of_all.test(facets[f], f);
    met += of_all.t_nearest() < t_end ? 1 : 0;
    for (const EmbreeTree& tree : trees) expect_same_end(tree.nearest(ray, t_end), of_all);
  }
  EXPECT_GT(met, 2000);
}

// Along a strip of 12 000 facets with ridges: at its far end single precision hardly tells heights.
TEST(EmbreeTree, FindsWhatIsFarAway) {
  constexpr int length = 6000;
  std::vector<SceneFacet> facets;
  for (int i = 0; i < length; ++i) {
    const auto at = [&](int x, int y) {
      return Vec3d{static_cast<double>(x), static_cast<double>(y), x % 500 == 0 ? 0.1 : 0};
    };
    facets.push_back(facet_of(at(i, 0), at(i + 1, 0), at(i, 1)));
    facets.push_back(facet_of(at(i + 1, 1), at(i, 1), at(i + 1, 0)));
  }
  const EmbreeTree tree(facets, length + 5.0, "");
  RandomStream random({.seed = 4});
  int met = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec3d r{random_between(random, 0, length), random_between(random, 0.1, 0.9),
                  random_between(random, 0, 2.5)};
    const Vec3d to{random_between(random, 0, length), random_between(random, 0, 1),
                   i % 2 == 0 ? 0.05 : -0.5};
    const Ray ray{.r = r, .u = normalized(to - r)};
    NearestFacet of_all(ray, scarp::length(to - r), 10 * 0x1p-24 * (length + 5.0));
    for (std::uint32_t f = 0; f < facets.size(); ++f) of_all.test(facets[f], f);
    met += of_all.is_at_front() ? 1 : 0;
    expect_same_end(tree.nearest(ray, scarp::length(to - r)), of_all);
  }
  EXPECT_GT(met, 100);
}

TEST(EmbreeTree, ManyAreBuiltAndSearchedAtOnce) {
  RandomStream random({.seed = 5});
  const std::vector<SceneFacet> facets = random_facets(300, random);
  std::vector<Ray> rays;
  for (int i = 0; i < 200; ++i) rays.push_back(random_ray(facets, i % 5, random));
  const EmbreeTree alone(facets, 3 * side, "");
  constexpr std::size_t count = 16;
  std::vector<std::vector<NearestFacet>> found(count);
  parallel_for(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const EmbreeTree tree(facets, 3 * side, "");
      for (const Ray& ray : rays) found[k].push_back(tree.nearest(ray, 2 * side));
    }
  });
  for (const std::vector<NearestFacet>& of_tree : found)
    for (std::size_t i = 0; i < rays.size(); ++i)
      expect_same_end(of_tree[i], alone.nearest(rays[i], 2 * side));
}

// Embree builds trees with numbers below the least normal one taken for 0. Ours are kept, also in
// the parallel loops of a thread that does nothing in parallel before.
TEST(EmbreeTree, LeavesTheArithmeticOfAllThreadsAlone) {
  RandomStream random({.seed = 6});
  const std::vector<SceneFacet> facets = random_facets(20'000, random);
  std::vector<float> halves(1000);
  std::thread([&] {
    const EmbreeTree tree(facets, 3 * side, "");
    static_cast<void>(tree.nearest({.r = {1, 1, 1}, .u = {0, 0, 1}}, 1));
    parallel_for(halves.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        volatile float least = std::numeric_limits<float>::min();
        halves[k] = least * 0.5F;
      }
    });
  }).join();
  for (const float half : halves) ASSERT_GT(half, 0);
}

// What a function prints to standard error before the program ends.
void print_error(const std::vector<SceneFacet>& facets) {
  try {
    const EmbreeTree tree(facets, 3 * side, "");
  } catch (const NumericalError& error) {
    std::fputs(error.what(), stderr);
    std::exit(0);
  }
  std::exit(1);
}

void limit_memory(std::size_t bytes) {
  std::size_t pages = 0;
  std::FILE* const sizes = std::fopen("/proc/self/statm", "r");
  if (sizes == nullptr || std::fscanf(sizes, "%zu", &pages) != 1) std::exit(2);
  std::fclose(sizes);
  const std::size_t page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const rlimit limit{pages * page + bytes, pages * page + bytes};
  setrlimit(RLIMIT_AS, &limit);
}

TEST(EmbreeTree, AnErrorOfEmbreeIsToldWithItsText) {
#ifdef SCARP_UNDER_ASAN
  GTEST_SKIP() << "the sanitizer has no limit of memory";
#endif
  RandomStream random({.seed = 7});
  const std::vector<SceneFacet> facets(1'000'000, random_facets(1, random).front());
  EXPECT_EXIT(
      {
        limit_memory(std::size_t{96} << 20);
        print_error(facets);
      },
      ::testing::ExitedWithCode(0), "flux: Embree: .*alloc|flux: Embree: out of memory");
}

class EmbreeConfiguration : public ::testing::Test {
 protected:
  void TearDown() override { unsetenv("SCARP_EMBREE"); }
  static std::string error_of(const char* configuration) {
    setenv("SCARP_EMBREE", configuration, 1);
    try {
      embree_configuration();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(EmbreeConfiguration, IsThatOfTheEnvironment) {
  unsetenv("SCARP_EMBREE");
  EXPECT_EQ(embree_configuration(), "");
  setenv("SCARP_EMBREE", "isa=sse2,hugepages=0", 1);
  EXPECT_EQ(embree_configuration(), "isa=sse2,hugepages=0");
}

TEST_F(EmbreeConfiguration, SaysWhatIsWrong) {
  EXPECT_THAT(error_of("isa=avx3"),
              HasSubstr("SCARP_EMBREE: \"isa=avx3\": isa is sse2, sse4.2, avx, avx2 or avx512"));
  EXPECT_THAT(error_of("isa=sse2,iza=sse2"), HasSubstr("\"iza=sse2\": write key=value with isa"));
  EXPECT_THAT(error_of("threads=1"), HasSubstr("threads are those of --threads"));
  for (const char* const wrong : {"isa", "isa=", "sse2", "isa=sse2,,", "hugepages=many"})
    EXPECT_THAT(error_of(wrong), HasSubstr("SCARP_EMBREE: ")) << wrong;
}

TEST(EmbreeVersion, HasThreeParts) {
  EXPECT_THAT(embree_version(), ::testing::MatchesRegex("3\\.[0-9]+\\.[0-9]+"));
}

}  // namespace
}  // namespace scarp
