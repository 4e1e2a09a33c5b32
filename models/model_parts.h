#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/angular_factor.h"
#include "core/material.h"
#include "core/solute.h"
#include "core/vec3.h"

// What a model of a surface may have besides rates. A model offers those parts that it has, see
// ModelParts; what only some need is asked of nobody else.

namespace scarp {

/// Points of the surface at which a model is asked: facets, or corners of facets.
///
/// Shape: one entry per point; coverage c at point p is coverages[c][p], given where a model asks
/// for
///        them in phases or emission. Normals are outward unit vectors.
struct SurfacePoints {
  std::span<const MaterialId> material;
  std::span<const Vec3f> normal;
  std::span<const std::vector<float>> coverages{};
};

/// What covers the surface, and lets fewer particles stick.
class Coverages {
 public:
  virtual ~Coverages() = default;

  /// By name; one at least.
  virtual std::vector<std::string> coverage_names() const = 0;

  /// The sticking on a covered surface.
  ///
  /// Shape: one array per species, with an entry per point; empty where it is that of the material.
  virtual std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints& points, std::span<const std::vector<float>> coverages) const = 0;
};

/// Coverages that are in balance with what arrives.
class BalancedCoverages : public Coverages {
 public:
  /// The part of the sites that each of them takes up.
  ///
  /// Shape: coverage c at point p is [c][p], in [0, 1] like their sum; flux as for
  ///        SurfaceModel::speeds().
  virtual std::vector<std::vector<float>> steady_coverages(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const = 0;
};

/// Coverages that go through the phases of a cycle, pulses and purges, from a bare surface on.
class CycledCoverages : public Coverages {
 public:
  /// How long they are, one after the other. Units: s.
  virtual std::vector<double> phases() const = 0;

  /// What those of the points become in some part of a phase, if the flux stays as it is.
  ///
  /// Shape: as BalancedCoverages::steady_coverages().
  virtual std::vector<std::vector<float>> coverages_after(
      double seconds, std::size_t phase, const SurfacePoints& points,
      std::span<const std::span<const float>> flux) const = 0;

  /// The longest time step that a cycle may stand for. Units: s.
  virtual double longest_time_step() const { return std::numeric_limits<double>::infinity(); }
};

/// What the surface sends out because of what arrives there, as ions sputter atoms, or of what
/// covers it: of species without a source (SourceLobe::Kind::none).
class Emitter {
 public:
  virtual ~Emitter() = default;

  /// Shape: one array per species without a source, in their order, with an entry per point; flux
  /// as for SurfaceModel::speeds(), 0 for these species. Units: particles per area, relative to
  /// what 1 stands for in the flux of the species.
  virtual std::vector<std::vector<float>> emission(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const = 0;
};

/// A bath above the surface, of models without species. Its concentration is the only tally, in
/// place of a flux.
class Bath {
 public:
  virtual ~Bath() = default;

  /// What dissolves from the surface, spreads in the bath and settles again.
  virtual Solute solute() const = 0;

  /// What the surface exchanges with the bath.
  ///
  /// Shape: one entry per point.
  virtual std::vector<Exchange> exchange(const SurfacePoints& points) const = 0;
};

/// How speeds depend on the normal of the surface.
///
/// With factors the surface is moved by a scheme that takes them at its own normals: with speeds
/// that depend on slopes as they were, edges move wrongly and slopes are unstable.
class AngularResponse {
 public:
  virtual ~AngularResponse() = default;

  /// The functions of the normal that the speeds depend on, as far as they are known. They may take
  /// a while to find.
  virtual std::vector<AngularFactor> factors() const = 0;

  /// The parts of the speed where there are factors: the speed is the first part plus, for every
  /// factor, its amplitude times the factor at the normal.
  ///
  /// Shape: one entry more than factors, which are those of factors(), of an entry per point each.
  /// Units: nm/s.
  virtual std::vector<std::vector<float>> amplitudes(
      const SurfacePoints& points, std::span<const std::span<const float>> flux,
      std::span<const AngularFactor> factors) const = 0;

  /// Whether the process is its own mirror image along x (axis 0) or y, as reflective sides take
  /// for granted.
  virtual bool is_mirror_symmetric(int axis) const = 0;

  /// Whether the rates, at the same flux, are the same whichever way the surface faces around the
  /// vertical; where particles come from is another matter.
  virtual bool is_isotropic() const { return true; }
};

/// The parts that a model has, null where it has none; mostly the model itself.
struct ModelParts {
  const BalancedCoverages* balance = nullptr;
  const CycledCoverages* cycle = nullptr;
  const Emitter* emitter = nullptr;
  const Bath* bath = nullptr;
  const AngularResponse* angular = nullptr;  ///< null: as InferredResponse finds it
};

}  // namespace scarp
