#include "models/registry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/suggestion.h"
#include "models/blanket_rates.h"
#include "models/catalogue/ald.h"
#include "models/catalogue/cf4_o2.h"
#include "models/catalogue/conformal.h"
#include "models/catalogue/directional.h"
#include "models/catalogue/epitaxy.h"
#include "models/catalogue/fill.h"
#include "models/catalogue/fluorocarbon.h"
#include "models/catalogue/hbr_o2.h"
#include "models/catalogue/ion_milling.h"
#include "models/catalogue/isotropic.h"
#include "models/catalogue/koh_etch.h"
#include "models/catalogue/langmuir_transport.h"
#include "models/catalogue/mask.h"
#include "models/catalogue/multi_particle.h"
#include "models/catalogue/oxide_regrowth.h"
#include "models/catalogue/pecvd_teos.h"
#include "models/catalogue/planarise.h"
#include "models/catalogue/sf6_c4f8.h"
#include "models/catalogue/sf6_o2.h"
#include "models/catalogue/single_particle.h"
#include "models/catalogue/sputter_deposition.h"
#include "models/catalogue/strip.h"
#include "models/catalogue/teos.h"

namespace scarp {

namespace {

std::vector<std::string> model_names() {
  std::vector<std::string> names;
  for (const ModelDescription& model : models()) names.emplace_back(model.name);
  return names;
}

/// Text in columns, two spaces apart.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      line += "  " + row[c] + std::string(widths[c] - row[c].size(), ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

/// A paragraph of lines that fit a page.
std::string wrapped(std::string_view text) {
  constexpr std::size_t width = 96;
  std::string paragraph;
  std::string line = "  ";
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (line.size() + 1 + (end - begin) > width) {
      paragraph += line + '\n';
      line = "  ";
    }
    if (line.size() > 2) line += ' ';
    line += text.substr(begin, end - begin);
    begin = end + 1;
  }
  return paragraph + line + '\n';
}

/// How parameters of inner tables are written: `beam.tilt` is the key `tilt` of [[step.beam]].
std::string inner_tables(const ModelDescription& model) {
  std::string text;
  std::string_view last;
  for (const Parameter& parameter : model.parameters) {
    const std::size_t dot = parameter.name.rfind('.');
    const std::string_view table = parameter.name.substr(0, dot);
    if (dot == std::string_view::npos || table == last) continue;
    last = table;
    const std::string name(table);
    text += "\n  " + std::string(parameter.name) + " is the key " +
            std::string(parameter.name.substr(dot + 1)) + " of a [[step." + name +
            "]] table, one for each " + name + '\n';
  }
  return text;
}

}  // namespace

std::span<const ModelDescription> models() {
  static const std::array table{
      isotropic_description(),
      directional_description(),
      single_particle_description(),
      multi_particle_description(),
      sf6_o2_description(),
      hbr_o2_description(),
      sf6_c4f8_description(),
      cf4_o2_description(),
      fluorocarbon_description(),
      ion_milling_description(),
      sputter_deposition_description(),
      teos_description(),
      pecvd_teos_description(),
      koh_etch_description(),
      epitaxy_description(),
      ald_description(),
      langmuir_transport_description(),
      oxide_regrowth_description(),
      mask_description(),
      strip_description(),
      conformal_description(),
      fill_description(),
      planarise_description(),
  };
  return table;
}

const ModelDescription* find_model(std::string_view name) {
  for (const ModelDescription& model : models()) {
    if (model.name == name) return &model;
  }
  return nullptr;
}

StepModel read_model(const RecipeTable& step, const StepScope& scope) {
  const std::string name = step.text("model");
  const ModelDescription* const model = find_model(name);
  if (model != nullptr) {
    StepModel made = model->read(step, scope);
    if (made.model && model->takes_blanket_rates)
      return with_blanket_rates(std::move(made), step, scope);
    return made;
  }
  if (step.ok("model")) step.error("model", unknown_model_text(name));
  step.accept_rest();
  return {};
}

