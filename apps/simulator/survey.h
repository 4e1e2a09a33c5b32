#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "apps/simulator/coverages.h"
#include "apps/simulator/simplify_choice.h"
#include "apps/simulator/speed_change.h"
#include "apps/simulator/state.h"
#include "core/stage_timer.h"
#include "flux/flux_field.h"
#include "levelset/motion/extend.h"
#include "levelset/surface/connectivity.h"

namespace scarp {

/// How the volume of the solid changes by what speeds and areas say, and by how much all of it
/// moves, what grows and what goes alike.
///
/// Shape: etched and area_of one per material of the recipe.
/// Units: nm^3/s.
struct Growth {
  double net = 0;
  double gross = 0;
  double area = 0;                ///< of the surface; nm^2
  std::vector<double> etched{};   ///< of each material, were all of the surface of it
  std::vector<double> area_of{};  ///< of each material on the surface; nm^2
};

/// The surface at one moment with all that the current step of the recipe does to it. A pure
/// function of state and recipe: an interrupted run finds the same numbers again.
///
/// Shape: one flux per species; speeds_of_layers[k] is how the corners of the facets would move if
///        layer k of the stack were seen there, so that a time step can cross from layer to layer.
/// Units: nm/s along the outward normal.
struct Survey {
  OpenGas gas;
  std::size_t vertices_full = 0;
  std::size_t facets_full = 0;
  Box extent;         ///< of the surface before it is simplified
  double volume = 0;  ///< of the solid from z = 0 up to it, of the whole wafer; nm^3
  SimplifyChoice simplify_choice = SimplifyChoice::simplify;
  double simplify_max_distance = 0;
  TriMesh facets;
  std::uint32_t made_at = 0;         ///< the time step that the facets were made in
  double simplify_bound = 0;         ///< on the distance between facets and surface then; nm
  double facet_distance = 0;         ///< the same now, of a mesh that may have been kept; nm
  std::shared_ptr<KeptHits> hits{};  ///< of a mesh that was kept before
  std::shared_ptr<const TriangleTree> tree{};  ///< of the facets
  std::vector<FluxField> flux;
  std::vector<std::vector<float>> coverages;  ///< on facets, in the order of the model's names
  CoverageFit coverage_fit;
  /// What coverages of the time step before took up on these facets, of which the iteration began;
  /// empty where it began without. Units: nm^2.
  std::vector<double> carried_areas;
  std::vector<LayerSpeeds> speeds_of_layers;
  std::vector<AngularFactor> factors;  ///< what the speeds depend on the normal by
  Growth growth;                       ///< of the whole wafer
  /// Of the speeds, since the time step before; of the first one of a step nothing is known.
  std::optional<SpeedChange> change;
  /// The longest time step for which model, flux and speeds hold. Units: s.
  double longest_dt = std::numeric_limits<double>::infinity();
  /// That for which the flux reaches a target in position. Units: s.
  double planned_dt = std::numeric_limits<double>::infinity();
  /// Whose speed is not finite for a flux within its error: a target in position leaves them out.
  std::size_t facets_with_pole = 0;
  StageTimer timer;
};

/// Extracts and simplifies the surface, unless that of the time step before is still close to it
/// (see FluxPlan::keep_mesh_within), solves the flux on it and asks the model for speeds.
///
/// With a target in position, a flux of a tenth of the accuracy tells how far the surface will move
/// until the end of the time step, and what each tally does to that; the flux is then solved to the
/// target.
///
/// Throws: NumericalError with step and time where the surface cannot be found or its flux is not
///         to be trusted, and with the place where a speed is not finite.
Survey survey(const State& state, const Recipe& recipe);

/// The mesh of a survey for the next one; nothing where meshes are not kept, no flux is carried and
/// nothing covers it.
KeptMesh mesh_of(const Survey& survey, const FluxPlan& plan);

/// What arrives on that mesh in a time step of dt, for the next survey; nothing where the flux is
/// solved again before every move, as that of beams is: it is found quickly, and its shadows have
/// sharp edges.
EarlierFlux earlier_flux(const Survey& survey, const FluxPlan& plan, double dt);

/// What covers the surface of a survey, for the next one.
SurfaceCoverages coverages_of(const Survey& survey, const SurfaceModel& model);

/// The standard error of the distance by which the surface moves in a time step: root mean square
/// over the exposed surface on patches of 4 x 4 spacings. Nothing unless it was the target.
///
/// Units: dt in s, result in nm.
std::optional<double> position_error(const Survey& survey, double dt);

}  // namespace scarp
