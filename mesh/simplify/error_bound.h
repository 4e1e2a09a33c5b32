#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "mesh/simplify/collapse_mesh.h"
#include "mesh/simplify/star.h"

namespace scarp {

/// How far a surface may go.
struct ErrorLimit {
  double limit = std::numeric_limits<double>::infinity();
  double rough = 0;    ///< numbers up to here may be higher than need be, which is quicker
  double highest = 0;  ///< may be raised up to here; 0: it is hard
};

/// A proven bound on the distance between the surface being simplified and the input.
///
/// Every facet carries a number that no point of it exceeds: its distance to the input, and the
/// distance to it of the points of the input that it stands for. A collapse replaces the facets
/// around an edge by others with the same rim. Seen along a direction in which both are height
/// fields, their height difference is piecewise linear, so it is greatest at a vertex of the
/// overlay of the two: at the merged vertex, at the two old ends, or where a new edge crosses an
/// old one. New numbers are old ones plus that difference, so the bound holds in both directions
/// but grows with each collapse, up to a few times the true distance.
class ErrorBound {
 public:
  ErrorBound(std::size_t facet_count, ErrorLimit limit)
      : own_error_(facet_count, 0), error_(own_error_), limit_(limit) {}

  /// Of no mesh.
  ErrorBound() = default;
  ErrorBound(ErrorBound&&) = default;
  ErrorBound& operator=(ErrorBound&&) = default;

  /// A bound that works on the numbers of this one, which has to outlive it.
  ErrorBound sharing() { return {error_, limit_}; }

  /// Whether the numbers of the facets of a star stay within the limit when its edge is collapsed
  /// to r. Remembers them for accept().
  bool allows(const CollapseMesh& mesh, const Star& star, Vec3d r);

  /// The same for the flip of an edge: two facets with the same rim, whose height difference is
  /// greatest where the edges cross. False if they are not height fields, old and new.
  bool allows_flip(const CollapseMesh& mesh, const Star& star);

  /// Takes over the numbers that allows() found.
  void accept(const Star& star);

  /// From now on the facets stay as they are.
  void keep(std::span<const std::uint32_t> facets);
  /// Whether one of the facets of a star, or that die with it, has to stay.
  bool keeps(const Star& star) const;

  /// Doubles the limit. False if it may not be so high.
  bool raise();
  double limit() const { return limit_.limit; }

  /// The number of a facet; infinite if it has to stay.
  double error(std::uint32_t f) const { return error_[f]; }
  /// The greatest number of the living facets.
  double largest(const HalfEdges& topology) const;

 private:
  ErrorBound(std::span<double> error, ErrorLimit limit) : error_(error), limit_(limit) {}

  // Those of allows() for what lies inside a closed rim, and for the rest. simple: what the numbers
  // are at most, whatever the shape.
  bool allows_closed(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n, double simple);
  bool allows_open(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n, double simple);
  bool take_over(double simple, int count);

  /// The number of a facet that has to stay as it is.
  static constexpr double kept = std::numeric_limits<double>::infinity();

  std::vector<double> own_error_;
  std::span<double> error_;  ///< per facet
  std::array<double, Star::capacity> proposed_{};
  ErrorLimit limit_;
};

}  // namespace scarp
