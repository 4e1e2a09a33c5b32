#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/material.h"
#include "flux/species.h"
#include "models/layer_operation.h"
#include "models/model_parts.h"

namespace scarp {

/// The chemistry of one process step: which species to trace, and speeds from their fluxes. Arrays
/// in, arrays out.
///
/// Every model has rates; coverages, a bath, emission and an angular response of its own are parts
/// that it may have (models/model_parts.h). Models are made from their values alone, by a recipe's
/// reader as by any code.
class SurfaceModel {
 public:
  /// species: the particles to trace; none for a model of prescribed rates. Those without a source
  /// (SourceLobe::Kind::none) come from the surface, and ask for an emitter. The parts have to live
  /// as long as the model.
  explicit SurfaceModel(std::vector<Species> species, const ModelParts& parts = {});
  virtual ~SurfaceModel();
  SurfaceModel(const SurfaceModel&) = delete;
  SurfaceModel& operator=(const SurfaceModel&) = delete;

  const std::vector<Species>& species() const { return species_; }

  /// The speed at each point along the outward normal, > 0 grows.
  ///
  /// Shape: flux[t][p] is tally t at point p: species in their order, of each one its tallies in
  /// theirs, arrivals first. Units: nm/s; flux relative to the source.
  virtual std::vector<float> speeds(const SurfacePoints& points,
                                    std::span<const std::span<const float>> flux) const = 0;

  /// The formula of a material's speed as the recipe has it, for messages; empty where there is
  /// none.
  virtual std::string formula([[maybe_unused]] MaterialId material) const { return {}; }

  // Null where there is no such part. Coverages are either in balance or those of a cycle.
  const BalancedCoverages* balance() const { return parts_.balance; }
  const CycledCoverages* cycle() const { return parts_.cycle; }
  const Coverages* coverages() const {
    if (parts_.cycle != nullptr) return parts_.cycle;
    return parts_.balance;
  }
  const Emitter* emitter() const { return parts_.emitter; }
  const Bath* bath() const { return parts_.bath; }

  const AngularResponse& angular() const { return *parts_.angular; }

 private:
  std::vector<Species> species_;
  ModelParts parts_;
  std::unique_ptr<const AngularResponse> angular_;  ///< of models without an own one
};

/// What covers the surface, by name; nothing for a model, or none, whose sticking is constant.
std::vector<std::string> coverage_names(const SurfaceModel* model);

/// How long a step takes by a key of its model. Units: s.
struct OwnDuration {
  double seconds = 0;
  std::string_view key;
};

/// A material that has to be on the wafer when a step begins.
struct NeededMaterial {
  std::string_view key;  ///< of the step, which names it
  MaterialId material = 0;
};

/// What a step of a recipe comes to: a model or an operation, neither if it could not be read.
struct StepModel {
  std::shared_ptr<const SurfaceModel> model{};
  std::optional<MaterialId> deposits{};  ///< the material that grows; none if it only etches
  std::optional<LayerOperation> operation{};
  OwnDuration duration{};  ///< of models that have one, see ModelDescription
  std::vector<NeededMaterial> needs{};
};

}  // namespace scarp
