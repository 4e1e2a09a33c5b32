// Periodic wafers put together at random, against the same wafers shifted by whole and by broken
// numbers of spacings.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "core/random.h"
#include "program.h"

namespace scarp {
namespace {

constexpr double grid_spacing = 10;  // nm
constexpr std::array<double, 2> extent{600, 400};

using Shift = std::array<double, 2>;

/// Recipes of one wafer at any shift: what is cut into silicon or stands on it, a mask at times,
/// and a film on all of it.
class RandomWafer {
 public:
  /// With several shapes, which may overlap, or with one.
  RandomWafer(int seed, bool several)
      : seed_(static_cast<std::uint64_t>(seed)), several_(several) {}

  /// Its thickness in nm.
  double film() const { return 8 + 32 * RandomStream({.seed = 5000 + seed_}).uniform(); }

  std::string recipe(const Shift& shift) const {
    RandomStream random({.seed = seed_});
    const auto between = [&](double a, double b) { return a + (b - a) * random.uniform(); };
    const auto centre = [&](int axis) {
      const double half = 0.5 * extent[axis];
      const double at = between(-half, half) + shift[axis] + half;
      return at - extent[axis] * std::floor(at / extent[axis]) - half;
    };
    const auto solid = [&] {
      const double x = centre(0);
      const double y = centre(1);
      switch (static_cast<int>(between(0, 3))) {
        case 0:
          return fmt::format(
              "[[geometry]]\nshape = \"hole\"\nradius = \"{} nm\"\ndepth = \"{} nm\"\n"
              "center = [\"{} nm\", \"{} nm\"]\n",
              between(60, 120), between(60, 200), x, y);
        case 1:
          return fmt::format(
              "[[geometry]]\nshape = \"trench\"\nwidth = \"{} nm\"\ndepth = \"{} nm\"\n"
              "center = \"{} nm\"\n",
              between(100, 250), between(60, 200), x);
        default:
          return fmt::format(
              "[[geometry]]\nshape = \"fin\"\nmaterial = \"polySi\"\nwidth = \"{} nm\"\n"
              "height = \"{} nm\"\ncenter = \"{} nm\"\n",
              between(100, 250), between(60, 150), x);
      }
    };
    const auto outline = [&] {
      const double x = centre(0);
      const double y = centre(1);
      switch (static_cast<int>(between(0, 4))) {
        case 0:
          return fmt::format(
              "{{ shape = \"hole\", radius = \"{} nm\", center = [\"{} nm\", \"{} nm\"] }}",
              between(60, 120), x, y);
        case 1:
          return fmt::format(
              "{{ shape = \"rectangle\", size = [\"{} nm\", \"{} nm\"], "
              "center = [\"{} nm\", \"{} nm\"] }}",
              between(100, 240), between(100, 240), x, y);
        case 2:
          return fmt::format("{{ shape = \"trench\", width = \"{} nm\", center = \"{} nm\" }}",
                             between(100, 250), x);
        default: {
          const int count = 3 + static_cast<int>(between(0, 4));
          const double radius = between(90, 130);
          const double turn = between(0, 6);
          std::string points;
          for (int n = 0; n < count; ++n) {
            const double angle = turn + 2 * std::numbers::pi * n / count;
            points += fmt::format("[\"{} nm\", \"{} nm\"], ", x + radius * std::cos(angle),
                                  y + radius * std::sin(angle));
          }
          return fmt::format("{{ shape = \"polygon\", points = [{}] }}", points);
        }
      }
    };
    std::string text = fmt::format(
        "[domain]\nspacing = \"{} nm\"\nextent = [\"{} nm\", \"{} nm\"]\n"
        "boundary = [\"periodic\", \"periodic\"]\n[output]\nevery = \"1000 s\"\n"
        "[[step]]\nmodel = \"conformal\"\nmaterial = \"SiO2\"\nthickness = \"{} nm\"\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n",
        grid_spacing, extent[0], extent[1], film());
    const bool has_solid = several_ || between(0, 1) < 0.5;
    const bool has_mask = several_ ? between(0, 1) < 0.6 : !has_solid;
    if (has_solid) text += solid();
    if (several_ && between(0, 1) < 0.5) text += solid();
    if (has_mask)
      text +=
          "[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\nthickness = \"60 nm\"\n"
          "opening = " +
          outline() + "\n";
    return text;
  }

