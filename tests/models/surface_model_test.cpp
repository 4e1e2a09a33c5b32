#include "models/surface_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "flux/source_lobe.h"
#include "models/lobe_response.h"
#include "models/open_response.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

/// Etches by a power of what a lobe of ions brings, on top of what a gas does.
class PowerOfIons : public SurfaceModel {
 public:
  PowerOfIons(double power, float of_gas, SourceLobe source = {.cosine_power = 1000})
      : SurfaceModel(
            {{.name = "gas"},
             {.name = "ions", .source = std::move(source), .yields = {{.name = "sputter"}}}}),
        power_(power),
        of_gas_(of_gas) {}

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override {
    std::vector<float> speeds(points.material.size());
    for (std::size_t p = 0; p < speeds.size(); ++p)
      speeds[p] = of_gas_ * flux[0][p] - static_cast<float>(std::pow(flux[2][p], power_));
    return speeds;
  }

 private:
  double power_;
  float of_gas_;
};

/// Surfaces that lean by angles towards x. Units: degrees.
std::vector<Vec3f> leaning(std::initializer_list<double> angles) {
  std::vector<Vec3f> normals;
  for (const double degrees : angles) {
    const double slope = degrees * (M_PI / 180);
    normals.push_back(
        {static_cast<float>(std::sin(slope)), 0, static_cast<float>(std::cos(slope))});
  }
  return normals;
}

/// With the amplitudes of a point, at any normal.
double speed_at(const std::vector<std::vector<float>>& parts,
                const std::vector<AngularFactor>& factors, std::size_t point, Vec3f normal) {
  double speed = parts[0][point];
  for (std::size_t k = 0; k < factors.size(); ++k)
    speed += static_cast<double>(parts[1 + k][point] * factors[k].value(normal));
  return speed;
}

/// A flat point and slopes up to a wall, all of which see the source.
struct Slopes {
  explicit Slopes(const PowerOfIons& of) : model(of) {
    for (const Vec3f n : normals) ions.push_back(std::max(0.0F, n.z));
    materials.resize(normals.size());
    gas.assign(normals.size(), 1.0F);
    tallies = {gas, ions, ions};
    factors = model.angular().factors();
    parts = model.angular().amplitudes(points(), tallies, factors);
  }

  SurfacePoints points() const { return {.material = materials, .normal = normals}; }
  double at(std::size_t point, Vec3f normal) const {
    return speed_at(parts, factors, point, normal);
  }

  const PowerOfIons& model;
  std::vector<Vec3f> normals = leaning({0, 10, 30, 45, 60, 80, 89, 90, 120});
  std::vector<MaterialId> materials;
  std::vector<float> gas;
  std::vector<float> ions;
  std::vector<std::span<const float>> tallies;
  std::vector<std::vector<float>> parts;
  std::vector<AngularFactor> factors;
};

TEST(TurningSpeeds, AreThoseOfTheModelAtItsOwnNormals) {
  for (const float of_gas : {0.0F, -0.3F, 0.5F, 2.0F}) {
    for (const double power : {0.5, 1.0, 2.0, 5.0}) {
      const PowerOfIons model(power, of_gas);
      const Slopes slopes(model);
      const std::vector<float> speeds = model.speeds(slopes.points(), slopes.tallies);
      for (std::size_t p = 0; p < speeds.size(); ++p)
        EXPECT_NEAR(slopes.at(p, slopes.normals[p]), speeds[p], 1e-4) << of_gas << ' ' << power;
    }
  }
}

TEST(TurningSpeeds, AreThoseOfTheModelAtOtherNormals) {
  constexpr std::size_t count = 6;  // from 0 to 80 degrees
  for (const double power : {0.5, 1.0, 1.7, 2.0, 3.0}) {
    const PowerOfIons model(power, -0.2F);
    const Slopes slopes(model);
    for (std::size_t p = 0; p < count; ++p) {
      for (std::size_t q = 0; q < count; ++q) {
        const double exact = -0.2 - std::pow(slopes.normals[q].z, power);
        EXPECT_NEAR(slopes.at(p, slopes.normals[q]), exact, 0.02) << power << ' ' << p << ' ' << q;
      }
    }
  }
}

