#pragma once

#include <string>
#include <vector>

#include "core/random.h"
#include "core/vec3.h"
#include "flux/energy.h"
#include "flux/sampling/angle_table.h"

namespace scarp {

/// Atoms that an ion removes or brings: amplitude * max(0, sqrt(E) - sqrt(threshold)) *
/// factor(theta), with E its energy and theta its angle to the normal; or a table.
///
/// Units: energies in eV, amplitude in eV^-1/2.
struct YieldLaw {
  std::string name;
  double amplitude = 0;
  double threshold = 0;
  AngleTable factor{};

  /// Instead, if there are any: linear between ascending energies, 0 below the first of them.
  struct AtEnergy {
    double energy = 0;
    AngleTable yield{};
  };
  std::vector<AtEnergy> table{};

  double at(double energy, double half_sine) const {
    if (!table.empty()) return in_table(energy, half_sine);
    return strength(energy) * factor.at(half_sine);
  }
  /// A bound of it for ions of up to some energy.
  double largest(double energy) const;
  /// An ion with less has no yield.
  double least_energy() const;
  /// Throws: InputError if it is negative somewhere, or if a table is not sorted, begins with a
  /// jump or does not reach up to an energy. The message does not say which law it is.
  void check(double largest_energy) const;

  /// The part that the energy has in a law without a table.
  double strength(double energy) const;

 private:
  double in_table(double energy, double half_sine) const;
};

/// The mean of a yield over the energies of ions from the source, by their angle to the normal.
class MeanYield {
 public:
  MeanYield(const YieldLaw& law, const EnergyDistribution& energy);

  double at(double half_sine) const { return strength_ * factor_.at(half_sine); }

 private:
  double strength_ = 1;
  AngleTable factor_{};
};

/// What ions bring from the source, and how they go on after an impact.
///
/// An ion that does not stick leaves near the specular direction: in a cone whose density falls as
/// cos(pi / 2 * phi / cone) from the axis to its edge, and with the part e of its energy, normally
/// distributed about energy_kept and cut to [0, 1].
///
/// Units: eV, rad.
struct Ions {
  EnergyDistribution energy = EnergyDistribution::gaussian(100, 10);
  AngleTable sticking{};        ///< by angle, times that of the material
  AngleTable cone{0};           ///< half its opening; 0: like a mirror
  AngleTable energy_kept{1};    ///< mean part of the energy that is kept
  double energy_deviation = 0;  ///< standard deviation of that part
  double least_energy = 0;      ///< an ion with less stays where it arrives
};

/// Sticking 1 up to the first angle, then falling linearly to 0 at the second.
AngleTable sticking_between(double first, double second);

/// pi / 2 - min(theta, largest): wide for ions that fall steeply, narrow for glancing ones.
AngleTable reflection_cone(double largest);

/// The mean part of the energy that is kept: with A = 1 / (1 + power (pi / 2 / inflection - 1)),
/// A (theta / inflection)^power up to the inflection, from there linear from A to 1.
/// Source: Belen et al. 2005.
AngleTable kept_energy(double inflection, double power);

/// The direction in which an ion that came along d leaves a surface with unit normal n.
Vec3d sample_reflection(Vec3d d, Vec3d n, double cone, RandomStream& random);

/// The part of the energy that is kept: normal, cut to [0, 1].
double sample_kept_energy(double mean, double deviation, RandomStream& random);

}  // namespace scarp
