#pragma once

#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/angular_factor.h"
#include "core/material.h"
#include "core/solute.h"
#include "core/vec3.h"
#include "flux/species.h"
#include "models/layer_operation.h"

namespace scarp {

struct TurningTallies;

/// Points of the surface at which a model is asked for speeds: facets, or corners of facets.
///
/// Shape: one entry per point; coverage c at point p is coverages[c][p], given where a model asks
/// for
///        them in phases or emission. Normals are outward unit vectors.
struct SurfacePoints {
  std::span<const MaterialId> material;
  std::span<const Vec3f> normal;
  std::span<const std::vector<float>> coverages{};
};

/// The chemistry of one process step: which species to trace, and speeds from their fluxes. Arrays
/// in, arrays out.
class SurfaceModel {
 public:
  virtual ~SurfaceModel() = default;

  /// The particles to trace; none for a model of prescribed rates. Those without a source
  /// (SourceLobe::Kind::none) come from the surface, see emission().
  virtual std::vector<Species> species() const = 0;

  /// The speed at each point along the outward normal, > 0 grows.
  ///
  /// Shape: flux[t][p] is tally t at point p: species in their order, of each one its tallies in
  /// theirs, arrivals first. Units: nm/s; flux relative to the source.
  virtual std::vector<float> speeds(const SurfacePoints& points,
                                    std::span<const std::span<const float>> flux) const = 0;

  /// What the surface sends out because of what arrives there, as ions sputter atoms, or of what
  /// covers it.
  ///
  /// Shape: one array per species without a source, in their order, with an entry per point; flux
  /// as for speeds(), 0 for these species. Units: particles per area, relative to what 1 stands for
  /// in the flux of the species.
  virtual std::vector<std::vector<float>> emission(
      [[maybe_unused]] const SurfacePoints& points,
      [[maybe_unused]] std::span<const std::span<const float>> flux) const {
    return {};
  }

  /// What dissolves from the surface, spreads in the bath above it and settles again; of models
  /// without species. Its concentration is the only tally, in place of a flux.
  virtual std::optional<Solute> solute() const { return {}; }

  /// What the surface exchanges with the bath, where there is a solute.
  ///
  /// Shape: one entry per point.
  virtual std::vector<Exchange> exchange([[maybe_unused]] const SurfacePoints& points) const {
    return {};
  }

  /// What covers the surface, by name; nothing for models whose sticking is constant.
  virtual std::vector<std::string> coverages() const { return {}; }

  /// The part of the sites that each of them takes up once it is in balance with what arrives.
  ///
  /// Shape: coverage c at point p is [c][p], in [0, 1] like their sum; flux as for speeds().
  virtual std::vector<std::vector<float>> steady_coverages(
      [[maybe_unused]] const SurfacePoints& points,
      [[maybe_unused]] std::span<const std::span<const float>> flux) const {
    return {};
  }

  /// The phases of a cycle that coverages go through one after the other, from a bare surface on:
  /// pulses and purges. None where coverages are in balance with what arrives. Units: s.
  virtual std::vector<double> phases() const { return {}; }

  /// What those of the points become in some part of a phase, if the flux stays as it is.
  ///
  /// Shape: as steady_coverages().
  virtual std::vector<std::vector<float>> coverages_after(
      [[maybe_unused]] double seconds, [[maybe_unused]] std::size_t phase,
      [[maybe_unused]] const SurfacePoints& points,
      [[maybe_unused]] std::span<const std::span<const float>> flux) const {
    return {};
  }

  /// The longest time step for which what the model was asked for still holds. Units: s.
  virtual double longest_time_step() const { return std::numeric_limits<double>::infinity(); }

  /// The sticking on a covered surface.
  ///
  /// Shape: one array per species, with an entry per point; empty where it is that of the material.
  virtual std::vector<std::vector<float>> covered_sticking(
      [[maybe_unused]] const SurfacePoints& points,
      [[maybe_unused]] std::span<const std::vector<float>> coverages) const {
    return std::vector<std::vector<float>>(species().size());
  }

  /// The formula of a material's speed as the recipe has it, for messages; empty where there is
  /// none.
  virtual std::string formula([[maybe_unused]] MaterialId material) const { return {}; }

  /// Whether the process is its own mirror image along x (axis 0) or y, as reflective sides take
  /// for granted.
  virtual bool is_mirror_symmetric([[maybe_unused]] int axis) const { return true; }

  /// Whether the rates, at the same flux, are the same whichever way the surface faces around the
  /// vertical; where particles come from is another matter.
  virtual bool is_isotropic() const { return true; }

  /// The functions of the normal that the speeds depend on, as far as they are known. With factors
  /// the surface is moved by a scheme that takes them at its own normals: with speeds that depend
  /// on slopes as they were, edges move wrongly and slopes are unstable.
  ///
  /// Without anything better: of every narrow lobe from which particles come some slopes, between
  /// which the speed is that of the model if the surface leaned so (models/lobe_response.h); and
  /// what every yield that is largest at a slant brings from an open source.
  virtual std::vector<AngularFactor> angular_factors() const;

  /// The parts of the speed where there are factors: speeds() is the first part plus, for every
  /// factor, its amplitude times the factor at the normal.
  ///
  /// Shape: one entry more than factors, of an entry per point each; factors are those of
  ///        angular_factors(), which take a while to find. Units: nm/s.
  virtual std::vector<std::vector<float>> amplitudes(const SurfacePoints& points,
                                                     std::span<const std::span<const float>> flux,
                                                     std::span<const AngularFactor> factors) const;

 private:
  // Found at the first question.
  const TurningTallies& turning() const;

  mutable std::once_flag is_turning_known_;
  mutable std::shared_ptr<const TurningTallies> turning_;
};

/// How long a step takes by a key of its model. Units: s.
struct OwnDuration {
  double seconds = 0;
  std::string_view key;
};

/// What a step of a recipe comes to: a model or an operation, neither if it could not be read.
struct StepModel {
  std::shared_ptr<const SurfaceModel> model{};
  std::optional<MaterialId> deposits{};  ///< the material that grows; none if it only etches
  std::optional<LayerOperation> operation{};
  OwnDuration duration{};  ///< of models that have one, see ModelDescription
};

}  // namespace scarp