// The floor of a hole goes on nearly as fast with fewer ions, the wall that it leaves behind gets
// none of them.
TEST(TurningSpeeds, LeaveToAWallWhatThereIsWithoutIons) {
  for (const float of_gas : {0.0F, -0.2F}) {
    for (const double power : {0.1, 0.5, 1.0}) {
      const PowerOfIons model(power, of_gas);
      const Slopes slopes(model);
      EXPECT_NEAR(slopes.at(0, {0, 0, 1}), of_gas - 1, 1e-5) << power;
      EXPECT_NEAR(slopes.at(0, {1, 0, 0}), of_gas, 2e-4) << power;
    }
  }
}

// What etches must not grow anywhere, whatever the normal of the grid.
TEST(TurningSpeeds, HaveOneSign) {
  for (const double power : {0.5, 1.0, 2.0, 3.0, 7.0}) {
    const PowerOfIons model(power, -0.1F);
    const Slopes slopes(model);
    for (const std::vector<float>& part : slopes.parts)
      for (const float value : part) EXPECT_LE(value, 0) << power;
  }
}

// The speed of a wall that ions graze turns no faster than a floor goes.
TEST(TurningSpeeds, AreBounded) {
  const PowerOfIons model(1, 0);
  Slopes slopes(model);
  std::ranges::fill(slopes.ions, 1.0F);  // most of it reflected
  const auto parts = model.angular().amplitudes(slopes.points(), slopes.tallies, slopes.factors);
  for (const float amplitude : parts[1]) {
    EXPECT_LE(std::abs(amplitude), 1.001F);
    EXPECT_TRUE(std::isfinite(amplitude));
  }
}

/// Slopes under ions whose yield is largest at a slant, beside a gas that etches too.
struct SlopesUnderSputtering {
  SlopesUnderSputtering() {
    const std::vector<Species> all = model->species();
    const OpenResponse response(all[1], all[1].yields[0]);
    for (const Vec3f n : normals) {
      open.push_back(static_cast<float>(response.at(Vec3d(n))));
      arrivals.push_back(std::max(0.0F, n.z));
    }
    gas.assign(normals.size(), 1.0F);
    materials.resize(normals.size());
  }

  /// speed[p][q] is that with the amplitudes of slope p at the normal of slope q.
  std::vector<std::vector<double>> speeds(const std::vector<float>& yield) const {
    const SurfacePoints points{.material = materials, .normal = normals};
    const std::vector<std::span<const float>> tallies{gas, arrivals, yield};
    const std::vector<AngularFactor> factors = model->angular().factors();
    const auto parts = model->angular().amplitudes(points, tallies, factors);
    std::vector<std::vector<double>> all(normals.size());
    for (std::size_t p = 0; p < normals.size(); ++p) {
      for (const Vec3f n : normals) all[p].push_back(speed_at(parts, factors, p, n));
    }
    return all;
  }

  std::shared_ptr<const SurfaceModel> model = read_step("multi_particle", R"(
rate = "-0.5 nm/s * gas - 2 nm/s * etch"
[[step.neutral]]
name = "gas"
[[step.ion]]
name = "ion"
[[step.ion.yield]]
name = "etch"
amplitude = 0.1
angular = "sputter"
)")
                                                  .model;
  std::vector<Vec3f> normals = leaning({0, 10, 20, 30, 40, 50, 60, 70, 80, 90});
  std::vector<MaterialId> materials;
  std::vector<float> gas;
  std::vector<float> arrivals;
  std::vector<float> open;
};

TEST(PeakedYield, TurnsWithTheNormalAsItDoes) {
  const SlopesUnderSputtering slopes;
  const auto speeds = slopes.speeds(slopes.open);
  // On a wall ions only graze, which tells little.
  for (std::size_t p = 0; p + 1 < slopes.open.size(); ++p)
    for (std::size_t q = 0; q < slopes.open.size(); ++q)
      EXPECT_NEAR(speeds[p][q], -0.5 - 2 * slopes.open[q], 0.01) << p << ' ' << q;
}

