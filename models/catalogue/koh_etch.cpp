#include "models/catalogue/koh_etch.h"

#include <array>
#include <memory>
#include <string>

#include "models/catalogue/crystal.h"

namespace scarp {

namespace {

Parameter plane_rate(std::string_view name, std::string_view fallback, std::string_view meaning) {
  return {.name = name,
          .dimension = Dimension::rate,
          .limits = {.fallback = fallback, .minimum = 0, .maximum = fastest_rate},
          .meaning = meaning,
          .source = "30 % KOH, 70 degrees Celsius"};
}

const Parameter rate_100 = plane_rate("etch_rate_100", "1 um/min", "rate of {100} planes");
const Parameter rate_110 = plane_rate("etch_rate_110", "1.855 um/min", "rate of {110} planes");
const Parameter rate_111 = plane_rate("etch_rate_111", "0.0073 um/min", "rate of {111} planes");
const Parameter rate_311 = plane_rate("etch_rate_311", "1.801 um/min", "rate of {311} planes");
const Parameter etches{.name = "etches",
                       .kind = Parameter::Kind::material_list,
                       .limits = {.fallback = "[\"Si\"]"},
                       .meaning = "the crystal; all else withstands",
                       .source = "the process"};

std::span<const Parameter> parameters() {
  static const std::array rows{rate_100,
                               rate_110,
                               rate_111,
                               rate_311,
                               etches,
                               wafer_plane_parameter(),
                               crystal_azimuth_parameter()};
  return rows;
}

std::string_view symbols() {
  static const std::string text = "v is the speed along the outward normal n. " +
                                  std::string(between_planes) +
                                  " Planes of low rate are what is left of a concave shape, planes "
                                  "of high rate take off convex "
                                  "edges. The bath reaches all that is open.";
  return text;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const AngularFactor rate = read_crystal(step, {.r100 = read_value(step, rate_100),
                                                 .r110 = read_value(step, rate_110),
                                                 .r111 = read_value(step, rate_111),
                                                 .r311 = read_value(step, rate_311)});
  std::vector<float> amplitude(scope.materials.size());
  for (const MaterialId m : read_material_list(step, etches, scope)) amplitude[m] = -1;
  require_one(
      step, scope, etches, [&](MaterialId m) { return amplitude[m] < 0; }, "is nothing that",
      "so koh_etch etches nothing; name the crystal that is there");
  return {std::make_shared<Crystal>(Crystal::Values{rate, std::move(amplitude)})};
}

}  // namespace

ModelDescription koh_etch_description() {
  return {
      .name = "koh_etch",
      .summary = "wet etching of crystalline silicon, by the rates of its planes",
      .equation = "v = -rate(n)",
      .symbols = symbols(),
      .limits =
          "The rate depends on the plane alone: no transport in the bath, no dependence on doping "
          "or "
          "on stress. Between the four planes it is an interpolation.",
      .source =
          "T. J. Hubbard, thesis (Caltech, 1994), as used by O. Ertl, S. Selberherr for KOH; the "
          "rates are those of ViennaPS",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp
