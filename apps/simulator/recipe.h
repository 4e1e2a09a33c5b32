#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/simulator/coverages.h"
#include "apps/simulator/end_condition.h"
#include "apps/simulator/section.h"
#include "core/frame.h"
#include "core/material.h"
#include "core/recipe/recipe_source.h"
#include "flux/solve.h"
#include "levelset/grid/scheme.h"
#include "levelset/metrology/metrology.h"
#include "levelset/start/line_cut.h"
#include "mesh/simplify/simplify.h"
#include "models/surface_model.h"

namespace scarp {

struct State;

/// The state of another run that a recipe starts from.
struct StartState {
  std::filesystem::path file;
  std::shared_ptr<const State> state;
  std::string hash;  ///< see state_hash()
};

/// The end of a round of steps that repeat until a condition holds at the end of one.
struct RoundEnd {
  EndCondition until;
  std::string name;            ///< of the repeat
  int round = 0;               ///< from 1
  std::size_t steps_left = 0;  ///< in the rounds after this one, which are skipped when it holds
};

/// One step of a recipe, repeats written out: a model that moves the surface for some time, or an
/// operation that acts on the layers at once, when the step begins.
///
/// Units: duration in s, the longest time where there is an end condition; 0 is possible for
/// operations.
struct ProcessStep {
  std::string path;  ///< of its table in the recipe: "step[0].step[1]"
  std::string name;
  std::string model_name;
  double duration = 0;
  std::string duration_key = "duration";  ///< that it follows from
  std::optional<EndCondition> until;
  std::optional<EndCondition> begins_repeat;  ///< of the first step: what ends the repeat
  std::optional<RoundEnd> round_end;          ///< of the last step of a round
  std::optional<MaterialId> deposits;
  std::vector<MaterialId> meets;  ///< what the wafer may have when it begins, and what it deposits
  std::shared_ptr<const SurfaceModel> model;  ///< null for an operation
  std::vector<AngularFactor> factors;         ///< of the model; to find their bounds takes a while
  std::optional<LayerOperation> operation;
  bool keep_free = false;  ///< solid stays that nothing joins to the wafer
};

/// The grid that a recipe runs on.
struct Domain {
  Frame frame;
  bool uses_symmetry = false;    ///< runs on the half or quarter of a wafer that is its own image
  std::optional<LineCut> cut{};  ///< a section through a layout, along this line
};

/// What is there before the first step: the state that another run left, if there is one, and
/// shapes, which act on it.
struct StartGeometry {
  std::vector<Shape> shapes;
  std::vector<std::size_t> tables;  ///< of the recipe, one for each shape
  std::optional<StartState> state;
  std::vector<MaterialId> materials{};  ///< of the wafer before the first step
};

/// How the mesh of a time step is simplified; not at all without options.
struct Simplification {
  std::optional<SimplifyOptions> options{};
  bool where_it_pays = false;  ///< see simplify_choice()
};

/// How the flux is solved, and how often.
struct FluxPlan {
  FluxOptions options;
  double position_error = 0;    ///< target of a time step, in place of the flux error; nm
  double warn_above = 0;        ///< wall time of all fluxes from which a run warns; s
  double keep_mesh_within = 0;  ///< allowed distance of the surface from a mesh that is kept; nm
  double carry_within = 0;      ///< allowed position error from reusing a flux; nm
  CoverageOptions coverages;
};

/// How the level sets move.
struct Advection {
  Scheme scheme = Scheme::eno2;
  double cfl = 0;  ///< part of a spacing by which the surface may move at once
};

/// What a run writes, and when. Units: s.
struct Outputs {
  double every = 0;                   ///< 0 for start and end only
  double checkpoint_every = 0;        ///< of process time, 0 for outputs only; changes no time step
  double checkpoint_wall_time = 0;    ///< at most so much is lost when the process dies
  std::vector<SectionLine> sections;  ///< besides that through the middle
};

/// A recipe as the simulator needs it: checked, complete, in internal units.
struct Recipe {
  std::string title;
  Domain domain;
  Materials materials;
  StartGeometry start;
  Simplification simplification;
  FluxPlan flux;
  Advection advection;
  std::vector<ProcessStep> steps;
  Outputs outputs;
  MetrologyOptions metrology;
  std::vector<MaterialId> occurring;  ///< in the wafer at the start or deposited, that one's first
  std::string resolved;               ///< the recipe as TOML with every default written out
  std::vector<std::string> warnings;  ///< of what is doubtful, with its place in the file

  /// By which the surface may move at once. Units: nm.
  double longest_move() const { return advection.cfl * domain.frame.spacing; }

  /// By which a state knows its recipe: of the text and of the state that it starts from.
  std::string hash() const;
};

/// Reads the state that another run left. Throws: InputError if it cannot.
using LoadStart =
    std::function<StartState(const std::filesystem::path& file, const Materials& materials)>;

/// As domain.mode has it.
std::string mode_name(const Frame& frame);

/// Reads and checks a recipe.
///
/// load_start reads the state that a recipe starts from; without it such a recipe is refused.
///
/// Throws: RecipeError with all that is wrong.
Recipe read_recipe(const RecipeSource& source, const LoadStart& load_start = {});

/// About how many time steps a step takes in a time, at the speed of a surface that sees the whole
/// source and moves by so much at once. Units: s, nm.
double time_steps(const ProcessStep& step, double duration, double longest_move,
                  std::size_t material_count);

}  // namespace scarp