// Below a thousandth of the best a wall is left to the rest of the speed.
TEST(PeakedYield, TurnsNothingThatIonsOnlyGraze) {
  const StepModel step = read_step("multi_particle", R"(
rate = "-2 nm/s * etch"
[[step.ion]]
name = "ion"
source_power = 10000
[[step.ion.yield]]
name = "etch"
amplitude = 0.1
angular = "sputter"
)");
  const std::vector<AngularFactor> factors = step.model->angular().factors();
  const AngularFactor& factor = factors.back();
  for (const double part : {1.4e-3, 0.7e-3}) {
    double low = 80;
    double high = 90;
    for (int n = 0; n < 50; ++n) {
      const double middle = 0.5 * (low + high);
      const bool has_more = factor.value(leaning({middle})[0]) > part * factor.bounds().value;
      (has_more ? low : high) = middle;
    }
    const std::vector<Vec3f> normals = leaning({0, low});
    const std::vector<MaterialId> materials(2);
    const std::vector<float> arrivals{1, 1e-3F};
    const std::vector<float> yield{factor.value(normals[0]), factor.value(normals[1])};
    const std::vector<std::span<const float>> tallies{arrivals, yield};
    const std::vector<float> amplitude =
        step.model->angular()
            .amplitudes({.material = materials, .normal = normals}, tallies, factors)
            .back();
    EXPECT_NEAR(amplitude[0], -2, 0.01);
    EXPECT_NEAR(amplitude[1], part > 1e-3 ? -2 : 0, 0.01) << part << " at " << low;
  }
}

// Half of the source in sight; and twice as much as there is, half of it from other walls.
TEST(PeakedYield, TurnsAsFarAsItComesStraight) {
  const SlopesUnderSputtering slopes;
  std::vector<float> half = slopes.open;
  for (float& yield : half) yield /= 2;
  std::vector<float> twice = slopes.open;
  for (float& yield : twice) yield *= 2;
  const auto shaded = slopes.speeds(half);
  const auto reflected = slopes.speeds(twice);
  for (std::size_t p = 0; p + 1 < slopes.open.size(); ++p) {
    for (std::size_t q = 0; q < slopes.open.size(); ++q) {
      EXPECT_NEAR(shaded[p][q], -0.5 - slopes.open[q], 0.01) << p << ' ' << q;
      EXPECT_NEAR(reflected[p][q], -0.5 - 2 * (slopes.open[p] + slopes.open[q]), 0.02)
          << p << ' ' << q;
    }
  }
}

// Sums are followed, whatever is left of them; of products and quotients no part is counted twice.
TEST(PeakedYield, LeavesSpeedsAtTheirNormalsAsTheyAre) {
  for (const std::string rate :
       {"-1 nm/s * etch - 1 nm/s * more", "10 nm/s - 8 nm/s * etch - 12 nm/s * more",
        "-1 nm/s * etch * more", "-1 nm/s * etch * ion", "-1 nm/s * etch / max(ion, 0.001)",
        "-1 nm/s * etch / (etch + 0.1)", "-1 nm/s * etch^2"}) {
    const StepModel step = read_step("multi_particle", "material = \"Si\"\nrate = \"" + rate + R"("
[[step.ion]]
name = "ion"
source_power = 1000
[[step.ion.yield]]
name = "etch"
amplitude = 0.1
angular = "sputter"
[[step.ion.yield]]
name = "more"
amplitude = 0.1
angular = "sputter"
sputter_factor = 5
)");
    const Species ions = step.model->species().front();
    const SlopesUnderSputtering slopes;
    std::vector<std::vector<float>> tallies{slopes.arrivals};
    for (const YieldLaw& law : ions.yields) {
      std::vector<float>& tally = tallies.emplace_back();
      for (const Vec3f n : slopes.normals)
        tally.push_back(static_cast<float>(OpenResponse(ions, law).at(Vec3d(n))));
    }
    const std::vector<std::span<const float>> flux(tallies.begin(), tallies.end());
    const SurfacePoints points{.material = slopes.materials, .normal = slopes.normals};
    const std::vector<float> speeds = step.model->speeds(points, flux);
    const std::vector<AngularFactor> factors = step.model->angular().factors();
    const auto parts = step.model->angular().amplitudes(points, flux, factors);
    for (std::size_t p = 0; p < speeds.size(); ++p) {
      EXPECT_NEAR(speed_at(parts, factors, p, slopes.normals[p]), speeds[p],
                  1e-4 * (1 + std::abs(speeds[p])))
          << rate << ' ' << p;
      if (rate.front() == '-') {
        EXPECT_LE(parts[0][p], 0) << rate << ' ' << p;
      }
    }
  }
}

