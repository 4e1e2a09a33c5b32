#include "apps/simulator/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/simulator/section.h"
#include "apps/simulator/simulator.h"
#include "apps/simulator/state_file.h"
#include "apps/simulator/surface_speeds.h"
#include "apps/simulator/symmetry.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "levelset/grid/symmetry.h"

namespace scarp {

namespace {

LoadStart start_of(const Simulation* start) {
  if (start == nullptr) return load_start;
  return [start](const std::filesystem::path& name, const Materials& materials) {
    const auto state = std::make_shared<const State>(
        start_state_from(start->state(), start->recipe().materials, materials));
    return StartState{name, state, state_hash(*state, materials)};
  };
}

Recipe runnable(const RecipeSource& source, const SimulationOptions& options) {
  Recipe recipe = read_recipe(source, start_of(options.start));
  if (!recipe.domain.uses_symmetry) return recipe;
  const FoundPlanes found = mirror_planes(recipe);
  return on_part(std::move(recipe), found);
}

/// Where a simulation goes on.
struct Saved {
  State state;
  OpeningNames openings{};
};

Saved resumed_from(const std::filesystem::path& file, const std::string& recipe_hash) {
  Checkpoint checkpoint = read_checkpoint(file);
  if (note_in(checkpoint.notes, "recipe_hash", file) != recipe_hash)
    throw InputError({problem_at(shown(file),
                                 "belongs to another recipe; start one from it instead, "
                                 "with start = \"FILE\"")});
  OpeningNames openings = openings_in(checkpoint.notes, file);
  return {.state = state_of(std::move(checkpoint), file), .openings = std::move(openings)};
}

std::vector<SurfaceFlux> fluxes_of(const Survey& survey, const SurfaceModel* model,
                                   const Frame& frame) {
  std::vector<std::string> names;
  if (model != nullptr) {
    for (const Species& species : model->species()) names.push_back(species.name);
    if (model->bath() != nullptr) names.push_back(model->bath()->solute().name);
  }
  std::vector<SurfaceFlux> fluxes;
  for (std::size_t s = 0; s < survey.flux.size(); ++s) {
    const Tally& arrivals = survey.flux[s].arrivals();
    fluxes.push_back({.species = names[s],
                      .mean = with_images(arrivals.mean, frame),
                      .std_error = with_images(arrivals.std_error, frame)});
  }
  return fluxes;
}

LevelSetValues values_of(const Layer& layer, const Frame& frame, const Materials& materials,
                         int lowest, int highest) {
  LevelSetValues values{.material = materials[layer.material].name,
                        .origin = frame.node_position(std::array{0, 0, lowest}),
                        .spacing = frame.spacing,
                        .counts = {frame.cells[0] + 1, frame.cells[1] + 1, highest - lowest + 1},
                        .phi = {}};
  for (int k = lowest; k <= highest; ++k)
    for (int j = 0; j <= frame.cells[1]; ++j)
      for (int i = 0; i <= frame.cells[0]; ++i)
        values.phi.push_back(static_cast<float>(frame.spacing) * layer.phi.node(i, j, k));
  return values;
}

}  // namespace

struct Simulation::Inside {
  Recipe recipe;
  State state;
  int threads = 0;
  Survey survey{};
  bool is_surveyed = false;  // survey is of the state now
  VoidChanges void_changes{};
  std::optional<Surface> surface{};
  std::optional<Metrology> start{};
  std::optional<Metrology> metrology{};
  OpeningNames openings{};  // as metrology() numbered them last

  Inside(Recipe runs, std::optional<State> resumed, int thread_count)
      : recipe(std::move(runs)),
        state(resumed ? std::move(*resumed) : start_state(recipe.domain.frame, recipe.start)),
        threads(thread_count) {
    begin();
  }

