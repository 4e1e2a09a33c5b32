#include "apps/simulator/recipe_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulator/recipe_geometry.h"
#include "apps/simulator/recipe_names.h"
#include "apps/simulator/state.h"
#include "levelset/operations/placed_shapes.h"
#include "models/open_wafer.h"
#include "models/registry.h"

namespace scarp {

namespace {

constexpr double longest = 1e9;             // s, of a step: thirty years
constexpr double most_time_steps = 1e7;     // of a step: weeks on the smallest grid
constexpr double most_spacings_high = 1e5;  // of a film
constexpr std::size_t most_steps = 100'000;

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

/// Notes in the table of a step what its domain takes for symmetric and is not: a source or a
/// crystal that reflective sides would mirror, or that is not the same all around an axis.
void refuse_asymmetry(const RecipeTable& step, const SurfaceModel& model, const Frame& frame) {
  if (frame.is_around_axis()) {
    refuse_lopsided(step, model);
  } else {
    refuse_mirrored_beams(step, model, frame);
  }
}

// A length of another unit by mistake: no geometry is that high.
void refuse_far(const RecipeTable& table, std::string_view key, std::optional<double> length,
                const Frame& frame) {
  if (!length || std::abs(*length) <= most_spacings_high * frame.spacing) return;
  table.error(key, fmt::format("{} is {:.0f} spacings; the most is {:.0f}",
                               format_quantity(*length, Dimension::length),
                               std::abs(*length) / frame.spacing, most_spacings_high));
}

void refuse_far(const RecipeTable& table, const LayerOperation& operation, const Frame& frame) {
  if (const auto* const film = std::get_if<ConformalFilm>(&operation)) {
    refuse_far(table, "thickness", film->thickness, frame);
  }
  if (const auto* const plane = std::get_if<Planarise>(&operation)) {
    refuse_far(table, "height", plane->height, frame);
    refuse_far(table, "removal", plane->removal, frame);
  }
  if (const auto* const fill = std::get_if<Fill>(&operation)) {
    refuse_far(table, "height", fill->height, frame);
    refuse_far(table, "above", fill->above, frame);
  }
  if (const auto* const mask = std::get_if<MaskFilm>(&operation)) {
    refuse_far(table, "thickness", mask->shape.thickness, frame);
  }
}

// What is wrong with the outline of a mask, whatever it comes to stand on.
void check_mask(const RecipeTable& table, const LayerOperation& operation, const Frame& frame) {
  const auto* const mask = std::get_if<MaskFilm>(&operation);
  if (mask == nullptr) return;
  const std::array<Shape, 1> shapes{mask->shape};
  for (const ShapeProblem& problem : check_shapes_on(frame, shapes, {}))
    table.error(problem.key, problem.message);
}

void refuse_endless_step(const RecipeTable& table, const ProcessStep& step, double longest_move,
                         std::size_t material_count) {
  const double count = time_steps(step, step.duration, longest_move, material_count);
  // Without an end where the spacing is wrong, which is reported there.
  if (count <= most_time_steps || !std::isfinite(count)) return;
  table.error(step.duration_key,
              fmt::format("{} makes about {:.2g} time steps, of {:.2g} nm at the most; at most "
                          "{:g} can be: use a shorter duration, lower rates or a coarser spacing",
                          format_quantity(step.duration, Dimension::time), count, longest_move,
                          most_time_steps));
}

// Whether an open wafer of any material is etched.
bool etches(const SurfaceModel& model, std::size_t material_count) {
  const std::vector<float> speeds = open_wafer_speeds(model, material_count);
  return std::ranges::any_of(speeds, [](float speed) { return speed < 0; });
}

bool is_too_many(const RecipeTable& table, double count) {
  if (count <= most_steps) return false;
  table.error(
      table.has("repeat") ? "repeat" : "",
      fmt::format("makes {:.0f} steps with repeats written out; the most is {}: repeat less "
                  "often, or split the recipe and start the second part from a result",
                  count, most_steps));
  return true;
}

// How an error of the flux in each part of a cycle adds up is not known.
void refuse_position_error(const RecipeTable& table, const ProcessStep& step,
                           double position_error) {
  if (position_error == 0 || step.model->cycle() == nullptr) return;
  table.error("model", fmt::format("{} grows its film in cycles, for which flux.position_error "
                                   "cannot be computed; use flux.target_error",
                                   step.model_name));
}

double checked_duration(const RecipeTable& table, const OwnDuration& duration) {
  if (duration.seconds > longest && table.ok())
    table.error(duration.key, fmt::format("the step takes {}; the most is {}",
                                          format_quantity(duration.seconds, Dimension::time),
                                          format_quantity(longest, Dimension::time)));
  return std::min(duration.seconds, longest);
}

double read_duration(const RecipeTable& table, const ModelDescription* model) {
  const bool at_once = model != nullptr && model->acts_at_once;
  return table.time(
      "duration",
      {.fallback = at_once ? "0 s" : "", .minimum = 0, .maximum = longest, .exclusive = !at_once});
}

// What later steps can meet grows with every deposited material, so steps are read in order.
class StepReader {
 public:
  StepReader(Recipe& recipe, std::vector<MaterialId> reachable)
      : recipe_(recipe), reachable_(std::move(reachable)), occurring_(reachable_) {}

