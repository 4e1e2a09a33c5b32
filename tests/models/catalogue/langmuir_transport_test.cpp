// Adsorption, desorption and reaction at points where the flux is known.

#include "models/catalogue/langmuir_transport.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class LangmuirPoint : public ModelAtPoint {
 public:
  LangmuirPoint(const std::string& keys, const std::string& material)
      : ModelAtPoint("langmuir_transport", "flux = \"1.8e18 /cm2/s\"\n" + keys, material) {}

  LangmuirPoint& under(float flux) {
    tallies_ = {flux};
    return *this;
  }
};

const std::string silicon = "reaction = { Si = \"3e17 /cm2/s\", default = \"0 /cm2/s\" }\n";

// Fluorine on silicon without ions, four to an atom.
TEST(LangmuirTransport, HasTheRateOfTheBalance) {
  LangmuirPoint point(silicon + "sticking = 0.7\nmolecules_per_atom = 4\n", "Si");
  EXPECT_NEAR(point.under(1).coverage(0), 0.80769, 5e-6);
  EXPECT_NEAR(point.under(1).speed(), -12.0671, 5e-5);
  EXPECT_NEAR(point.under(0.01F).speed(), -300 / (4 * 5.02) * 12.6 / 312.6, 1e-5);
  EXPECT_EQ(point.under(0).speed(), 0);
  EXPECT_EQ(point.under(0).coverage(0), 0);
}

// What stays is what reacts, whatever desorbs.
TEST(LangmuirTransport, WhatSticksIsWhatReacts) {
  for (const char* const desorbs : {"0 /cm2/s", "1e17 /cm2/s", "5e18 /cm2/s"}) {
    LangmuirPoint point(silicon + "desorption = \"" + desorbs + "\"\n", "Si");
    for (const float flux : {0.01F, 0.3F, 1.0F}) {
      point.under(flux);
      EXPECT_NEAR(1800 * flux * point.sticking()[0].front(), -point.speed() * 5.02,
                  1e-5 * 1800 * flux)
          << desorbs;
    }
  }
}

TEST(LangmuirTransport, WallsGiveBackAll) {
  LangmuirPoint wall(silicon + "desorption = \"1e17 /cm2/s\"\n", "SiO2");
  EXPECT_EQ(wall.under(1).sticking()[0].front(), 0);
  EXPECT_EQ(wall.speed(), 0);
  EXPECT_NEAR(wall.coverage(0), 180 / 280.0, 1e-6);
  LangmuirPoint full(silicon, "SiO2");
  EXPECT_EQ(full.under(0.5F).coverage(0), 1);
  EXPECT_EQ(full.sticking()[0].front(), 0);
  EXPECT_FALSE(read_step("langmuir_transport", "flux = \"1e18 /cm2/s\"\n" + silicon).deposits);
}

TEST(LangmuirTransport, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("langmuir_transport", keys); },
                ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  const std::string flux = "flux = \"1e18 /cm2/s\"\n";
  expect(silicon, "step[0].flux: missing");
  expect(flux, "step[0].reaction: missing");
  expect("flux = \"0 /cm2/s\"\n" + silicon, "step[0].flux: ");
  expect(flux + "reaction = { Si = \"1e17 /cm2/s\" }\n", "step[0].reaction: ");
  expect(flux + silicon + "sticking = 2\n", "step[0].sticking: 2 is outside [0, 1]");
  expect(flux + silicon + "molecules_per_atom = 0\n", "step[0].molecules_per_atom: ");
  expect(flux + "reaction = \"0 /cm2/s\"\n",
         "step[0].reaction: is 0, or the sticking is, on all that the step finds (Si, SiO2), so "
         "langmuir_transport etches nothing");
  expect(flux + silicon + "sticking = { Si = 0, default = 1 }\n", "step[0].reaction: is 0, or the");
}

}  // namespace
}  // namespace scarp
