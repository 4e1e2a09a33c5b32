#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace scarp {

/// A quantity counted where particles arrive, relative to the flux of the source: an open flat
/// wafer has arrivals 1.
///
/// Shape: mean and std_error one per facet; on patches one per patch of FluxOptions::target_error,
///        in the order of Patches::list(), none of visibility.
struct Tally {
  enum class Quantity {
    arrivals,
    visibility,  ///< the part of a facet from which the source is in sight; of beams only
    yield,       ///< arrivals times the yield of a law; of ions only
  };
  Quantity quantity = Quantity::arrivals;
  std::vector<float> mean{};
  std::vector<float> std_error{};
  std::vector<float> patch_mean{};
  std::vector<float> patch_std_error{};
};

/// Where the particles went; emitted are those that left the source, or facets of their own.
///
/// Units: forward the number of particles by weight, else flux times squared spacings.
struct FluxAudit {
  double emitted = 0;
  double absorbed = 0;
  double escaped = 0;
  double lost_back_face = 0;   ///< arrived at the solid side of a facet
  double lost_below = 0;       ///< left below the lowest vertex
  double lost_side_limit = 0;  ///< crossed the lateral sides too often without meeting anything
  double roulette = 0;  ///< weight added (> 0) or removed by Russian roulette; zero on average
  double balance_std_error = 0;  ///< of balance_error(); zero of forward and beams

  double lost() const { return lost_back_face + lost_below + lost_side_limit; }
  /// (absorbed + escaped + lost - roulette - emitted) / emitted; zero for forward tracing, zero on
  /// average where anything is gathered.
  double balance_error() const;
};

/// How a flux was found.
enum class FluxEngine {
  forward,
  gather,
  gather_forward,  ///< first arrivals by rays from facets, what goes on by particles
  beam
};

/// What ends the search for a target.
enum class RayCap {
  rays,     ///< FluxOptions::max_rays
  memory,   ///< FluxOptions::memory_limit
  elements  ///< no element sends more: what comes along the wafer has no end of rare bright rays
};

/// What arrives on a mesh, of one species.
struct FluxField {
  FluxEngine engine = FluxEngine::forward;
  std::vector<Tally> tallies{};  ///< the first counts arrivals
  FluxAudit audit{};
  std::uint64_t rays = 0;  ///< primary rays from the source (forward) or from facets (gather, beam,
                           ///< with particles that go on)
  std::uint64_t segments = 0;  ///< straight flights, side crossings not counted
  double error = 0;            ///< root mean square patch error, see FluxOptions::target_error
  double bias = 0;  ///< the part of the error, or of response_error if there is one, that
                    ///< the size of elements leaves; of gathered fluxes
  std::optional<double> response_error{};  ///< see FluxOptions::responses
  double max_facet_error = 0;  ///< largest standard error of a facet divided by max(flux, 0.05)
  std::optional<RayCap> missed_by{};  ///< the target, because of it

  bool target_reached() const { return !missed_by; }
  const Tally& arrivals() const { return tallies.front(); }
  /// What is compared with the target.
  double target_measure() const { return response_error.value_or(error); }
};

}  // namespace scarp