  std::vector<ProcessStep> read(std::span<const RecipeTable> tables) {
    std::vector<ProcessStep> steps;
    for (const RecipeTable& table : tables) {
      const std::vector<ProcessStep> some =
          table.has("step") || table.has("repeat") ? read_cycle(table) : read_one(table);
      if (cycle_depth_ == 0) refuse_unknown_materials();
      if (is_too_many(table, static_cast<double>(steps.size() + some.size()))) continue;
      steps.insert(steps.end(), some.begin(), some.end());
    }
    return steps;
  }

  /// What the wafer consists of before the first step, and what steps have added.
  const std::vector<MaterialId>& occurring() const { return occurring_; }

 private:
  std::vector<ProcessStep> read_cycle(const RecipeTable& table) {
    const auto count = table.integer("repeat", {.fallback = "1", .minimum = 1, .maximum = 1e6});
    const std::string name = read_name(table, "name", "cycle");
    const std::vector<RecipeTable> inner = table.tables("step");
    if (inner.empty()) {
      table.error("repeat", "there is nothing to repeat; add [[step.step]] tables below it");
      table.accept_rest();
      return {};
    }
    const auto known = reachable_;
    rounds_depth_ += count > 1 ? 1 : 0;
    const auto until = table.has("until") ? std::optional(read_round_end(table)) : std::nullopt;
    const bool was_in_until = std::exchange(in_until_, in_until_ || until);
    ++cycle_depth_;
    const auto asked_before = std::ssize(asked_materials_);
    std::vector<ProcessStep> round = read(inner);
    // From the second round on the steps meet what the one before left. They are the same in all
    // rounds, so they know what the first one meets as well.
    if (count > 1 && reachable_ != known) {
      for (const MaterialId each : known) add_once(each, reachable_);
      asked_materials_.erase(asked_materials_.begin() + asked_before, asked_materials_.end());
      round = read(inner);
    }
    --cycle_depth_;
    rounds_depth_ -= count > 1 ? 1 : 0;
    in_until_ = was_in_until;
    if (is_too_many(table, static_cast<double>(count) * static_cast<double>(round.size())))
      return {};
    std::vector<ProcessStep> all;
    for (std::int64_t cycle = 1; cycle <= count; ++cycle) {
      for (ProcessStep step : round) {
        step.name = fmt::format("{} {}: {}", name, cycle, step.name);
        all.push_back(std::move(step));
      }
      if (until && !all.empty())
        all.back().round_end = {
            .until = *until,
            .name = name,
            .round = static_cast<int>(cycle),
            .steps_left = static_cast<std::size_t>(count - cycle) * round.size()};
    }
    if (until && !all.empty()) all.front().begins_repeat = until;
    return all;
  }

