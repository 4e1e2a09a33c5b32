// What dissolves and settles at points where the concentration is known.

#include "models/catalogue/oxide_regrowth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const std::vector<std::string> stack{"Si", "SiO2", "Si3N4"};
const std::string keys =
    "material = \"SiO2\"\nsettling_rate = \"50 nm/s\"\nsaturation = \"4e18 /cm3\"\n";

std::shared_ptr<const SurfaceModel> model_of(const std::string& more) {
  return read_step("oxide_regrowth", keys + more, false, stack).model;
}

TEST(OxideRegrowth, EtchesNitrideAndGrowsOxideWhereTheBathIsMoreThanSaturated) {
  const auto model = model_of(
      "etch_rate = { Si3N4 = \"6 nm/min\", SiO2 = \"0.3 nm/min\", "
      "default = \"0 nm/s\" }\n");
  const Points points({"Si3N4", "SiO2", "SiO2", "SiO2", "Si"});
  const std::vector<float> c{1.5F, 0.5F, 1.0F, 1.5F, 1.5F};
  const std::vector<std::span<const float>> tallies{c};
  const std::vector<float> v = model->speeds(points, tallies);
  EXPECT_FLOAT_EQ(v[0], -0.1F);
  EXPECT_FLOAT_EQ(v[1], -0.005F);
  EXPECT_FLOAT_EQ(v[2], -0.005F);
  EXPECT_FLOAT_EQ(v[3], static_cast<float>(50 * 0.5 * 4e-4 / 2.2 - 0.005));
  EXPECT_EQ(v[4], 0);
}

// Silica that leaves the solid is in the bath, and the other way round.
TEST(OxideRegrowth, GivesTheBathWhatItTakesOffTheSolid) {
  const auto model = model_of(
      "etch_rate = { Si3N4 = \"6 nm/min\", SiO2 = \"0.3 nm/min\", "
      "default = \"0 nm/s\" }\n");
  const Points points({"Si3N4", "SiO2", "Si"});
  const std::vector<float> c{3, 3, 3};
  const std::vector<std::span<const float>> tallies{c};
  const std::vector<float> v = model->speeds(points, tallies);
  const std::vector<Exchange> exchange = model->bath()->exchange(points);
  const std::array<double, 3> silica{3 * 2.3, 2.2, 0};  // in a volume
  for (std::size_t p = 0; p < 3; ++p) {
    const double given = 4e-4 * (exchange[p].release - exchange[p].uptake * (3 - 1));
    EXPECT_NEAR(given, -v[p] * silica[p], 1e-6) << p;
  }
}

TEST(OxideRegrowth, HandsItsSoluteToTheBath) {
  const StepModel step =
      read_step("oxide_regrowth",
                keys +
                    "bath_concentration = \"1e18 /cm3\"\ndiffusivity = \"5e-7 cm2/s\"\n"
                    "boundary_layer = \"3 um\"\n",
                false, stack);
  EXPECT_EQ(step.deposits, Materials().id("SiO2"));
  EXPECT_TRUE(step.model->species().empty());
  const Solute solute = step.model->bath()->solute();
  EXPECT_EQ(solute.bath, 0.25);
  EXPECT_EQ(solute.diffusivity, 5e7);
  EXPECT_EQ(solute.layer, 3000);
}

TEST(OxideRegrowth, SaysWhatIsWrong) {
  const auto expect = [](const std::string& all_keys, const std::string& message,
                         const std::vector<std::string>& wafer = stack) {
    EXPECT_THAT([&] { read_step("oxide_regrowth", all_keys, false, wafer); },
                ThrowsMessage<InputError>(HasSubstr(message)))
        << all_keys;
  };
  expect("settling_rate = \"1 nm/s\"\n", "step[0].material: missing");
  expect("material = \"SiO2\"\n", "step[0].settling_rate: missing");
  expect(keys + "saturation = \"0 /cm3\"\n", "saturation");
  expect(keys + "diffusivity = \"0 cm2/s\"\n", "step[0].diffusivity: ");
  expect(keys + "diffusivity = \"5 nm\"\n", "step[0].diffusivity: \"5 nm\" is a length");
  expect(keys + "boundary_layer = \"0 nm\"\n", "step[0].boundary_layer: ");
  expect(keys + "etch_rate = { Si = \"-1 nm/s\", default = \"0 nm/s\" }\n", "step[0].etch_rate");
  expect(keys, "step[0].etch_rate: is 0 on all that the step finds (Si), and nothing settles there",
         {"Si"});
}

}  // namespace
}  // namespace scarp
