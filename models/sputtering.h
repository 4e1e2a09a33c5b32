#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "models/surface_model.h"

namespace scarp {

/// Atoms that come from above, atoms that ions knock out of the surface, and these again where they
/// settle: what ion_milling and sputter_deposition have in common.
///
///     v = (s_a J_a F_a + s_r J_r F_r - S) / rho,  S = sum over ions of Q R
///
/// S is what is sputtered, R the arrivals of ions times their yield, Q what the material loses per
/// unit of it. Sputtered atoms leave by the cosine law; F_r is where they arrive. Where more
/// settles than leaves the film grows and rho is its density, elsewhere the material's own. Without
/// a film nothing settles.
///
/// Speeds follow the normal where the surface moves between two solutions of the flux: what arrives
/// of ions is split into a part of what an open source would bring at the facet's normal, the
/// amplitude of a factor, and the rest, which does not depend on it. Of walls along the ions, where
/// that tells nothing, a beam along their axis tells whether they are in sight.
///
/// Units: fluxes in 1e15 cm^-2 s^-1, density in 1e22 cm^-3; their quotient is in nm/s.
class Sputtering final : public SurfaceModel, public Emitter, public AngularResponse {
 public:
  /// What an ion does to a material.
  struct Loss {
    std::size_t yield = 0;  ///< among the yields of the ion
    double atoms = 0;       ///< Q
  };
  struct Surface {
    double density = 1;
    std::vector<Loss>
        by_ion{};              ///< one for each kind of ion; none of a material that does not move
    double atom_sticking = 1;  ///< s_a
    double settling = 1;       ///< s_r
  };
  /// Shape: surfaces has one entry per material; factors[i][k] belongs to yield k of ion i; axes
  /// has a beam for every ion, or none where the wafer turns and ions reach all walls.
  struct Values {
    std::optional<Species> atoms{};  ///< from above
    double atom_flux = 0;            ///< J_a
    std::vector<Species> ions{};
    std::vector<std::optional<Species>> axes{};
    std::optional<Species> sputtered{};  ///< without it nothing settles
    double sputtered_unit = 1;           ///< J_r
    double film_density = 1;
    std::vector<Surface> surfaces{};
    std::vector<std::vector<AngularFactor>> factors{};
  };
  explicit Sputtering(Values values);

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::vector<std::vector<float>> emission(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const override;
  bool is_mirror_symmetric(int axis) const override;
  std::vector<AngularFactor> factors() const override;
  std::vector<std::vector<float>> amplitudes(const SurfacePoints& points,
                                             std::span<const std::span<const float>> flux,
                                             std::span<const AngularFactor> factors) const override;

 private:
  struct Balance {
    double settles = 0;
    double leaves = 0;
    double net() const { return settles - leaves; }
  };
  double loss(const Loss& loss, std::size_t ion, std::span<const std::span<const float>> flux,
              std::size_t point) const;
  Balance balance(const Surface& surface, std::span<const std::span<const float>> flux,
                  std::size_t point) const;
  double part_in_sight(std::size_t ion, double open, double lost,
                       std::span<const std::span<const float>> flux, std::size_t point) const;
  double density(const Surface& surface, double net) const {
    return net > 0 ? values_.film_density : surface.density;
  }

  Values values_;
  std::vector<std::size_t> first_tally_;   // of each ion
  std::vector<std::size_t> visibility_;    // of the axis of each ion, if it has one
  std::vector<std::size_t> first_factor_;  // of each ion
  std::size_t tally_count_ = 0;
  std::size_t factor_count_ = 0;
};

}  // namespace scarp
