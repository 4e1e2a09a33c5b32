#include "apps/simulator/end_condition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/recipe/quantity.h"
#include "levelset/metrology/view_from_above.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double most_over_etch = 10;

using Kind = EndCondition::Kind;
using Place = ViewFromAbove::Place;

const Choices<Kind> kinds{{"depth", Kind::depth},
                          {"thickness", Kind::thickness},
                          {"exposed", Kind::exposed},
                          {"gone", Kind::gone}};

bool is_seen(const TriMesh& surface, MaterialId material) {
  return std::ranges::find(surface.materials, material) != surface.materials.end();
}

double lowest_point(const TriMesh& surface, std::optional<MaterialId> material) {
  double lowest = infinity;
  for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
    if (material && surface.materials[f] != *material) continue;
    for (const std::uint32_t v : surface.triangles[f])
      lowest = std::min(lowest, static_cast<double>(surface.vertices[v].z));
  }
  return lowest;
}

TriMesh open_surface(const Layers& layers) { return extract_surface(layers, open_gas(layers)); }

// Nothing where the material is not seen.
std::optional<double> depth_height(const EndCondition& condition, const TriMesh& surface) {
  if (!condition.place) {
    const double lowest = lowest_point(surface, condition.material);
    return std::isfinite(lowest) ? std::optional(lowest) : std::nullopt;
  }
  const std::optional<SeenPoint> seen = ViewFromAbove(surface).at(*condition.place);
  if (!seen || (condition.material && seen->material != *condition.material)) return std::nullopt;
  return seen->height;
}

std::optional<double> film_height(const EndCondition& condition, const TriMesh& surface) {
  if (!condition.place) return bounding_box(surface).upper.z;
  const std::optional<SeenPoint> seen = ViewFromAbove(surface).at(*condition.place);
  return seen ? std::optional(seen->height) : std::nullopt;
}

bool sees_material(const EndCondition& condition, const TriMesh& surface) {
  if (!condition.place) return is_seen(surface, *condition.material);
  const std::optional<SeenPoint> seen = ViewFromAbove(surface).at(*condition.place);
  return seen && seen->material == *condition.material;
}

std::optional<Kind> read_kind(const RecipeTable& until) {
  std::vector<std::string_view> names;
  std::vector<Kind> found;
  for (const auto& [name, kind] : kinds) {
    names.push_back(name);
    if (until.has(name)) found.push_back(kind);
  }
  if (found.empty()) {
    until.missing(names, "missing; say what ends the step: depth, thickness, exposed or gone");
    // What else there is may well be right.
    for (const char* const other : {"material", "over_etch", "at"}) until.has(other);
    return std::nullopt;
  }
  for (std::size_t n = 1; n < found.size(); ++n) {
    until.error(name_of(found[n]), fmt::format("{} and {} exclude each other; leave one out",
                                               name_of(found[0]), name_of(found[n])));
  }
  return found.front();
}

void refuse(const RecipeTable& until, std::string_view key, std::string_view text) {
  if (until.has(key)) until.error(key, text);
}

std::optional<Place> read_place(const RecipeTable& until, const Frame& frame) {
  if (!until.has("at")) return std::nullopt;
  const auto axes = static_cast<std::size_t>(frame.lateral_axes());
  const std::vector<double> at = until.quantities("at", Dimension::length, {axes, axes});
  const Sides sides = frame.sides();
  Place place{};
  for (std::size_t axis = 0; axis < axes; ++axis) {
    place[axis] = at[axis];
    if (at[axis] >= sides.lower[axis] && at[axis] <= sides.upper[axis]) continue;
    until.error(fmt::format("at[{}]", axis),
                fmt::format("{} lies outside the domain, which goes from {} to {}",
                            format_quantity(at[axis], Dimension::length),
                            format_quantity(sides.lower[axis], Dimension::length),
                            format_quantity(sides.upper[axis], Dimension::length)));
  }
  return place;
}

// " at (1 um, 0 nm)" of a condition at one place, " at x = 1 um" in two dimensions.
std::string place_text(const EndCondition& condition, const Frame& frame) {
  if (!condition.place) return "";
  const auto [x, y] = *condition.place;
  const std::string first = format_quantity(x, Dimension::length);
  return frame.is_section()
             ? " at x = " + first
             : fmt::format(" at ({}, {})", first, format_quantity(y, Dimension::length));
}

}  // namespace

std::string name_of(Kind kind) {
  return std::string(
      std::ranges::find(kinds, kind, [](const auto& each) { return each.second; })->first);
}

std::string text_of(const EndCondition& condition, const Materials& materials, const Frame& frame) {
  const std::string material = condition.material ? materials[*condition.material].name : "";
  const std::string where = place_text(condition, frame);
  if (condition.kind == Kind::exposed) return material + " exposed" + where;
  if (condition.kind == Kind::gone) return material + " gone" + where;
  return fmt::format("a {} of {}{}{}", name_of(condition.kind),
                     format_quantity(condition.length, Dimension::length),
                     material.empty() ? "" : " in " + material, where);
}

std::optional<double> start_height(const EndCondition& condition, const Layers& layers) {
  if (!is_length(condition)) return std::nullopt;
  if (condition.kind == Kind::thickness) return film_height(condition, open_surface(layers));
  if (!condition.material) return depth_height(condition, open_surface(layers));
  return highest_point(layers, *condition.material);
}

double distance_left(const EndCondition& condition, std::optional<double> start,
                     const Layers& layers) {
  const TriMesh surface = open_surface(layers);
  if (condition.kind == Kind::exposed) return sees_material(condition, surface) ? 0 : infinity;
  if (condition.kind == Kind::gone) return sees_material(condition, surface) ? infinity : 0;
  const bool is_depth = condition.kind == Kind::depth;
  const std::optional<double> now =
      is_depth ? depth_height(condition, surface) : film_height(condition, surface);
  if (!now || !start) return infinity;
  return condition.length - (is_depth ? *start - *now : *now - *start);
}

bool is_length(const EndCondition& condition) {
  return condition.kind == Kind::depth || condition.kind == Kind::thickness;
}

std::string over_etch_text(const EndCondition& condition) {
  if (condition.over_etch == 0) return "";
  return fmt::format(", and {:.4g} % of over-etch", 100 * condition.over_etch);
}

EndCondition read_end_condition(const RecipeTable& until, const Materials& materials,
                                const Frame& frame) {
  const std::optional<Kind> kind = read_kind(until);
  if (!kind) return {};
  EndCondition condition{.kind = *kind};
  const std::string key = name_of(*kind);
  if (is_length(condition)) {
    condition.length =
        until.length(key, {.minimum = 0, .maximum = longest_length, .exclusive = true});
    refuse(until, "over_etch", "goes with exposed and gone; etch deeper instead");
  } else {
    condition.material = until.material(key, materials);
    condition.over_etch =
        until.quantity("over_etch", Dimension::percentage,
                       {.fallback = "0 %", .minimum = 0, .maximum = most_over_etch});
  }
  if (*kind != Kind::depth) {
    refuse(until, "material",
           "goes with depth; a thickness is that of what the step deposits, and exposed and gone "
           "name their material themselves");
  } else if (until.has("material")) {
    condition.material = until.material("material", materials);
  }
  condition.place = read_place(until, frame);
  return condition;
}

}  // namespace scarp