  void begin() {
    if (!finished(state, recipe.steps)) begin_step(state, recipe.steps);
  }
};

Simulation::Simulation(const RecipeSource& source, const SimulationOptions& options) {
  with_threads(options.threads, [&] {
    Recipe recipe = runnable(source, options);
    std::optional<State> resumed;
    OpeningNames openings;
    if (!options.resume_from.empty()) {
      Saved saved = resumed_from(options.resume_from, recipe.hash());
      resumed = std::move(saved.state);
      openings = std::move(saved.openings);
    }
    inside_ = std::make_unique<Inside>(std::move(recipe), std::move(resumed), options.threads);
    inside_->openings = std::move(openings);
  });
}

Simulation::Simulation(Recipe recipe, std::optional<State> resumed)
    : inside_(std::make_unique<Inside>(std::move(recipe), std::move(resumed), 0)) {}

// The layers are given back by parallel loops, too.
Simulation::~Simulation() {
  if (inside_) with_threads(inside_->threads, [&] { inside_.reset(); });
}

Simulation::Simulation(Simulation&&) noexcept = default;

Simulation& Simulation::operator=(Simulation&& other) noexcept {
  std::swap(inside_, other.inside_);
  return *this;
}

const Survey& Simulation::survey() {
  Inside& in = *inside_;
  if (in.is_surveyed) return in.survey;
  with_threads(in.threads, [&] {
    in.survey = scarp::survey(in.state, in.recipe);
    in.void_changes = note_voids(in.state, in.survey.gas);
  });
  in.is_surveyed = true;
  return in.survey;
}

Move Simulation::advance(double time_limit) {
  Inside& in = *inside_;
  survey();
  in.is_surveyed = false;
  in.surface.reset();
  Move move;
  with_threads(in.threads, [&] {
    move = scarp::advance(in.state, in.recipe, in.survey, time_limit);
    in.begin();
  });
  return move;
}

bool Simulation::run_while(const std::function<double()>& limit, const Progress& progress) {
  while (!is_finished() && time() < limit()) {
    advance(std::min(limit(), next_output(state(), recipe().outputs.every)));
    if (progress && !progress(*this)) return false;
  }
  return true;
}

bool Simulation::run_to_end(const Progress& progress) {
  return run_while([] { return std::numeric_limits<double>::infinity(); }, progress);
}

bool Simulation::run_to(double until, const Progress& progress) {
  if (std::isnan(until)) throw InputError("run_to(): the time is not a number; give it in s");
  return run_while([until] { return until; }, progress);
}

bool Simulation::run_to_next_output(const Progress& progress) {
  const double output = next_output(state(), recipe().outputs.every);
  const std::size_t step = state().step;
  return run_while(
      [&] { return state().step == step ? output : -std::numeric_limits<double>::infinity(); },
      progress);
}

bool Simulation::is_finished() const { return finished(inside_->state, inside_->recipe.steps); }

double Simulation::time() const { return inside_->state.time; }

std::uint32_t Simulation::time_step() const { return inside_->state.time_step; }

std::size_t Simulation::step() const { return inside_->state.step; }

const std::string& Simulation::step_name() const {
  return current_step(inside_->state, inside_->recipe.steps).name;
}

const std::vector<std::string>& Simulation::warnings() const { return inside_->recipe.warnings; }

const std::string& Simulation::resolved() const { return inside_->recipe.resolved; }

std::vector<std::string> Simulation::materials() const { return inside_->recipe.materials.names(); }

const Surface& Simulation::surface() {
  Inside& in = *inside_;
  if (in.surface && in.is_surveyed) return *in.surface;
  const Survey& now = survey();
  const Frame& frame = in.state.layers.frame;
  const ProcessStep& step = current_step(in.state, in.recipe.steps);
  in.surface = {.mesh = with_images(now.facets, frame),
                .fluxes = fluxes_of(now, step.model.get(), frame),
                .speeds = with_images(facet_speeds(in.state, now), frame)};
  return *in.surface;
}

std::vector<LevelSetValues> Simulation::level_sets() const {
  std::vector<LevelSetValues> all;
  with_threads(inside_->threads, [&] {
    const WholeLayers whole(inside_->state.layers);
    const Layers& layers = whole.get();
    const double spacing = layers.frame.spacing;
    double lower = layers.top().lower();
    for (const Layer& layer : layers.stack) lower = std::min(lower, layer.phi.lower());
    const auto lowest = static_cast<int>(std::floor(lower / spacing));
    const auto highest = static_cast<int>(std::ceil(layers.top().upper() / spacing));
    for (const Layer& layer : layers.stack)
      all.push_back(values_of(layer, layers.frame, inside_->recipe.materials, lowest, highest));
  });
  return all;
}

std::vector<SectionOutline> Simulation::section(std::string_view line) const {
  std::vector<SectionOutline> outlines;
  with_threads(inside_->threads, [&] {
    const WholeLayers whole(inside_->state.layers);
    const SectionLine plane = parse_section(line, whole.get().frame);
    for (LayerProfile& layer : cut(whole.get(), layer_surfaces(whole.get()), plane))
      outlines.push_back({.material = inside_->recipe.materials[layer.material].name,
                          .lines = std::move(layer.lines)});
  });
  return outlines;
}

const Metrology& Simulation::metrology() {
  Inside& in = *inside_;
  with_threads(in.threads, [&] {
    MetrologyOptions options = in.recipe.metrology;
    if (!in.start) {
      const State start = whole_of(start_state(in.recipe.domain.frame, in.recipe.start));
      in.start = measure(start.layers, options);
    }
    options.feet_are_rounded = in.state.feet_are_rounded;
    const WholeLayers whole(in.state.layers);
    in.metrology = measure(whole.get(), options, &*in.start, in.openings);
    in.openings = in.metrology->names;
  });
  return *in.metrology;
}

void Simulation::save(const std::filesystem::path& file) const {
  with_threads(inside_->threads,
               [&] { write_state(file, inside_->state, inside_->recipe, inside_->openings); });
}

std::string Simulation::state_hash() const {
  std::string hash;
  with_threads(inside_->threads,
               [&] { hash = scarp::state_hash(inside_->state, inside_->recipe.materials); });
  return hash;
}

const Recipe& Simulation::recipe() const { return inside_->recipe; }

const State& Simulation::state() const { return inside_->state; }

const Survey& Simulation::last_survey() const { return inside_->survey; }

const VoidChanges& Simulation::void_changes() const { return inside_->void_changes; }

}  // namespace scarp