// The same yield by its law and by a table of energies and angles; and one without a peak. The
// square of a yield is no sum, in which a peaked one alone has a factor of its own.
TEST(PeakedYield, IsFoundInTables) {
  const auto is_peaked = [](const std::string& yield) {
    const std::string keys =
        "rate = \"-1 nm/s * etch^2\"\n[[step.ion]]\nname = \"ion\"\n"
        "[[step.ion.yield]]\nname = \"etch\"\n" +
        yield;
    const StepModel step = read_step("multi_particle", keys);
    const std::vector<AngularFactor> factors = step.model->angular().factors();
    const std::vector<float> one{1};
    const std::vector<std::span<const float>> flux{one, one};
    const std::vector<MaterialId> materials(1);
    const std::vector<Vec3f> up{{0, 0, 1}};
    const bool has_factor = factors.size() > lobe_factor_count;
    if (has_factor) {
      EXPECT_EQ(step.model->angular()
                    .amplitudes({.material = materials, .normal = up}, flux, factors)
                    .back()
                    .front(),
                0);
    }
    return has_factor;
  };
  EXPECT_FALSE(is_peaked("amplitude = 1\nangular = \"cosine\"\n"));
  EXPECT_TRUE(is_peaked("amplitude = 1\nangular = \"sputter\"\n"));
  EXPECT_TRUE(
      is_peaked("amplitude = 1\nangular_table = [[\"0 deg\", 1], [\"60 deg\", 4], "
                "[\"90 deg\", 0]]\n"));
  const auto table = [&](const char* at_60) {
    std::string rows;
    for (const char* energy : {"0 eV", "1000 eV"})
      rows += std::string("[\"") + energy + "\", \"0 deg\", 1], [\"" + energy + "\", \"60 deg\", " +
              at_60 + "], [\"" + energy + "\", \"90 deg\", 0], ";
    return is_peaked("table = [" + rows + "]\n");
  };
  EXPECT_TRUE(table("4"));
  EXPECT_FALSE(table("0.5"));
}

/// Slopes under ions with a yield that is as on a flat surface up to 60 degrees, and from there on
/// falls to 0, and with one that is largest at a slant.
struct SlopesUnderFadingIons {
  explicit SlopesUnderFadingIons(const std::string& rate, const std::string& second = "sputter")
      : model(read_step("multi_particle", "rate = \"" + rate + R"("
[[step.ion]]
name = "ion"
source_power = 1e5
[[step.ion.yield]]
name = "etch"
amplitude = 0.1
angular = "enhanced"
[[step.ion.yield]]
name = "second"
amplitude = 0.1
angular = ")" + second + "\"\n")
                  .model) {
    const Species ions = model->species().front();
    for (const Vec3f n : normals) tallies[0].push_back(n.z);
    for (std::size_t y = 0; y < 2; ++y) {
      const OpenResponse response(ions, ions.yields[y]);
      for (const Vec3f n : normals)
        tallies[1 + y].push_back(static_cast<float>(response.at(Vec3d(n))));
    }
    ask();
  }

  void ask() {
    const std::vector<MaterialId> materials(normals.size());
    const std::vector<std::span<const float>> flux(tallies.begin(), tallies.end());
    const SurfacePoints points{.material = materials, .normal = normals};
    expected = model->speeds(points, flux);
    parts = model->angular().amplitudes(points, flux, factors);
  }

