// Growth by powers of what arrives, at points where all fluxes are known.

#include "models/catalogue/teos.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class TeosPoint : public ModelAtPoint {
 public:
  TeosPoint(const std::string& model, const std::string& keys)
      : ModelAtPoint(model, "material = \"SiO2\"\n" + keys, "Si") {}

  TeosPoint& under(std::vector<float> tallies) {
    tallies_ = std::move(tallies);
    return *this;
  }
};

std::string precursor(double order, double sticking = 0.1) {
  return "[[step.precursor]]\ngrowth_rate = \"4 nm/s\"\norder = " + std::to_string(order) +
         "\nsticking = " + std::to_string(sticking) + "\n";
}

TEST(Teos, GrowsByThePowerOfTheFlux) {
  for (const double order : {0.5, 1.0, 2.0}) {
    TeosPoint point("teos", precursor(order));
    EXPECT_FLOAT_EQ(point.under({1}).speed(), 4);
    EXPECT_NEAR(point.under({0.25}).speed(), 4 * std::pow(0.25, order), 1e-6);
    EXPECT_EQ(point.under({0}).speed(), 0);
  }
  TeosPoint two("teos", precursor(1) + precursor(0.5));
  EXPECT_FLOAT_EQ(two.under({0.5, 0.25}).speed(), 2 + 2);
  EXPECT_EQ(two.species()[1].name, "precursor_2");
  EXPECT_EQ(read_step("teos", "material = \"SiO2\"\n" + precursor(1)).deposits,
            Materials().id("SiO2"));
}

// s theta^(m - 1); where nothing is covered an order above 1 takes nothing, one below 1 all.
TEST(Teos, StickingFollowsWhatIsCovered) {
  TeosPoint half("teos", precursor(0.5));
  EXPECT_FLOAT_EQ(half.under({1}).sticking()[0].front(), 0.1F);
  EXPECT_FLOAT_EQ(half.under({0.25}).sticking()[0].front(), 0.2F);
  EXPECT_FLOAT_EQ(half.under({1.7F}).sticking()[0].front(), 0.1F);
  EXPECT_FLOAT_EQ(half.under({1e-6F}).sticking()[0].front(), 1);
  EXPECT_EQ(half.under({0}).sticking()[0].front(), 1);
  TeosPoint never("teos", precursor(0.5, 0));
  EXPECT_EQ(never.under({0.25}).sticking()[0].front(), 0);
  EXPECT_EQ(never.under({0}).sticking()[0].front(), 0);
  TeosPoint second("teos", precursor(2));
  EXPECT_FLOAT_EQ(second.under({0.25}).sticking()[0].front(), 0.025F);
  EXPECT_EQ(second.under({0}).sticking()[0].front(), 0);
  // Of the first order it is constant, and no coverage is kept.
  TeosPoint mixed("teos", precursor(1) + precursor(2));
  EXPECT_EQ(coverage_names(&mixed.model()), std::vector<std::string>{"precursor_2"});
  EXPECT_TRUE(mixed.under({0.5, 0.5}).sticking()[0].empty());
  EXPECT_FLOAT_EQ(mixed.sticking()[1].front(), 0.05F);
  EXPECT_EQ(TeosPoint("teos", precursor(1)).model().coverages(), nullptr);
}

TEST(PecvdTeos, RadicalsAndIonsAddUp) {
  const std::string keys =
      "radical_growth_rate = \"4 nm/s\"\nradical_order = 0.5\n[[step.ion]]\n"
      "growth_rate = \"1 nm/s\"\norder = 2\nsource_power = 50\n";
  TeosPoint point("pecvd_teos", keys);
  EXPECT_FLOAT_EQ(point.under({1, 1}).speed(), 5);
  EXPECT_FLOAT_EQ(point.under({0.25, 0.5}).speed(), 2 + 0.25);
  EXPECT_EQ(coverage_names(&point.model()), std::vector<std::string>{"radical"});
  ASSERT_EQ(point.species().size(), 2U);
  EXPECT_TRUE(point.species()[1].ions.has_value());
  EXPECT_EQ(point.species()[1].source.cosine_power, 50);
  EXPECT_TRUE(point.model().angular().is_mirror_symmetric(0));
  const std::string tilted = "material = \"SiO2\"\n" + keys + "tilt = \"5 deg\"\n";
  EXPECT_FALSE(read_step("pecvd_teos", tilted).model->angular().is_mirror_symmetric(0));
}

TEST(Teos, SaysWhatIsWrong) {
  const auto expect = [](const std::string& model, const std::string& keys,
                         const std::string& message) {
    EXPECT_THAT([&] { read_step(model, keys); }, ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  const std::string oxide = "material = \"SiO2\"\n";
  expect("teos", precursor(1), "step[0].material: missing");
  expect("teos", oxide, "step[0].precursor[0].growth_rate: missing");
  expect("teos", oxide + precursor(2.5), "step[0].precursor[0].order: 2.5 is outside [0.01, 2]");
  expect("teos", oxide + precursor(1, 1.5), "step[0].precursor[0].sticking: 1.5 is outside");
  expect("pecvd_teos", oxide + "[[step.ion]]\ngrowth_rate = \"1 nm/s\"\n",
         "step[0].radical_growth_rate: missing");
  expect("pecvd_teos", oxide + "radical_growth_rate = \"1 nm/s\"\n",
         "step[0].ion[0].growth_rate: missing");
}

}  // namespace
}  // namespace scarp
