#include "models/catalogue/epitaxy.h"

#include <array>
#include <memory>
#include <string>

#include "models/catalogue/crystal.h"

namespace scarp {

namespace {

Parameter ratio(std::string_view name, std::string_view fallback, std::string_view meaning) {
  return {.name = name,
          .limits = {.fallback = fallback, .minimum = 0, .maximum = 1000},
          .meaning = meaning,
          .source = "linear in the largest component of n"};
}

const Parameter rate{.name = "growth_rate",
                     .dimension = Dimension::rate,
                     .limits = {.minimum = 0, .maximum = fastest_rate, .exclusive = true},
                     .meaning = "rate of {100} planes",
                     .source = "blanket wafer"};
const Parameter ratio_110 = ratio("ratio_110", "0.65", "rate of {110} planes over it");
const Parameter ratio_111 = ratio("ratio_111", "0.5", "rate of {111} planes over it");
const Parameter ratio_311 = ratio("ratio_311", "0.89", "rate of {311} planes over it");
const Parameter deposited{
    .name = "material", .kind = Parameter::Kind::material, .meaning = "what grows"};
const Parameter grows_on{
    .name = "grows_on",
    .kind = Parameter::Kind::material_list,
    .limits = {.fallback = "[\"Si\", \"SiGe\", \"Ge\"]"},
    .meaning = "crystals that it grows on, besides itself; on all else nothing",
    .source = "the process"};

std::span<const Parameter> parameters() {
  static const std::array rows{rate,
                               ratio_110,
                               ratio_111,
                               ratio_311,
                               deposited,
                               grows_on,
                               wafer_plane_parameter(),
                               crystal_azimuth_parameter()};
  return rows;
}

std::string_view symbols() {
  static const std::string text =
      "v is the speed along the outward normal n. " + std::string(between_planes) +
      " Planes of low rate are what is left of a convex shape. The film has the orientation of the "
      "wafer.";
  return text;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const MaterialId film = step.material(deposited.name, scope.materials);
  const double r100 = read_value(step, rate);
  const AngularFactor by_plane = read_crystal(step, {.r100 = r100,
                                                     .r110 = r100 * read_value(step, ratio_110),
                                                     .r111 = r100 * read_value(step, ratio_111),
                                                     .r311 = r100 * read_value(step, ratio_311)});
  std::vector<float> amplitude(scope.materials.size());
  for (const MaterialId m : read_material_list(step, grows_on, scope)) amplitude[m] = 1;
  amplitude[film] = 1;
  require_one(
      step, scope, grows_on, [&](MaterialId m) { return amplitude[m] > 0; }, "is nothing that",
      "so epitaxy grows nothing; name a crystal that is there");
  return {std::make_shared<Crystal>(Crystal::Values{by_plane, std::move(amplitude)}), film};
}

}  // namespace

ModelDescription epitaxy_description() {
  return {.name = "epitaxy",
          .summary = "selective growth of a crystal, by the rates of its planes",
          .equation = "v = rate(n) on crystals, 0 on all else",
          .symbols = symbols(),
          .limits =
              "The rate depends on the plane alone: no transport of gas, no loading, no strain. "
              "Between the four planes it is an interpolation. Beside a mask films on {100} stay "
              "flat within "
              "a quarter of a spacing. Planes whose neighbours grow faster, as {110} and {111} do, "
              "spread what the wall disturbs: such films get up to a spacing too thick on {110}, a "
              "tenth on {111}.",
          .source =
              "T. J. Hubbard, thesis (Caltech, 1994) for the interpolation; the ratio of "
              "{111} to {100} is that of ViennaPS",
          .parameters = parameters(),
          .read = read};
}

}  // namespace scarp
