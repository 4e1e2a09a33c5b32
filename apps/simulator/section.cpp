#include "apps/simulator/section.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/recipe/csv.h"
#include "core/recipe/quantity.h"
#include "core/system/atomic_file.h"
#include "core/trimmed.h"

namespace scarp {

namespace {

constexpr const char* how_to_write =
    "write \"y = 0 nm\", \"x = 1 um\", or \"from -1 um, 0 um to 1 um, 2 um\"";

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw InputError(fmt::format("\"{}\" {}; {}", text, why, how_to_write));
}

[[noreturn]] void refuse_line(std::string_view text, const std::string& why) {
  throw InputError(fmt::format("\"{}\" {}; write \"from -1 um, 0 um to 1 um, 2 um\"", text, why));
}

/// What stands before and behind a separator; nothing where there is none.
std::optional<std::array<std::string_view, 2>> parts(std::string_view text,
                                                     std::string_view separator) {
  const std::size_t at = text.find(separator);
  if (at == std::string_view::npos) return std::nullopt;
  return std::array{trimmed(text.substr(0, at)), trimmed(text.substr(at + separator.size()))};
}

void require_inside(std::string_view text, int axis, double position, const Sides& sides) {
  // Sides as a recipe writes them are rounded.
  const double slack = 1e-9 * sides.width(axis);
  if (position >= sides.lower[axis] - slack && position <= sides.upper[axis] + slack) return;
  throw InputError(fmt::format("\"{}\" lies outside the domain, which goes from {} to {} in {}",
                               text, format_quantity(sides.lower[axis], Dimension::length),
                               format_quantity(sides.upper[axis], Dimension::length),
                               axis == 0 ? "x" : "y"));
}

SectionLine across(std::string_view text, const std::array<std::string_view, 2>& equation,
                   const Sides& sides) {
  if (equation[0] != "x" && equation[0] != "y") refuse(text, "names no axis");
  const int axis = equation[0] == "x" ? 0 : 1;
  const double position = parse_quantity(equation[1], Dimension::length);
  require_inside(text, axis, position, sides);
  return {
      .plane = CutPlane::across(axis, just_inside(position, sides.lower[axis], sides.upper[axis])),
      .left = sides.lower[1 - axis],
      .right = sides.upper[1 - axis],
      .lateral = axis == 0 ? "y" : "x"};
}

SectionLine between(std::string_view text, const Sides& sides) {
  auto places = parse_line(text);
  for (auto& place : places) {
    for (int axis = 0; axis < 2; ++axis) {
      require_inside(text, axis, place[axis], sides);
      place[axis] = just_inside(place[axis], sides.lower[axis], sides.upper[axis]);
    }
  }
  const double dx = places[1][0] - places[0][0];
  const double dy = places[1][1] - places[0][1];
  const double length = std::hypot(dx, dy);
  if (!(length > 0)) refuse(text, "has no length");
  return {.plane = {.origin = places[0], .along = {dx / length, dy / length}},
          .left = 0,
          .right = length,
          .lateral = "s"};
}

}  // namespace

std::array<std::array<double, 2>, 2> parse_line(std::string_view text) {
  const std::string_view line = trimmed(text);
  if (!line.starts_with("from")) refuse_line(text, "does not begin with \"from\"");
  const auto ends = parts(line.substr(std::string_view("from").size()), " to ");
  if (!ends) refuse_line(text, "has no end");
  std::array<std::array<double, 2>, 2> places{};
  for (std::size_t n = 0; n < 2; ++n) {
    const auto numbers = parts((*ends)[n], ",");
    if (!numbers) refuse_line(text, "has an end without a comma");
    for (int axis = 0; axis < 2; ++axis) {
      places[n][axis] = parse_quantity((*numbers)[axis], Dimension::length);
      if (!(std::abs(places[n][axis]) <= longest_length))
        refuse_line(text, "has an end more than 1 m away");
    }
  }
  if (places[0] == places[1]) refuse_line(text, "has no length");
  return places;
}

SectionLine parse_section(std::string_view text, const Frame& frame) {
  const Sides sides = frame.sides();
  const auto equation = parts(text, "=");
  const bool is_line = trimmed(text).starts_with("from");
  if (!equation && !is_line) refuse(text, "is no line");
  SectionLine line = equation ? across(text, *equation, sides) : between(text, sides);
  if (frame.is_section() && line.lateral != "x") {
    throw InputError(fmt::format("\"{}\": a cross-section has but the section \"y = 0 nm\"", text));
  }
  if (!frame.is_section()) line.text = trimmed(text);
  return line;
}

std::vector<LayerProfile> cut(const Layers& layers, std::span<const TriMesh> surfaces,
                              const SectionLine& line) {
  std::vector<LayerProfile> profile;
  for (std::size_t k = 0; k < surfaces.size(); ++k) {
    profile.push_back({.material = layers.stack[k].material, .lines = {}});
    if (surfaces[k].triangles.empty()) continue;
    const std::vector<Polyline> lines = cross_section(surfaces[k], line.plane);
    profile.back().lines = line.lateral == "s" ? clipped(lines, line.left, line.right) : lines;
  }
  return profile;
}

std::vector<Polyline> exposed_lines(std::span<const LayerProfile> profile) {
  for (std::size_t k = profile.size(); k-- > 0;)
    if (!profile[k].lines.empty()) return profile[k].lines;
  return {};
}

void write_section_csv(const std::filesystem::path& file, std::span<const LayerProfile> layers,
                       const SectionLine& line, const Materials& materials) {
  std::string text = fmt::format("material,layer,line,{}_nm,z_nm\n", line.lateral);
  for (std::size_t k = 0; k < layers.size(); ++k) {
    for (std::size_t n = 0; n < layers[k].lines.size(); ++n) {
      for (const auto& [lateral, z] : layers[k].lines[n].points) {
        text += fmt::format("{},{},{},{:.6g},{:.6g}\n",
                            csv_field(materials[layers[k].material].name), k, n, lateral, z);
      }
    }
  }
  write_file(file, text);
}

}  // namespace scarp