  // Looked at when a round is over.
  EndCondition read_round_end(const RecipeTable& table) {
    const RecipeTable until = table.table("until");
    const EndCondition condition =
        read_end_condition(until, recipe_.materials, recipe_.domain.frame);
    if (!until.ok()) return condition;
    if (in_until_)
      table.error("until",
                  "only one level of nested repeats may have until; leave it out here or outside");
    if (condition.over_etch > 0)
      until.error("over_etch", "rounds are whole, so there is no over-etch; leave it out");
    ask_material(until, condition);
    return condition;
  }

  void ask_material(const RecipeTable& until, const EndCondition& condition) {
    if (!condition.material) return;
    const bool is_depth = condition.kind == EndCondition::Kind::depth;
    asked_materials_.push_back(
        {until, is_depth ? "material" : name_of(condition.kind), *condition.material, reachable_});
  }

  // Of several materials at a key one has to be there in the first round, others may come later.
  void ask_materials(const RecipeTable& table, std::span<const NeededMaterial> needs) {
    const auto is_there = [&](MaterialId material) {
      return std::ranges::find(reachable_, material) != reachable_.end();
    };
    for (const NeededMaterial& each : needs) {
      if (!table.ok(each.key) || is_there(each.material)) continue;
      const bool has_another = std::ranges::any_of(needs, [&](const NeededMaterial& other) {
        return other.key == each.key && is_there(other.material);
      });
      if (rounds_depth_ > 0 && has_another) {
        asked_materials_.push_back({table, std::string(each.key), each.material, reachable_});
      } else {
        refuse_unknown(table, each.key, each.material, reachable_);
      }
    }
  }

  std::vector<ProcessStep> read_one(const RecipeTable& table) {
    ProcessStep step;
    step.path = table.path();
    step.model_name = table.text("model");
    step.name = read_name(table, "name", step.model_name);
    const ModelDescription* const model = find_model(step.model_name);
    const bool own_duration = model != nullptr && !model->duration_text.empty();
    if (!own_duration) step.duration = read_duration(table, model);
    if (own_duration && table.has("duration"))
      table.error("duration", fmt::format("{} takes as long as {}; leave this out", step.model_name,
                                          model->duration_text));
    StepModel made = read_model(
        table,
        {recipe_.materials, reachable_, recipe_.domain.frame, [this](const RecipeTable& mask) {
           return read_mask(mask, {recipe_.materials, recipe_.domain.frame, recipe_.domain.cut});
         }});
    if (made.model == nullptr && !made.operation) return {};
    if (own_duration) {
      step.duration = checked_duration(table, made.duration);
      step.duration_key = made.duration.key;
    }
    ask_materials(table, made.needs);
    step.deposits = made.deposits;
    step.model = std::move(made.model);
    if (step.model) step.factors = step.model->angular().factors();
    step.operation = made.operation;
    step.keep_free = keep_free_ = table.flag("keep_free", keep_free_);
    if (step.deposits) {
      add_once(*step.deposits, reachable_);
      add_once(*step.deposits, occurring_);
    }
    if (table.has("until")) step.until = read_until(table, step);
    step.meets = reachable_;
    if (step.operation) take_away(*step.operation);
    if (!table.ok()) return {step};
    if (step.model) refuse_asymmetry(table, *step.model, recipe_.domain.frame);
    if (step.operation) {
      refuse_far(table, *step.operation, recipe_.domain.frame);
      check_mask(table, *step.operation, recipe_.domain.frame);
    }
    if (step.model) refuse_position_error(table, step, recipe_.flux.position_error);
    refuse_endless_step(table, step, recipe_.longest_move(), recipe_.materials.size());
    return {step};
  }

  // What is stripped wherever it is, no later step meets.
  void take_away(const LayerOperation& operation) {
    const auto* const strip = std::get_if<Strip>(&operation);
    if (strip != nullptr && strip->buried) std::erase(reachable_, strip->material);
  }

  static void add_once(MaterialId material, std::vector<MaterialId>& materials) {
    if (std::ranges::find(materials, material) == materials.end()) materials.push_back(material);
  }

