#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace scarp {

/// Some nodes of a grid, without those beyond the sides.
///
/// Shape: what is given per node has z fastest, then y.
struct NodeBox {
  std::array<int, 2> count{};  ///< of nodes along x and y, from 0 on
  int lowest = 0;              ///< along z
  int highest = 0;             ///< inclusive; all gas there is joined to the source

  std::size_t height() const { return static_cast<std::size_t>(highest - lowest) + 1; }
  std::size_t size() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) * height();
  }
  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(i) * static_cast<std::size_t>(count[1]) +
            static_cast<std::size_t>(j)) *
               height() +
           static_cast<std::size_t>(k - lowest);
  }
};

/// Spacings that gas is wider than its neck, on either side, where it counts as cut off.
inline constexpr double least_cut_off = 0.5;

/// The thicknesses at which a film that grows alike everywhere shuts a neck, and so cuts gas off
/// from the source that is wider than the neck by half a spacing at least.
///
/// That gas stays: the widest way from there to the source is as wide as its narrowest place, so
/// regions join in the order of their clearance (a merge tree of its superlevel sets).
///
/// Shape:  clearance per node: how far gas that is joined to the source is from solid, 0 elsewhere.
///         fold gives the stored node that an index along x or y stands for.
/// Units:  clearances, thicknesses and the spacing alike. Increasing; below the given thickness.
/// Errors: up to half a spacing low, where the middle of the neck lies between nodes.
std::vector<double> shutting_thicknesses(const NodeBox& box, std::vector<float> clearance,
                                         const std::function<int(int axis, int index)>& fold,
                                         double thickness, double spacing);

}  // namespace scarp
