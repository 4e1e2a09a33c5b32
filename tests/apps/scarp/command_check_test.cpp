// scarp check as a user calls it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

using CheckCommand = Program;

TEST_F(CheckCommand, GivesRatesOnAnOpenWaferAndSelectivities) {
  write("etch.toml", silicon_wafer + R"([[geometry]]
shape = "mask"
material = "resist"
thickness = "100 nm"
opening = { shape = "trench", width = "100 nm" }
[[step]]
name = "etch"
model = "isotropic"
duration = "10 s"
etch_rate = { Si = "4 nm/s", default = "0.125 nm/s" }
)");
  const auto rates = json_of(scarp("check --json " + path("etch.toml")))["blanket_rates"];
  ASSERT_EQ(rates.size(), 1U);
  EXPECT_EQ(rates[0]["name"], "etch");
  EXPECT_EQ(rates[0]["rates_nm_s"], nlohmann::json({{"Si", -4.0}, {"resist", -0.125}}));
  EXPECT_EQ(rates[0]["selectivity_of"], "Si");
  EXPECT_EQ(rates[0]["selectivity_to"], nlohmann::json({{"resist", 32.0}}));
  EXPECT_THAT(scarp("check " + path("etch.toml")).out,
              HasSubstr("#   etch: Si -240 nm/min, resist -7.5 nm/min; Si : resist 32\n"));
}

}  // namespace
}  // namespace scarp
