#include "apps/simulator/recipe_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "apps/simulator/state.h"
#include "levelset/operations/placed_shapes.h"
#include "models/open_wafer.h"

namespace scarp {

namespace {

constexpr double least_thickness = 2;  // of layers and films, spacings
constexpr double rounding = 1 - 1e-6;  // of rates times durations
constexpr double facets_across = 2;    // an opening, at least
constexpr double short_edge = 3;       // spacings, the default of l_max

std::string length_text(double length) { return rounded_number(length) + " nm"; }

// What the models of a recipe do to open flat wafers, each asked once.
class OpenSpeeds {
 public:
  OpenSpeeds(std::span<const ProcessStep> steps, std::size_t material_count)
      : steps_(steps), material_count_(material_count) {}

  double speed(const SurfaceModel& model, MaterialId material) {
    auto [known, is_new] = known_.try_emplace(&model);
    if (is_new) known->second = open_wafer_speeds(model, material_count_);
    return known->second[material];
  }

  bool is_etched(MaterialId material) {
    return std::ranges::any_of(steps_, [&](const ProcessStep& step) {
      return step.model && speed(*step.model, material) < 0;
    });
  }

 private:
  std::span<const ProcessStep> steps_;
  std::size_t material_count_;
  std::map<const SurfaceModel*, std::vector<float>> known_;
};

std::string narrow_text(const ShapeProblem& problem) {
  return problem.message + ": flux and shape are rough there; use a finer domain.spacing";
}

void warn_of_narrow_features(std::span<const RecipeTable> tables, const Frame& frame,
                             std::span<const Shape> shapes, const std::optional<Ground>& ground) {
  const double width = least_feature_width * frame.spacing;
  for (const ShapeProblem& each : narrow_features(frame, shapes, width, ground))
    tables[each.shape].warning(each.key, narrow_text(each));
}

// Of masks that steps put on what is there. Steps that are repeated say so once.
void warn_of_narrow_masks(const RecipeTable& root, const Frame& frame,
                          std::span<const ProcessStep> steps) {
  std::set<std::string> seen;
  for (const ProcessStep& step : steps) {
    const auto* const mask = step.operation ? std::get_if<MaskFilm>(&*step.operation) : nullptr;
    if (mask == nullptr || !seen.insert(step.path).second) continue;
    const std::array<Shape, 1> shapes{mask->shape};
    const double width = least_feature_width * frame.spacing;
    for (const ShapeProblem& each : narrow_features(frame, shapes, width, Ground{}))
      root.warning(step.path + '.' + each.key, narrow_text(each));
  }
}

void warn_of_idle_bodies(std::span<const RecipeTable> tables, const Frame& frame,
                         std::span<const Shape> shapes) {
  for (const ShapeProblem& each : idle_bodies(frame, shapes))
    tables[each.shape].warning(each.key, each.message);
}

// A flat layer of the start geometry.
struct FlatLayer {
  MaterialId material = 0;
  double thickness = 0;
  std::optional<MaterialId> below{};  // nothing where that is not the same everywhere
  std::size_t shape = 0;
  std::string key;
};

// The lowest first.
std::vector<FlatLayer> flat_layers(std::span<const Shape> start) {
  std::vector<FlatLayer> layers;
  std::optional<MaterialId> below;
  const auto add = [&](const LayerShape& layer, std::size_t shape, const std::string& key) {
    layers.push_back({layer.material, layer.thickness, below, shape, key});
    below = layer.material;
  };
  for (std::size_t n = 0; n < start.size(); ++n) {
    const Shape& shape = start[n];
    if (const auto* const wafer = std::get_if<WaferShape>(&shape)) {
      below = wafer->material;
    } else if (const auto* const layer = std::get_if<LayerShape>(&shape)) {
      add(*layer, n, "thickness");
    } else if (const auto* const stack = std::get_if<StackShape>(&shape)) {
      for (std::size_t k = 0; k < stack->layers.size(); ++k)
        add(stack->layers[k], n, fmt::format("thicknesses[{}]", k));
    } else if (!std::holds_alternative<TrenchShape>(shape) &&
               !std::holds_alternative<HoleShape>(shape)) {
      below.reset();
    }
  }
  return layers;
}

// A layer that is met from above is etched through in the right time however thin it is, but its
// sides are no surface that the grid holds. One of what it lies on is no layer of its own.
void warn_of_thin_layers(std::span<const RecipeTable> shapes, std::span<const FlatLayer> layers,
                         double spacing, OpenSpeeds& speeds) {
  const double least = least_thickness * spacing;
  for (const FlatLayer& layer : layers) {
    if (layer.below == layer.material || layer.thickness >= rounding * least ||
        !speeds.is_etched(layer.material))
      continue;
    shapes[layer.shape].warning(
        layer.key,
        fmt::format("a layer of {} that is etched is thinner than two grid spacings ({}): its "
                    "lateral etching is inaccurate; use a domain.spacing of {} or less",
                    length_text(layer.thickness), length_text(least),
                    length_text(layer.thickness / least_thickness)));
  }
}

// A film thinner than a spacing goes with what holds it: no node tells that it is there. Refused
// where that is sure before the run: once it and all layers above it have been opened, a step of
// prescribed rates etches what lies beneath it, and it alone, by more than a spacing.
class UnheldFilms {
 public:
  UnheldFilms(std::span<const RecipeTable> tables, std::span<const Shape> start, double spacing,
              OpenSpeeds& speeds, const Materials& materials)
      : tables_(tables),
        start_(start),
        layers_(flat_layers(start)),
        spacing_(spacing),
        speeds_(speeds),
        materials_(materials) {}

