#include "models/catalogue/oxide_regrowth.h"

#include <algorithm>
#include <array>
#include <memory>

namespace scarp {

namespace {

constexpr std::string_view example = "the example of ViennaPS";

const Parameter etch_rate{.name = "etch_rate",
                          .kind = Parameter::Kind::per_material,
                          .dimension = Dimension::rate,
                          .limits = {.fallback = "{ Si3N4 = \"6.5 nm/min\", default = \"0 nm/s\" }",
                                     .minimum = 0,
                                     .maximum = fastest_rate},
                          .meaning = "R: speed of etching in a bath without silica",
                          .source = example};
const Parameter silica_per_unit{
    .name = "silica_per_unit",
    .kind = Parameter::Kind::per_material,
    .limits = {.fallback = "{ Si3N4 = 3, SiO2 = 1, Si = 1, polySi = 1, default = 0 }",
               .minimum = 0,
               .maximum = 100},
    .meaning = "n: silica set free by a formula unit, or atom, that dissolves",
    .source = "its formula"};
const Parameter deposited{.name = "material",
                          .kind = Parameter::Kind::material,
                          .meaning = "what settles: silica as a film"};
const Parameter settles_on{.name = "settles_on",
                           .kind = Parameter::Kind::material_list,
                           .limits = {.fallback = "[\"SiO2\"]"},
                           .meaning = "what silica settles on, besides its own film",
                           .source = "the process"};
const Parameter settling_rate{
    .name = "settling_rate",
    .dimension = Dimension::rate,
    .limits = {.minimum = 0, .maximum = fastest_rate},
    .meaning = "k: flux that settles over the concentration above saturation",
    .source = "regrowth on blanket oxide"};
const Parameter saturation{
    .name = "saturation",
    .dimension = Dimension::density,
    .limits = {.fallback = "3.6e18 /cm3", .minimum = 0, .maximum = 1e3, .exclusive = true},
    .meaning = "c_s: silica in the bath above which it settles",
    .source = "order of magnitude: 100 ppm of Si"};
const Parameter bath_concentration{.name = "bath_concentration",
                                   .dimension = Dimension::density,
                                   .limits = {.fallback = "0 /cm3", .minimum = 0, .maximum = 1e3},
                                   .meaning = "c_b: silica in the stirred bath",
                                   .source = "analysis of the bath"};
const Parameter diffusivity{.name = "diffusivity",
                            .dimension = Dimension::diffusivity,
                            .limits = {.fallback = "1e-6 cm2/s", .minimum = 1, .maximum = 1e15},
                            .meaning = "D: of silica in the bath",
                            .source = "order of magnitude"};
const Parameter boundary_layer{
    .name = "boundary_layer",
    .dimension = Dimension::length,
    .limits = {.fallback = "10 um", .minimum = 0, .maximum = longest_length, .exclusive = true},
    .meaning =
        "thickness of the layer at rest above the highest point; below 1.5 spacings it counts "
        "as about half a spacing to one and a half",
    .source = "order of magnitude; stirring"};

std::span<const Parameter> parameters() {
  static const std::array rows{etch_rate,          silica_per_unit, deposited,
                               settles_on,         settling_rate,   saturation,
                               bath_concentration, diffusivity,     boundary_layer};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const MaterialId film = step.material(deposited.name, scope.materials);
  const std::vector<float> rates = read_per_material(step, etch_rate, scope, film);
  const std::vector<float> silica = read_per_material(step, silica_per_unit, scope, film);
  const double settling = read_value(step, settling_rate);
  const double c_s = read_value(step, saturation);
  std::vector<OxideRegrowth::Surface> surfaces(scope.materials.size());
  for (std::size_t m = 0; m < surfaces.size(); ++m) {
    const double density = scope.materials[static_cast<MaterialId>(m)].density;
    surfaces[m] = {.etch_rate = rates[m],
                   .release = silica[m] * density * rates[m] / c_s,
                   .growth_per_flux = c_s / scope.materials[film].density};
  }
  for (const MaterialId m : read_material_list(step, settles_on, scope))
    surfaces[m].settling = settling;
  surfaces[film].settling = settling;
  require_one(
      step, scope, etch_rate,
      [&](MaterialId m) { return surfaces[m].etch_rate > 0 || surfaces[m].settling > 0; },
      "is 0 on all that", "and nothing settles there, so oxide_regrowth does nothing");
  const Solute solute{.name = "silica",
                      .diffusivity = read_value(step, diffusivity),
                      .layer = read_value(step, boundary_layer),
                      .bath = read_value(step, bath_concentration) / c_s};
  return {std::make_shared<OxideRegrowth>(OxideRegrowth::Values{solute, std::move(surfaces)}),
          film};
}

}  // namespace

std::vector<Exchange> OxideRegrowth::exchange(const SurfacePoints& points) const {
  std::vector<Exchange> exchange;
  for (const MaterialId material : points.material) {
    const Surface& surface = values_.surfaces[material];
    exchange.push_back({.release = surface.release, .uptake = surface.settling});
  }
  return exchange;
}

std::vector<float> OxideRegrowth::speeds(const SurfacePoints& points,
                                         std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    const Surface& surface = values_.surfaces[points.material[p]];
    const double settles = surface.settling * std::max(0.0F, flux.front()[p] - 1);
    speeds[p] = static_cast<float>(surface.growth_per_flux * settles - surface.etch_rate);
  }
  return speeds;
}

ModelDescription oxide_regrowth_description() {
  return {
      .name = "oxide_regrowth",
      .summary = "nitride etched from between oxide in a bath, and the silica that settles again",
      .equation =
          "v = -R + k (c_s / rho_d) max(0, c / c_s - 1) on what silica settles on, "
          "v = -R on all else",
      .symbols =
          "v is the speed along the outward normal. c is the concentration of dissolved silica: it "
          "spreads by diffusion, div grad c = 0 in the bath, and the surface gives it -D dc/dn = n "
          "rho R - k max(0, c - c_s), the second part where silica settles. Through the layer at "
          "rest above the highest point of the surface it goes on into the stirred bath, where c "
          "= c_b. rho is the density of the material, rho_d that of the film. The tally is c / "
          "c_s.",
      .limits =
          "Concentrations follow at once what dissolves: the time that silica takes through the "
          "features, their depth squared over D, is short against that of the etch. The bath is at "
          "rest in features and has one temperature; the etch does not slow down by its products. "
          "Silica settles on oxide in proportion to what lies above saturation and stays there, "
          "and forms no particles in the bath. Numbers are examples and no calibration. There are "
          "no rays, so the targets of [flux] are not asked for.",
      .source =
          "the model of ViennaPS without its prescribed flow and its jump at the threshold; A. A. "
          "Noyes, W. R. Whitney (1897) for the rate; W. Nernst (1904) for the layer at rest",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp
