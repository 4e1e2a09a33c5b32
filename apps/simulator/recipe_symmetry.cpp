#include "apps/simulator/recipe_symmetry.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace scarp {

namespace {

// The inner tables of a step whose sources lean.
std::string leaning_tables(const RecipeTable& step) {
  for (const char* const name : {"beam", "neutral", "ion"}) {
    const std::vector<RecipeTable> tables = step.tables(name);
    if (std::ranges::any_of(tables, [](const RecipeTable& each) { return each.has("tilt"); }))
      return name;
  }
  return "";
}

// What reflective sides mirror has to be its own mirror image, or it would be another process on
// every other copy of the domain. A cross-section has no sides along y, and no normal leans there.
void refuse_mirrored_beams(const RecipeTable& table, const SurfaceModel& model,
                           const Frame& frame) {
  for (int axis = 0; axis < 2; ++axis) {
    const bool periodic = frame.boundary[static_cast<std::size_t>(axis)] == Boundary::periodic;
    if (periodic || model.angular().is_mirror_symmetric(axis)) continue;
    const char name = axis == 0 ? 'x' : 'y';
    const std::string leaning = leaning_tables(table);
    const bool is_crystal = model.species().empty() && leaning.empty();
    if (is_crystal && axis == 1 && frame.two_dimensional) continue;
    const std::string what = model.species().empty() ? "rates of the planes"
                             : leaning.empty()       ? "particles"
                                                     : leaning + 's';
    if (axis == 1 && frame.two_dimensional) {
      table.error(leaning,
                  fmt::format("the {} lean out of the cross-section, which is the same all "
                              "along y; tilt them within it (azimuth of 0 or 180 deg), {}",
                              what,
                              leaning == "beam" ? "or add the mirror image of each"
                                                : "or let the wafer turn (rotating = "
                                                  "true)"));
      continue;
    }
    const std::string remedy =
        leaning == "beam"
            ? fmt::format("add the mirror image of each beam tilted along {}, with the same share",
                          name)
        : model.species().empty() ? "turn the crystal (azimuth)"
                                  : "let the wafer turn (rotating = true)";
    table.error(leaning,
                fmt::format("the {} are not symmetric along {}, where the sides of the domain are "
                            "reflective and mirror them; make the sides periodic, or {}",
                            what, name, remedy));
  }
}

// What goes around an axis meets the same all around.
void refuse_lopsided(const RecipeTable& table, const SurfaceModel& model) {
  const std::string remedy = "use mode = \"3d\"";
  const std::string leaning = leaning_tables(table);
  if (!model.angular().is_isotropic()) {
    const std::string what = leaning.empty() ? "crystal planes are" : "what is tilted is";
    return table.error(leaning.empty() ? "model" : leaning,
                       what + " not the same all around an axis; " + remedy);
  }
  if (model.bath() != nullptr)
    return table.error("model", "baths are not known in mode = \"axisymmetric\"; " + remedy);
  for (const Species& each : model.species()) {
    const SourceLobe& source = each.source;
    if (source.kind == SourceLobe::Kind::none) continue;
    const bool leans = !source.is_upright();
    if (leans && !source.rotating)
      return table.error(leaning,
                         "what is tilted is not the same all around an axis; " + remedy +
                             ", or let the wafer turn (rotating = true) under a source that is no "
                             "beam");
    if (!source.map.empty())
      return table.error("source_map", "is not the same all around an axis; " + remedy);
  }
}

}  // namespace

void refuse_asymmetry(const RecipeTable& step, const SurfaceModel& model, const Frame& frame) {
  if (frame.is_around_axis()) {
    refuse_lopsided(step, model);
  } else {
    refuse_mirrored_beams(step, model, frame);
  }
}

}  // namespace scarp