  void refuse(std::span<const ProcessStep> steps) {
    for (std::size_t n = 0; n < layers_.size(); ++n)
      if (layers_[n].below && layers_[n].thickness < rounding * spacing_) look_at(n, steps);
  }

 private:
  static constexpr double withstands = 0.1;  // a film that is etched this many times more slowly

  void look_at(std::size_t number, std::span<const ProcessStep> steps) {
    const FlatLayer& film = layers_[number];
    const MaterialId below = *film.below;
    // The film and what lies on it, the uppermost last.
    std::vector<FlatLayer> left(layers_.begin() + static_cast<std::ptrdiff_t>(number),
                                layers_.end());
    if (is_cut(film.shape, film.material)) left.clear();
    for (const ProcessStep& step : steps) {
      if (!step.model) continue;
      const double etch = -speeds_.speed(*step.model, film.material);
      const double etch_below = -speeds_.speed(*step.model, below);
      const bool undercuts = step.model->species().empty() && step.model->bath() == nullptr &&
                             etch_below * step.duration > spacing_ &&
                             etch <= withstands * etch_below;
      if (left.empty() && undercuts) {
        tables_[film.shape].error(
            film.key, fmt::format("a film of {} is thinner than a grid spacing ({}), and {} etches "
                                  "{} away beneath it: parts of the film without support would be "
                                  "lost; use a domain.spacing of {} or less",
                                  length_text(film.thickness), length_text(spacing_), step.path,
                                  materials_[below].name, length_text(film.thickness)));
        return;
      }
      etch_from_above(step, left);
    }
  }

  // In an open place.
  void etch_from_above(const ProcessStep& step, std::vector<FlatLayer>& layers) {
    double time = step.duration;
    while (!layers.empty()) {
      FlatLayer& top = layers.back();
      const double etch = -speeds_.speed(*step.model, top.material);
      if (etch <= 0) return;
      const double needed = top.thickness / etch;
      if (rounding * needed > time) {
        top.thickness -= etch * time;
        return;
      }
      time = std::max(0.0, time - needed);
      layers.pop_back();
    }
  }

  // Whether a later shape of the start geometry goes through a film.
  bool is_cut(std::size_t shape, MaterialId material) const {
    const auto cuts = [&](const Cut& cut) {
      return cut.through.empty() || std::ranges::count(cut.through, material) > 0;
    };
    return std::any_of(
        start_.begin() + static_cast<std::ptrdiff_t>(shape), start_.end(), [&](const Shape& later) {
          const auto* const trench = std::get_if<TrenchShape>(&later);
          const auto* const hole = std::get_if<HoleShape>(&later);
          return (trench != nullptr && cuts(trench->cut)) || (hole != nullptr && cuts(hole->cut));
        });
  }

