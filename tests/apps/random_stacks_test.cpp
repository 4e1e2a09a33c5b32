// Stacks put together at random, with films down to a fiftieth of a spacing, under random etches.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include "apps/simulator/recipe.h"
#include "core/random.h"
#include "program.h"

namespace scarp {
namespace {

constexpr double spacing = 10;         // nm
constexpr double common_extent = 100;  // nm, of which every domain is a multiple
constexpr double rate = 5;             // nm/s of what is etched fastest

struct Film {
  std::string material;
  double thickness = 0;  ///< nm
};

/// Below a mask with an opening: a layer that is etched first, and films that are etched alike, 100
/// or 1000 times more slowly, or not at all, all of them by one to three steps of any kind.
class RandomStack {
 public:
  explicit RandomStack(int seed) : random_({.seed = static_cast<std::uint64_t>(seed)}) {
    std::vector<std::string> names{"SiO2", "Si3N4", "polySi", "W", "TiN", "Al2O3"};
    const int count = 2 + below(4);
    for (int n = 0; n < count; ++n) {
      const int taken = below(static_cast<int>(names.size()));
      const double spacings =
          chance(0.6) ? std::pow(10, between(std::log10(0.02), std::log10(3))) : between(3, 12);
      films.push_back({names[static_cast<std::size_t>(taken)], spacings * spacing});
      names.erase(names.begin() + taken);
      rates[films.back().material] = one_of({0, 0.001, 0.01, 1});
    }
    films.push_back({"Ge", between(4, 10) * spacing});
    rates["Ge"] = 1;
    rates["Si"] = one_of({0, 1});
    rates["resist"] = 0;
    add_domain();
    const int steps = 1 + below(3);
    for (int n = 0; n < steps; ++n) add_step();
  }

  std::string recipe;
  std::vector<Film> films;
  std::map<std::string, double> rates;  ///< of rate

 private:
  double between(double a, double b) { return a + (b - a) * random_.uniform(); }
  int below(int count) { return static_cast<int>(between(0, count)); }
  bool chance(double part) { return between(0, 1) < part; }
  double one_of(std::vector<double> values) {
    return values[static_cast<std::size_t>(below(static_cast<int>(values.size())))];
  }

  void add_domain() {
    const int mode = below(5);
    is_3d_ = mode == 4;
    const std::string hole =
        fmt::format("{{ shape = \"hole\", radius = \"{:.4g} nm\" }}", between(60, 110));
    const std::string trench =
        fmt::format("{{ shape = \"trench\", width = \"{:.4g} nm\" }}", between(90, 250));
    recipe = fmt::format("[domain]\nspacing = \"{} nm\"\n", spacing);
    if (mode < 3) recipe += "mode = \"2d\"\nextent = [\"600 nm\"]\n";
    if (mode == 3) recipe += "mode = \"axisymmetric\"\nextent = [\"300 nm\"]\n";
    if (is_3d_) recipe += "extent = [\"400 nm\", \"400 nm\"]\nsymmetry = \"auto\"\n";
    recipe += "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n";
    for (const Film& film : films)
      recipe += fmt::format(
          "[[geometry]]\nshape = \"layer\"\nmaterial = \"{}\"\nthickness = \"{:.6g} nm\"\n",
          film.material, film.thickness);
    recipe += fmt::format(
        "[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\nthickness = \"50 nm\"\n"
        "opening = {}\n",
        mode < 3 ? trench : hole);
    const std::vector<std::string> schemes{"eno2", "eno2", "first_order", "weno5"};
    recipe += fmt::format(
        "[advection]\nscheme = \"{}\"\n[flux]\ntarget_error = 0.06\nseed = {}\n"
        "[output]\nevery = \"100000 s\"\n",
        schemes[static_cast<std::size_t>(below(4))], 1 + below(1000));
  }

  std::string table(const std::string& sign) const {
    std::vector<std::string> entries;
    for (const auto& [material, part] : rates)
      entries.push_back(fmt::format("{} = \"{}{:g} nm/s\"", material, sign, part * rate));
    return fmt::format("{{ {} }}\n", fmt::join(entries, ", "));
  }