  /// With the amplitudes of slope p at the normal of slope q.
  double at(std::size_t p, std::size_t q) const { return speed_at(parts, factors, p, normals[q]); }

  std::shared_ptr<const SurfaceModel> model;
  std::vector<Vec3f> normals = leaning({0, 30, 50, 65, 75, 80, 85});
  std::array<std::vector<float>, 3> tallies;
  std::vector<AngularFactor> factors = model->angular().factors();
  std::vector<float> expected;
  std::vector<std::vector<float>> parts;
};

TEST(FadingYield, TurnsWithTheNormalAsItDoes) {
  for (const char* rate : {"-2 nm/s * etch", "-2 nm/s * ion", "-1 nm/s * etch - 1 nm/s * ion",
                           "-1 nm/s * etch - 3 nm/s * ion"}) {
    const SlopesUnderFadingIons slopes(rate);
    for (std::size_t p = 0; p < slopes.normals.size(); ++p) {
      for (std::size_t q = 0; q < slopes.normals.size(); ++q)
        EXPECT_NEAR(slopes.at(p, q), slopes.expected[q], 0.01) << rate << ' ' << p << ' ' << q;
    }
  }
}

// Where a wall has its foot, at 75 degrees, the speed of a floor is that of the model, also of one
// that goes on nearly as fast with fewer ions; and above it, it is little as well.
TEST(FadingYield, IsFollowedToTheFootOfAWall) {
  constexpr std::size_t foot = 4;
  const auto check = [](const std::string& rate, double within) {
    const SlopesUnderFadingIons slopes(rate);
    for (std::size_t q = 0; q < slopes.normals.size(); ++q)
      EXPECT_NEAR(slopes.at(q, q), slopes.expected[q], 1e-4) << rate << ' ' << q;
    for (std::size_t q = foot; q < slopes.normals.size(); ++q)
      EXPECT_NEAR(slopes.at(0, q), slopes.expected[q], q == foot ? within : 0.1)
          << rate << ' ' << q;
    for (const std::vector<float>& part : slopes.parts)
      for (const float value : part) EXPECT_LE(value, 0) << rate;
  };
  check("-2 nm/s * etch^0.9", 0.02);
  check("-4 nm/s * etch / (1 + etch)", 0.02);
  check("-2 nm/s * etch * ion", 0.12);
  check("-2 nm/s * etch^2", 0.12);
}

// Of a product the peaked yield has no factor of its own: the model is asked with what it would be
// on another slope. So are yields that fall off by other laws.
TEST(FadingYield, IsFollowedBesideOthers) {
  const auto check = [](const std::string& rate, const std::string& second) {
    const SlopesUnderFadingIons slopes(rate, second);
    const float most = -std::ranges::min(slopes.expected);
    for (std::size_t q = 0; q < slopes.normals.size(); ++q)
      EXPECT_NEAR(slopes.at(0, q), slopes.expected[q], 0.06F * most)
          << rate << ' ' << second << ' ' << q;
  };
  check("-2 nm/s * etch * second", "sputter");
  check("-1 nm/s * etch - 1 nm/s * second", "cosine");
  check("-2 nm/s * etch / (0.2 + second)", "cosine");
}

// Steep slopes get as much as a floor, most of it reflected.
TEST(FadingYield, TurnsAWallNoFasterThanAFloor) {
  SlopesUnderFadingIons slopes("-2 nm/s * etch");
  const double floor = std::abs(slopes.at(0, 0));
  for (std::vector<float>& tally : slopes.tallies) std::ranges::fill(tally, tally.front());
  slopes.ask();
  for (std::size_t p = 0; p < slopes.normals.size(); ++p) {
    EXPECT_LE(std::abs(slopes.at(p, 0) - slopes.parts[0][p]), 1.001 * floor) << p;
    EXPECT_NEAR(slopes.at(p, p), slopes.expected[p], 1e-4) << p;
  }
}