  std::span<const RecipeTable> tables_;
  std::span<const Shape> start_;
  std::vector<FlatLayer> layers_;
  double spacing_;
  OpenSpeeds& speeds_;
  const Materials& materials_;
};

// What steps deposit of a material until one etches it, on an open flat wafer.
class Films {
 public:
  Films(const RecipeTable& root, double spacing, OpenSpeeds& speeds)
      : root_(root), spacing_(spacing), speeds_(speeds) {}

  void warn(std::span<const ProcessStep> steps) {
    for (const ProcessStep& step : steps) {
      if (step.model) etch(*step.model);
      if (step.deposits) grow(step, films_[*step.deposits]);
    }
    for (const auto& [material, film] : films_) look_at(film);
  }

 private:
  struct Film {
    double thickness = 0;
    bool is_known = true;  ///< false where it depends on more than open wafers show
    std::string key{};     ///< in the recipe, of the last step
  };

  void etch(const SurfaceModel& model) {
    for (auto& [material, film] : films_) {
      if (!(speeds_.speed(model, material) < 0)) continue;
      look_at(film);
      film = {};
    }
  }

  void grow(const ProcessStep& step, Film& film) {
    film.key = step.path + ".thickness";
    if (step.operation) {
      const auto* const conformal = std::get_if<ConformalFilm>(&*step.operation);
      if (conformal != nullptr) {
        film.thickness += conformal->thickness;
      } else {
        film.is_known = false;  // what fills or masks is as thick as the wafer makes it
      }
      return;
    }
    const double speed = speeds_.speed(*step.model, *step.deposits);
    film.is_known = film.is_known && speed > 0;
    film.key = step.path + '.' + step.duration_key;
    double thickness = speed * step.duration;
    const bool has_end = step.until && step.until->kind == EndCondition::Kind::thickness;
    if (has_end && step.until->length < thickness) {
      film.key = step.path + ".until.thickness";
      thickness = step.until->length;
    }
    film.thickness += thickness;
  }

  void look_at(const Film& film) const {
    const double least = least_thickness * spacing_;
    if (film.key.empty() || !film.is_known || film.thickness >= rounding * least) return;
    root_.warning(film.key,
                  fmt::format("makes a film of {} on an open flat wafer, thinner than two grid "
                              "spacings ({}), too thin for this grid on sidewalls; use a "
                              "domain.spacing of {} or less, or a thicker film",
                              length_text(film.thickness), length_text(least),
                              length_text(film.thickness / least_thickness)));
  }

  const RecipeTable& root_;
  double spacing_;
  OpenSpeeds& speeds_;
  std::map<MaterialId, Film> films_;
};

// Of the flat tops of masks what is left, on an open flat wafer.
class Masks {
 public:
  Masks(std::span<const Shape> start, const Materials& materials, OpenSpeeds& speeds)
      : speeds_(speeds), materials_(materials) {
    for (const Shape& shape : start)
      if (const auto* const mask = std::get_if<MaskShape>(&shape)) put(*mask);
  }

  void act(const LayerOperation& operation) {
    if (const auto* const mask = std::get_if<MaskFilm>(&operation)) return put(mask->shape);
    if (const auto* const strip = std::get_if<Strip>(&operation)) {
      left_.erase(strip->material);
      return;
    }
    const auto* const plane = std::get_if<Planarise>(&operation);
    if (plane == nullptr) {
      is_bare_ = false;
    } else if (plane->removal && is_bare_ && left_.size() == 1) {
      left_.begin()->second -= *plane->removal;
    } else {
      left_.clear();  // how high the plane leaves a mask is not known here
    }
  }

  // What to say of those that are used up now.
  std::vector<std::string> etch(const SurfaceModel& model, double duration) {
    std::vector<std::string> used;
    for (auto& [material, left] : left_) {
      const double rate = -speeds_.speed(model, material);
      is_bare_ = is_bare_ && rate >= 0;
      if (!(rate > 0) || left <= 0) continue;
      const double before = std::exchange(left, left - rate * duration);
      if (left > 0) continue;
      used.push_back(
          fmt::format("uses up the mask: on an open flat wafer {} of {} are gone after {} s of {} "
                      "s; use a thicker mask, or a shorter step",
                      length_text(before), materials_[material].name, rounded_number(before / rate),
                      rounded_number(duration)));
    }
    return used;
  }