  void add_step() {
    recipe += fmt::format("[[step]]\nduration = \"{:.4g} s\"\n", between(5, 30));
    switch (below(is_3d_ ? 2 : 4)) {
      case 0:
        recipe += "model = \"isotropic\"\netch_rate = " + table("");
        return;
      case 1:
        recipe += "model = \"directional\"\ndirectional_etch_rate = " + table("");
        return;
      case 2:
        recipe += fmt::format("model = \"single_particle\"\nsticking = {:.3g}\netch_rate = {}",
                              between(0.05, 0.9), table(""));
        return;
      default:
        add_ions_and_neutrals();
    }
  }

  void add_ions_and_neutrals() {
    recipe += "model = \"multi_particle\"\n[step.rate]\n";
    for (const auto& [material, part] : rates)
      recipe += fmt::format("{} = \"{:g} nm/s * F + {:g} nm/s * F^0.5 * enhanced\"\n", material,
                            -0.5 * part * rate, -0.5 * part * rate);
    recipe += fmt::format(
        "[[step.neutral]]\nname = \"F\"\nsticking = {{ default = {:.3g} }}\n"
        "[[step.ion]]\nname = \"ion\"\nsource_power = 300\nenergy = \"100 eV\"\n"
        "[[step.ion.yield]]\nname = \"enhanced\"\namplitude = 1\nthreshold = \"15 eV\"\n"
        "angular = \"enhanced\"\n",
        between(0.05, 0.5));
  }

  RandomStream random_;
  bool is_3d_ = false;
};

class SlowRandomStacks : public Program {
 protected:
  /// A film that no node knows of may be refused, with a spacing with which the recipe is read.
  void expect_refusal_with_remedy(const std::string& message) const {
    static const std::regex words(
        "a film of ([0-9.e-]+) nm is thinner.* use a domain.spacing of ([0-9.e-]+) nm or less");
    std::smatch found;
    ASSERT_TRUE(std::regex_search(message, found, words)) << message;
    EXPECT_LT(std::stod(found[1]), 0.05 * spacing);
    const double finer = common_extent / std::ceil(common_extent / std::stod(found[2]));
    EXPECT_NO_THROW(read_recipe(
        recipe_in(folder_ / "stack.toml", {fmt::format("domain.spacing=\"{:.17g} nm\"", finer)})));
  }

  nlohmann::json volumes(const std::string& state) const {
    return json_of(scarp("measure " + path(state) + " --json"))["volumes_nm3"];
  }
};

TEST_F(SlowRandomStacks, KeepWhatIsNotEtchedAndNothingThatIsGone) {
  constexpr int count = 500;
  int refused = 0;
  for (int seed = 0; seed < count; ++seed) {
    const RandomStack stack(seed);
    write("stack.toml", stack.recipe);
    std::filesystem::remove_all(folder_ / "run");
    const Outcome outcome = scarp("run " + path("stack.toml") + " --quiet -o " + path("run"));
    if (outcome.exit_code == 2) {
      SCOPED_TRACE(stack.recipe);
      expect_refusal_with_remedy(outcome.messages);
      ++refused;
      continue;
    }
    ASSERT_EQ(outcome.exit_code, 0) << outcome.messages << stack.recipe;
    const nlohmann::json before = volumes("run/state_0000.vdb");
    const nlohmann::json after = volumes("run");
    for (const auto& [material, thickness] : stack.films) {
      const double volume = before[material];
      const double left = after.value(material, 0.0);
      if (stack.rates.at(material) == 0) {
        EXPECT_NEAR(left, volume, 0.01 * volume) << seed << stack.recipe;
      }
      // What remains of a material that is told of is no rounding.
      const double of_a_spacing = volume / thickness * spacing;
      if (after.contains(material)) {
        EXPECT_GT(left, 1e-4 * of_a_spacing) << material << " " << seed << stack.recipe;
      }
    }
  }
  EXPECT_LE(refused, count / 20);
}

}  // namespace
}  // namespace scarp