// Ions from above and from aside, each with both kinds of yields.
TEST(FadingYield, OfTwoLobesAddsUpToTheSpeedAtTheOwnNormal) {
  const auto ions = [](const std::string& name, const std::string& tilt) {
    std::string keys = "[[step.ion]]\nname = \"" + name + "\"\nsource_power = 1e4\n" + tilt;
    for (const char* angular : {"enhanced", "sputter"})
      keys += "[[step.ion.yield]]\nname = \"" + name + "_" + angular +
              "\"\namplitude = 0.1\nangular = \"" + angular + "\"\n";
    return keys;
  };
  for (const std::string rate :
       {"-1 nm/s * a_enhanced - 2 nm/s * a_sputter - 3 nm/s * b_enhanced - 4 nm/s * b_sputter",
        "-1 nm/s * a_enhanced * b_enhanced - 1 nm/s * a_sputter * b_sputter"}) {
    const StepModel step = read_step("multi_particle", "rate = \"" + rate + "\"\n" + ions("a", "") +
                                                           ions("b", "tilt = \"20 deg\"\n"));
    const std::vector<AngularFactor> factors = step.model->angular().factors();
    ASSERT_EQ(factors.size(), 2 * lobe_factor_count + 2);
    const std::vector<Vec3f> normals = leaning({0, 20, 40, 60, 80, 89});
    const std::vector<MaterialId> materials(normals.size());
    std::vector<std::vector<float>> tallies(6);
    for (std::size_t t = 0; t < tallies.size(); ++t)
      for (std::size_t p = 0; p < normals.size(); ++p)
        tallies[t].push_back(0.1F + 0.3F * static_cast<float>((7 * t + 3 * p) % 5));
    const std::vector<std::span<const float>> flux(tallies.begin(), tallies.end());
    const SurfacePoints points{.material = materials, .normal = normals};
    const std::vector<float> speeds = step.model->speeds(points, flux);
    const auto parts = step.model->angular().amplitudes(points, flux, factors);
    for (std::size_t p = 0; p < normals.size(); ++p)
      EXPECT_NEAR(speed_at(parts, factors, p, normals[p]), speeds[p], 1e-4) << rate << ' ' << p;
  }
}

/// A floor that gets as much of every tally as an open wafer, and what its amplitudes say of other
/// normals.
class OpenFloor {
 public:
  OpenFloor(const std::string& rate, const std::string& ions)
      : model_(read_step("multi_particle", "material = \"Si\"\nrate = \"" + rate + "\"\n" + ions)
                   .model),
        factors_(model_->angular().factors()) {
    std::size_t tallies = 0;
    for (const Species& each : model_->species()) tallies += 1 + each.yields.size();
    const std::vector<float> one{1};
    const std::vector<std::span<const float>> flux(tallies, one);
    const std::vector<MaterialId> materials(1);
    const std::vector<Vec3f> up{{0, 0, 1}};
    parts_ = model_->angular().amplitudes({.material = materials, .normal = up}, flux, factors_);
  }

  Vec3f against_ions() const { return Vec3f(-1.0 * model_->species().front().source.direction); }
  double at(Vec3f normal) const { return speed_at(parts_, factors_, 0, normal); }

 private:
  std::shared_ptr<const SurfaceModel> model_;
  std::vector<AngularFactor> factors_;
  std::vector<std::vector<float>> parts_;
};

// A wall that a floor leaves behind gets no ions, and grows by what the gas brings: also if the
// ions are of two kinds from nearly the same direction. Of a product nothing is left without one of
// them.
TEST(TurningSpeeds, OfTwoLobesLeaveToAWallWhatThereIsWithoutIons) {
  const auto of_wall = [](const std::string& rate) {
    return OpenFloor(rate,
                     "[[step.ion]]\nname = \"a\"\n[[step.ion]]\nname = \"b\"\n"
                     "tilt = \"0.001 deg\"\n")
        .at({0, 1, 0});
  };
  EXPECT_NEAR(of_wall("10 nm/s - 15 nm/s * a^2 - 15 nm/s * b^2"), 10, 0.01);
  EXPECT_NEAR(of_wall("20 nm/s * a - 40 nm/s * b"), 0, 0.01);
  EXPECT_NEAR(of_wall("5 nm/s - 20 nm/s * a * b"), 5, 0.01);
}