 private:
  std::uint64_t seed_;
  bool several_;
};

class SlowRandomShifts : public Program {
 protected:
  nlohmann::json measured(const RandomWafer& wafer, const Shift& shift) const {
    write("wafer.toml", wafer.recipe(shift));
    std::filesystem::remove_all(folder_ / "run");
    const Outcome outcome = scarp("run " + path("wafer.toml") + " --quiet -o " + path("run"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages << wafer.recipe(shift);
    return json_of(scarp("measure " + path("run") + " --json"));
  }

  /// The values of one column, of all openings and sections.
  static std::vector<double> lengths(const nlohmann::json& found, const std::string& key) {
    std::vector<double> values;
    for (const auto& opening : found["openings"])
      values.push_back(opening[key].is_number() ? opening[key].get<double>() : 0);
    std::ranges::sort(values);
    return values;
  }

  static void expect_volumes(const nlohmann::json& a, const nlohmann::json& b,
                             const std::function<double(double volume)>& room) {
    ASSERT_EQ(a["volumes_nm3"].size(), b["volumes_nm3"].size());
    for (const auto& [material, volume] : a["volumes_nm3"].items()) {
      EXPECT_NEAR(b["volumes_nm3"][material].get<double>(), volume.get<double>(), room(volume))
          << material;
    }
  }

  /// The top CD has room of its own.
  static void expect_lengths(const nlohmann::json& a, const nlohmann::json& b, double room,
                             double room_at_top) {
    for (const char* const key : {"depth_nm", "top_cd_nm", "middle_cd_nm", "bottom_cd_nm"}) {
      const std::vector<double> of_a = lengths(a, key);
      const std::vector<double> of_b = lengths(b, key);
      ASSERT_EQ(of_a.size(), of_b.size());
      for (std::size_t n = 0; n < of_a.size(); ++n)
        EXPECT_NEAR(of_a[n], of_b[n], key == std::string("top_cd_nm") ? room_at_top : room) << key;
    }
  }

  /// Of all materials one upon another, with walls.
  static constexpr double area = 2 * extent[0] * extent[1];
};

TEST_F(SlowRandomShifts, ByWholeSpacingsChangeNothing) {
  for (int seed = 0; seed < 100; ++seed) {
    RandomStream random({.seed = 1000 + static_cast<std::uint64_t>(seed)});
    const RandomWafer wafer(seed, true);
    const Shift shift{grid_spacing * std::round(120 * random.uniform() - 60),
                      grid_spacing * std::round(80 * random.uniform() - 40)};
    SCOPED_TRACE(wafer.recipe({}) + wafer.recipe(shift));
    const nlohmann::json here = measured(wafer, {});
    const nlohmann::json there = measured(wafer, shift);
    expect_volumes(here, there, [](double volume) { return 1e-6 * std::abs(volume) + 1; });
    expect_lengths(here, there, 1e-3, 1e-3);
  }
}

TEST_F(SlowRandomShifts, ByPartsOfASpacingChangeVolumesAndLengthsLittle) {
  for (int seed = 0; seed < 100; ++seed) {
    RandomStream random({.seed = 2000 + static_cast<std::uint64_t>(seed)});
    const RandomWafer wafer(seed, false);
    const Shift shift{1200 * random.uniform() - 600, 800 * random.uniform() - 400};
    SCOPED_TRACE(wafer.recipe({}) + wafer.recipe(shift));
    const nlohmann::json here = measured(wafer, {});
    const nlohmann::json there = measured(wafer, shift);
    expect_volumes(here, there, [](double) { return 0.05 * grid_spacing * area; });
    // Ten percent of the depth lie on the round edge of the film, where a wall leans on both sides,
    // and the film may be as thin as a spacing.
    expect_lengths(here, there, 0.05 * grid_spacing,
                   (wafer.film() < 2 * grid_spacing ? 0.25 : 0.15) * grid_spacing);
  }
}

}  // namespace
}  // namespace scarp