 private:
  void put(const MaskShape& mask) {
    left_[mask.material] = mask.thickness;
    is_bare_ = true;
  }

  OpenSpeeds& speeds_;
  const Materials& materials_;
  std::map<MaterialId, double> left_;  // thickness; nm
  bool is_bare_ = false;               // the last mask has nothing on it
};

// The flux on a facet is one number.
void warn_of_long_facets(const RecipeTable& root, std::span<const RecipeTable> shapes,
                         const Frame& frame, std::span<const Shape> start,
                         const std::optional<Ground>& ground, const SimplifyOptions& options) {
  const Sides sides = frame.sides();
  // Without a limit an opening in the domain is always too narrow.
  const double widest = std::max(sides.width(0), sides.width(1));
  const double longest =
      options.l_max > 0 ? std::max(options.l_max, options.l0.value_or(0)) : widest;
  // Where openings are too narrow for these, it is the grid that is too coarse.
  if (longest <= short_edge * frame.spacing) return;
  const double width = std::min(facets_across * longest, widest);
  for (const ShapeProblem& each : narrow_features(frame, start, width, ground)) {
    if (!each.is_opening) continue;
    const std::string length =
        options.l_max > 0 ? "edges of " + length_text(longest) : "edges of any length";
    root.table("simplify")
        .warning("l_max",
                 fmt::format(
                     "allows {} in an opening that is less than {:g} times as wide ({}.{}: {}), "
                     "and would average the flux there; lower it to less than half of the opening",
                     length, facets_across, shapes[each.shape].path(), each.key, each.message));
    return;
  }
}

}  // namespace

void judge_coarseness(const RecipeTable& root, const Recipe& recipe) {
  const std::vector<RecipeTable> tables = root.tables("geometry");
  std::vector<RecipeTable> shapes;  // the table of each shape
  for (const std::size_t table : recipe.start.tables) shapes.push_back(tables[table]);
  const Frame& frame = recipe.domain.frame;
  const std::vector<Shape>& start = recipe.start.shapes;
  OpenSpeeds speeds(recipe.steps, recipe.materials.size());
  const std::optional<Ground> ground =
      recipe.start.state ? std::optional(ground_of(recipe.start.state->state->layers))
                         : std::nullopt;
  if (!start.empty()) {
    warn_of_narrow_features(shapes, frame, start, ground);
    const auto& simplify = recipe.simplification.options;
    if (simplify) warn_of_long_facets(root, shapes, frame, start, ground, *simplify);
  }
  warn_of_narrow_masks(root, frame, recipe.steps);
  // The layers of a state are not known as shapes: the run that left it has warned of them.
  if (!start.empty() && !ground) {
    warn_of_idle_bodies(shapes, frame, start);
    warn_of_thin_layers(shapes, flat_layers(start), frame.spacing, speeds);
    UnheldFilms(shapes, start, frame.spacing, speeds, recipe.materials).refuse(recipe.steps);
  }
  Films(root, frame.spacing, speeds).warn(recipe.steps);
  for (const UsedMask& used : used_masks(start, recipe.steps, recipe.materials)) {
    const ProcessStep& step = recipe.steps[used.step];
    root.warning(step.path + '.' + step.duration_key, used.text);
  }
}

std::vector<UsedMask> used_masks(std::span<const Shape> start, std::span<const ProcessStep> steps,
                                 const Materials& materials,
                                 const std::map<std::size_t, double>& ends) {
  OpenSpeeds speeds(steps, materials.size());
  Masks masks(start, materials, speeds);
  std::vector<UsedMask> used;
  for (std::size_t n = 0; n < steps.size(); ++n) {
    const ProcessStep& step = steps[n];
    if (step.operation) {
      masks.act(*step.operation);
      continue;
    }
    const auto end = ends.find(n);
    if (step.until && end == ends.end()) continue;
    const double duration = step.until ? end->second : step.duration;
    for (std::string& text : masks.etch(*step.model, duration))
      used.push_back({n, std::move(text)});
  }
  return used;
}

}  // namespace scarp
