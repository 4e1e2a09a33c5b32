#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "flux/rays/problem.h"
#include "flux/rays/ray.h"
#include "flux/rays/ray_plan.h"
#include "flux/sampling/sampling.h"
#include "flux/sampling/sobol.h"

namespace scarp {

/// Which ray of a plan.
struct ShotName {
  std::uint32_t rank = 0;   ///< of its element
  std::uint32_t index = 0;  ///< in its set
  std::uint16_t set = 0;
  std::uint16_t image = 0;  ///< sides at which it has to be mirrored to come from the lobe, as bits
};

/// A ray from an element.
struct Shot {
  ShotName name;
  Ray ray{};
  Vec3d u{};  ///< its direction in space, before projection to a cross-section
  /// What it stands for of the element's view by Lambert's law, where 1 is the part of one ray in
  /// all.
  float weight = 1;
};

/// The rays of a plan, in scrambled Sobol sets of their own for each block of elements.
///
/// Where some are aimed at the sky, all are weighed by the balance heuristic (Veach and Guibas
/// 1995).
class Shooter {
 public:
  enum class Law {
    lambert,  ///< by the cosine about the normal; the same for all species
    lobe,     ///< against particles that leave the source
  };
  Shooter(const FluxProblem& problem, const RayPlan& plan, Law law);

  /// The rays of some elements from number first(rank) of each set, but for those that leave into
  /// the solid.
  std::vector<Shot> shoot(std::size_t begin, std::size_t end,
                          const std::function<std::uint32_t(std::size_t rank)>& first) const;
  /// Adds a ray by Lambert's law from each element of a window that is not one of the plan's.
  void scout(const RayPlan::Window& window, std::vector<Shot>& shots) const;
  /// One of them again.
  Shot shot(const ShotName& name) const;

  std::vector<Flight> fly(const std::vector<Shot>& shots) const;

  /// Whether a flight along the lobe ended where and as particles begin.
  bool meets_source(const Shot& shot, const Flight& flight) const;

 private:
  // What points are used for.
  enum class Use : std::uint8_t { rays, skyward_rays, scouts };
  using Sets = std::array<ScrambledSobol, set_count>;
  // What a ray that has its start needs for its direction.
  struct Aim {
    UnitSquare xi;
    Vec3d n;
  };

  bool is_skyward(const ShotName& name) const {
    return plan_.place(name.rank, name.index).is_skyward;
  }
  Sets sets_of(const RayPlan::Block& block, Use use) const;
  Aim start(Shot& shot, const std::array<double, 4>& xi) const;
  void start_from(std::size_t rank, std::uint32_t first, const Sets& sets, const Sets& skyward_sets,
                  std::vector<Shot>& shots, std::vector<Aim>& aims) const;
  void aim(std::span<Shot> shots, std::span<const Aim> aims) const;
  void aim_at(Shot& shot, Vec3d n, Vec3d u) const;
  std::pair<const Elements::Piece&, double> start_of(std::uint32_t element, double xi) const;
  Vec3d along_lobe(const ShotName& name, Vec3d upright) const;

  const FluxProblem& problem_;
  const RayPlan& plan_;
  Law law_;
  std::uint32_t user_ = 0;   // part of the random number's key
  std::uint32_t leans_ = 0;  // bits of the sides between which the lobe has other images
};

}  // namespace scarp