namespace {

/// What the field calls processes, and which models stand for them. Small letters.
constexpr std::array<std::pair<std::string_view, std::string_view>, 31> other_names{{
    {"cmp", "planarise"},
    {"polish", "planarise"},
    {"planarize", "planarise"},
    {"etch", "isotropic, directional or one of a plasma, such as sf6_o2"},
    {"dry_etch", "directional or one of a plasma, such as sf6_o2"},
    {"rie", "directional or one of a plasma, such as sf6_o2, hbr_o2 or fluorocarbon"},
    {"icp", "directional or one of a plasma, such as sf6_o2, hbr_o2 or fluorocarbon"},
    {"drie", "sf6_c4f8, in a step with repeat"},
    {"bosch", "sf6_c4f8, in a step with repeat"},
    {"ibe", "ion_milling"},
    {"milling", "ion_milling"},
    {"wet", "isotropic or koh_etch"},
    {"wet_etch", "isotropic or koh_etch"},
    {"koh", "koh_etch"},
    {"ash", "strip"},
    {"ashing", "strip"},
    {"litho", "mask"},
    {"lithography", "mask"},
    {"resist", "mask"},
    {"spin_on", "fill, or mask with an outline"},
    {"deposit", "conformal, isotropic or single_particle"},
    {"deposition", "conformal, isotropic or single_particle"},
    {"film", "conformal"},
    {"cvd", "single_particle, teos or pecvd_teos"},
    {"lpcvd", "single_particle or teos"},
    {"pecvd", "pecvd_teos"},
    {"pvd", "sputter_deposition"},
    {"sputter", "sputter_deposition"},
    {"evaporation", "directional, with a growth rate"},
    {"epi", "epitaxy"},
    {"conformal_deposition", "conformal"},
}};

}  // namespace

std::string unknown_model_text(std::string_view name) {
  std::string small(name);
  for (char& c : small) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  const auto* const meant =
      std::ranges::find(other_names, small, [](const auto& pair) { return pair.first; });
  if (meant != other_names.end())
    return "there is no model " + in_quotes(name) + "; use " + std::string(meant->second);
  std::string known;
  for (const std::string& other : model_names()) known.append(known.empty() ? "" : ", ") += other;
  return "there is no model " + in_quotes(name) + suggestion(name, model_names()) + "; there are " +
         known;
}

std::string unit_text(const Parameter& parameter) {
  switch (parameter.kind) {
    case Parameter::Kind::material:
      return "material";
    case Parameter::Kind::material_list:
      return "materials";
    case Parameter::Kind::flag:
      return "true or false";
    case Parameter::Kind::outline:
      return "outline";
    case Parameter::Kind::text:
      return "text";
    case Parameter::Kind::formula:
      return "formula";
    case Parameter::Kind::table:
      return csv_head(parameter.columns);
    default:
      break;
  }
  const std::string unit(inside_unit(parameter.dimension));
  if (parameter.dimension == Dimension::angle) return "deg";
  return unit.empty() ? "-" : unit;
}

std::string default_text(const Parameter& parameter) {
  return std::string(parameter.limits.fallback.empty() ? parameter.needed
                                                       : parameter.limits.fallback);
}

std::string range_text(const Parameter& parameter) {
  if (parameter.kind != Parameter::Kind::value && parameter.kind != Parameter::Kind::per_material)
    return "";
  const auto shown = [&](double limit) {
    return limit == 0 ? "0" : format_quantity(limit, parameter.dimension);
  };
  const Limits& limits = parameter.limits;
  if (std::isfinite(limits.minimum) && std::isfinite(limits.maximum)) {
    return (limits.exclusive ? '(' : '[') + shown(limits.minimum) + ", " + shown(limits.maximum) +
           (limits.exclusive ? ')' : ']');
  }
  if (std::isfinite(limits.minimum))
    return (limits.exclusive ? "> " : ">= ") + shown(limits.minimum);
  if (std::isfinite(limits.maximum))
    return (limits.exclusive ? "< " : "<= ") + shown(limits.maximum);
  return "any";
}

bool is_by_material(const Parameter& parameter) {
  return parameter.kind == Parameter::Kind::per_material ||
         parameter.kind == Parameter::Kind::formula;
}

std::string model_page(const ModelDescription& model) {
  std::vector<std::vector<std::string>> rows{
      {"parameter", "unit", "default", "range", "by material", "meaning", "source"}};
  for (const Parameter& parameter : model.parameters) {
    rows.push_back({std::string(parameter.name), unit_text(parameter), default_text(parameter),
                    range_text(parameter), is_by_material(parameter) ? "yes" : "",
                    std::string(parameter.meaning), std::string(parameter.source)});
  }
  return std::string(model.name) + ": " + std::string(model.summary) + "\n\n    " +
         std::string(model.equation) + "\n\n" + wrapped(model.symbols) +
         wrapped("Limits: " + std::string(model.limits)) +
         wrapped("Source: " + std::string(model.source) + ".") + '\n' + aligned(rows) +
         inner_tables(model);
}

std::string model_pages() {
  std::string text;
  for (const ModelDescription& model : models()) {
    text += (text.empty() ? "" : "\n\n") + model_page(model);
  }
  return text;
}

}  // namespace scarp