// A floor that ions from the side meet at 60 degrees, and nothing else: what faces them gets twice
// as many, what they pass none.
TEST(TurningSpeeds, OfATiltedLobeFollowTheCosineOfItsAngle) {
  const OpenFloor floor("-10 nm/s * a",
                        "[[step.ion]]\nname = \"a\"\nsource_power = 1e6\ntilt = \"60 deg\"\n");
  const Vec3f facing = floor.against_ions();
  EXPECT_NEAR(floor.at({0, 0, 1}), -10, 1e-3);
  EXPECT_NEAR(floor.at(facing), -20, 0.02);
  EXPECT_NEAR(floor.at({facing.z, 0, -facing.x}), 0, 1e-3);
}

// Some of the ions are above the threshold, though their mean is not.
TEST(TurningSpeeds, OfAYieldGoByAllEnergies) {
  const OpenFloor floor("-10 nm/s * e",
                        "[[step.ion]]\nname = \"a\"\nenergy = \"19.9 eV\"\n"
                        "energy_deviation = \"6 eV\"\n[[step.ion.yield]]\nname = \"e\"\n"
                        "amplitude = 1\nthreshold = \"20 eV\"\nangular = \"enhanced\"\n");
  EXPECT_NEAR(floor.at({0, 0, 1}), -10, 1e-3);
  EXPECT_NEAR(floor.at({0, 1, 0}), 0, 1e-3);
}

// A yield that falls to nothing at 70 degrees: of the foot of a wall, at 75, the rate says 0 / 0.
TEST(FadingYield, ThatEndsBeforeTheFootOfAWallGivesNumbers) {
  const std::string to_70 = "angular_table = [[\"0 deg\", 1], [\"70 deg\", 0], [\"90 deg\", 0]]\n";
  const StepModel step =
      read_step("multi_particle",
                "rate = \"-10 nm/s * ion * etch / (etch + more)\"\n[[step.ion]]\nname = \"ion\"\n"
                "source_power = 1e6\n"
                "[[step.ion.yield]]\nname = \"etch\"\namplitude = 1\n" +
                    to_70 + "[[step.ion.yield]]\nname = \"more\"\namplitude = 2\n" + to_70);
  const std::vector<float> one{1};
  const std::vector<float> two{2};
  const std::vector<std::span<const float>> flux{one, one, two};
  const std::vector<MaterialId> materials(1);
  const std::vector<Vec3f> up{{0, 0, 1}};
  for (const std::vector<float>& part : step.model->angular().amplitudes(
           {.material = materials, .normal = up}, flux, step.model->angular().factors()))
    EXPECT_TRUE(std::isfinite(part.front()));
}

// The mean tangent of the angle to the axis, by pi.
TEST(LobeResponse, KnowsWhatArrivesAlongALobe) {
  for (const double power : {300.0, 1000.0, 1e5})
    EXPECT_NEAR(arrivals_along({.cosine_power = power}) * std::sqrt(2 * M_PI * power), 1, 0.01);
}

/// A floor and a steep wall under ions that arrive along a lobe; the wall sees a part of it.
struct WallAboveFloor {
  WallAboveFloor(const std::string& rate, float part)
      : model(read_step("multi_particle", "rate = \"" + rate +
                                              "\"\n[[step.ion]]\nname = \"ion\"\n"
                                              "source_power = 1000\n")
                  .model) {
    const std::vector<Vec3f> normals = leaning({0, 89.9});
    const std::vector<float> ions{1, part * open_arrivals(normals.back())};
    const std::vector<std::span<const float>> flux{ions};
    parts = model->angular().amplitudes({.material = materials, .normal = normals}, flux, factors);
  }

  /// What arrives on a surface that sees the whole lobe, relative to a flat one.
  float open_arrivals(Vec3f normal) const {
    const std::vector<Vec3d> directions = lobe_directions(model->species().front().source, 1 << 13);
    double sum = 0;
    for (const Vec3d& u : directions) sum += std::max(0.0, -dot(u, Vec3d(normal))) / -u.z;
    return static_cast<float>(sum / static_cast<double>(directions.size()));
  }