  EndCondition read_until(const RecipeTable& table, const ProcessStep& step) {
    const RecipeTable until = table.table("until");
    const EndCondition condition =
        read_end_condition(until, recipe_.materials, recipe_.domain.frame);
    if (!until.ok()) return condition;
    const std::string key = name_of(condition.kind);
    const bool is_film = condition.kind == EndCondition::Kind::thickness;
    if (!step.model) {
      table.error("until", fmt::format("{} acts at once; leave this out", step.model_name));
    } else if (is_film && !step.deposits) {
      until.error(key,
                  "the step deposits nothing; an etch ends at a depth, or when a material is "
                  "exposed or gone");
    } else if (!is_film && table.ok() && !etches(*step.model, recipe_.materials.size())) {
      until.error(key, "the step etches nothing; a deposition ends at a thickness");
    }
    ask_material(until, condition);
    return condition;
  }

  // Once all is known that a step can meet; of a cycle, what the whole cycle deposits.
  void refuse_unknown_materials() {
    for (const auto& [table, key, material, reachable] : asked_materials_) {
      std::vector<MaterialId> there = reachable;
      for (const MaterialId each : reachable_) add_once(each, there);
      if (std::ranges::find(there, material) == there.end())
        refuse_unknown(table, key, material, there);
    }
    asked_materials_.clear();
  }

  void refuse_unknown(const RecipeTable& table, std::string_view key, MaterialId material,
                      std::span<const MaterialId> there) const {
    std::string known;
    for (const MaterialId each : there)
      known += (known.empty() ? "" : ", ") + recipe_.materials[each].name;
    table.error(std::string(key),
                fmt::format("there is no {} on the wafer when the step begins; there is {}",
                            recipe_.materials[material].name, known));
  }

  struct AskedMaterial {
    RecipeTable table;
    std::string key;
    MaterialId material;
    std::vector<MaterialId> reachable;  ///< when the step begins
  };

  Recipe& recipe_;
  std::vector<MaterialId> reachable_;  ///< by the next step
  std::vector<MaterialId> occurring_;  ///< at any time
  std::vector<AskedMaterial> asked_materials_;
  int cycle_depth_ = 0;
  int rounds_depth_ = 0;  ///< of cycles with more than one round
  bool in_until_ = false;
  bool keep_free_ = false;  // of the step before
};

std::vector<MaterialId> materials_of(const Layers& layers) {
  std::vector<MaterialId> found;
  for (std::size_t n = 0; n < layers.stack.size(); ++n) {
    const MaterialId material = layers.stack[n].material;
    if (adds_material(layers, n) && std::ranges::find(found, material) == found.end())
      found.push_back(material);
  }
  return found;
}

std::vector<MaterialId> materials_of(std::span<const Shape> shapes) {
  std::vector<MaterialId> found;
  const auto add = [&](std::optional<MaterialId> material) {
    if (material && std::find(found.begin(), found.end(), *material) == found.end()) {
      found.push_back(*material);
    }
  };
  for (const Shape& shape : shapes) {
    std::visit(
        [&](const auto& each) {
          if constexpr (requires { each.material; }) add(each.material);
          if constexpr (requires { each.layers; }) {
            for (const LayerShape& layer : each.layers) add(layer.material);
          }
        },
        shape);
  }
  return found;
}

}  // namespace

void read_steps(const RecipeTable& root, Recipe& recipe) {
  const std::vector<RecipeTable> tables = root.tables("step");
  if (root.has("start") && !recipe.start.state) {
    // Nothing can be said about steps on an unknown wafer.
    for (const RecipeTable& step : tables) step.accept_rest();
  } else {
    std::vector<MaterialId> found = materials_of(recipe.start.shapes);
    if (recipe.start.state) {
      const std::vector<MaterialId> placed =
          std::exchange(found, materials_of(recipe.start.state->state->layers));
      for (const MaterialId each : placed)
        if (std::ranges::find(found, each) == found.end()) found.push_back(each);
    }
    recipe.start.materials = found;
    StepReader reader(recipe, std::move(found));
    recipe.steps = reader.read(tables);
    recipe.occurring = reader.occurring();
  }
  if (tables.empty() && root.ok("step"))
    root.error("step", "there is no step; add a [[step]] table");
}

}  // namespace scarp