  /// With the amplitudes of the wall, at any normal.
  double at(Vec3f normal) const { return speed_at(parts, factors, 1, normal); }
  /// What the model says of a surface that sees a part of the lobe.
  double expected(Vec3f normal, float part) const {
    const std::vector<float> ions{part * open_arrivals(normal)};
    const std::vector<std::span<const float>> flux{ions};
    return model->speeds({.material = {materials.data(), 1}, .normal = {&normal, 1}}, flux)[0];
  }

  std::shared_ptr<const SurfaceModel> model;
  std::vector<MaterialId> materials = std::vector<MaterialId>(2);
  std::vector<AngularFactor> factors = model->angular().factors();
  std::vector<std::vector<float>> parts;
};

// What arrives on a wall along the lobe is there because no lobe is a beam, not because it is much
// brighter there: of a rate that saturates the slopes above the wall would be as slow as the wall.
TEST(LobeResponse, OfAWallIsThatOfALobeWithASpread) {
  const WallAboveFloor wall("-1.3 nm/s * ion / (0.3 + ion)", 1);
  for (const Vec3f normal : leaning({0, 30, 60, 75, 80}))
    EXPECT_NEAR(wall.at(normal), wall.expected(normal, 1), 0.06) << normal.z;
}

// By no more than twice what it sees, although what arrives over its cosine is seven times as much.
TEST(LobeResponse, OfAWallThatSeesLittleOfALobeIsWeak) {
  constexpr float part = 0.1F;
  const WallAboveFloor wall("-1 nm/s * ion", part);
  for (const Vec3f normal : leaning({0, 30, 60, 75, 80})) {
    EXPECT_LE(wall.at(normal), wall.expected(normal, part)) << normal.z;
    EXPECT_GE(wall.at(normal), 2.2 * wall.expected(normal, part)) << normal.z;
  }
}

TEST(LobeResponse, TurnsNothingWhoseCosineIsLessThanATenThousandth) {
  const PowerOfIons model(1, 0);
  const std::vector<Vec3f> normals{{0, 0, 1}, {1, 0, 1.4e-4F}, {1, 0, 0.7e-4F}};
  const std::vector<MaterialId> materials(3);
  const std::vector<float> gas(3);
  const std::vector<float> ions{1, 0.01F, 0.01F};
  const std::vector<std::span<const float>> flux{gas, ions, ions};
  const auto parts = model.angular().amplitudes({.material = materials, .normal = normals}, flux,
                                                model.angular().factors());
  const auto turns = [&](std::size_t point) {
    return std::any_of(parts.begin() + 1, parts.end(),
                       [&](const std::vector<float>& part) { return part[point] != 0; });
  };
  EXPECT_TRUE(turns(0));
  EXPECT_TRUE(turns(1));
  EXPECT_FALSE(turns(2));
  EXPECT_FLOAT_EQ(parts[0][2], -0.01F) << "all of it stays as it is";
}

TEST(TurningSpeeds, AreOfNarrowLobesAlone) {
  const auto factor_count = [](const SourceLobe& source) {
    return PowerOfIons(1, 0, source).angular().factors().size();
  };
  EXPECT_EQ(factor_count({.cosine_power = 1}), 0U);
  EXPECT_EQ(factor_count({.cosine_power = 300}), lobe_factor_count);
  EXPECT_EQ(factor_count({.cosine_power = 300, .rotating = true}), lobe_factor_count);
  SourceLobe from_around{.cosine_power = 300, .rotating = true};
  from_around.direction = normalized(Vec3d{1, 0, -1});
  EXPECT_EQ(factor_count(from_around), 0U);
  const std::array<double, 2> angles{0, 0.2};
  const std::array<double, 2> even{1, 1};
  EXPECT_EQ(factor_count({.table = PolarDensity(angles, even)}), lobe_factor_count);
  const std::array<double, 2> wide{0, 1.2};
  EXPECT_EQ(factor_count({.table = PolarDensity(wide, even)}), 0U);
}

}  // namespace
}  // namespace scarp
