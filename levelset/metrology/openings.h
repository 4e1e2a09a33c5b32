// A public header: installed as scarp/levelset/metrology/openings.h.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/frame.h"
#include "levelset/metrology/view_from_above.h"

namespace scarp {

/// A trench or a hole, as it is seen from above.
///
/// Units: nm. A hole that a reflective side cuts has its centre on the side. One on a periodic side
/// lies at the lower one, from half a spacing beyond it on.
struct Opening {
  std::array<double, 2> centre{};
  std::array<bool, 2> through{};  ///< it reaches from side to side along x, along y: a trench
  double lowest = 0;              ///< height of the lowest node
  /// Of the box around it, both halves of what a reflective side cuts.
  std::array<double, 2> width{};
};

/// Nodes that follow one another in an OpeningMap.
struct NodeRun {
  std::uint32_t first = 0;
  std::uint32_t count = 0;

  friend bool operator==(const NodeRun&, const NodeRun&) = default;
};

/// An opening of a surface is called shallow below this depth. Units: spacings.
inline constexpr double least_opening_depth = 2;

/// Whether a depth makes an opening; one of exactly that depth does, whatever it is rounded to.
inline bool is_deep(double depth, double spacing) {
  return depth >= (least_opening_depth - 1e-3) * spacing;
}

/// Where an opening lies on a row of nodes, and where the field begins on either side: half-way to
/// the next opening, or to one that a film has plugged.
///
/// Units: lateral positions in nm, also beyond the sides of the domain.
struct OpeningRow {
  double centre = 0;
  double left_field = 0;
  double right_field = 0;
};

/// The openings of a surface, found on its heights at the nodes, seen from above.
///
/// An opening is what lies lower than half-way between its lowest node and the highest one of the
/// surface, in one piece; those less than two spacings deep do not count. So a ridge divides two
/// openings where it rises to more than half of the shallower one's depth.
class OpeningMap {
 public:
  /// The surfaces below tell where openings are that the upper one fills.
  OpeningMap(const ViewFromAbove& view, const Frame& frame,
             std::span<const ViewFromAbove* const> below = {});

  static constexpr int none = -1;

  /// In columns along x, and along y in each: x that are less than a spacing apart are the same, so
  /// that neither noise nor rounding decides.
  const std::vector<Opening>& openings() const { return openings_; }

  const Frame& frame() const { return frame_; }

  /// Along x and y; of the nodes on two periodic sides there is one.
  const std::array<int, 2>& node_counts() const { return nodes_; }

  /// Shape: an entry per node, x outermost: the opening in which it lies, or none.
  const std::vector<int>& labels() const { return labels_; }

  /// Of a node that may lie beyond the sides.
  int label(int i, int j) const { return labels_[place(fold(0, i), fold(1, j))]; }

  /// Those of each opening in the order of labels.
  std::vector<std::vector<NodeRun>> nodes() const;

  /// Along x (axis 0) or y (axis 1) at a position on the other axis. Nothing where the opening does
  /// not lie there, or has no end. Between two rows of nodes what lies in one of them counts.
  std::optional<OpeningRow> row(std::size_t opening, int axis, double position) const;

  /// Root mean square of the heights about their mean. Units: nm.
  double height_deviation() const;

 private:
  class Flood;

  /// Of a node during a flood: how it was reached, without going back around periodic sides.
  struct Mark {
    bool is_reached = false;
    std::array<int, 2> unfolded{};
  };

  std::size_t place(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(nodes_[1]) +
           static_cast<std::size_t>(j);
  }
  void find(const ViewFromAbove& view, double highest);
  void add_plugged(const OpeningMap& below);
  std::vector<std::size_t> order() const;
  void sort();
  int fold(int axis, int index) const;

  Frame frame_;
  std::array<int, 2> nodes_{};
  std::vector<double> heights_;
  std::vector<int> labels_;  ///< of each node the opening, or none
  std::vector<bool> is_plugged_;
  std::vector<Opening> openings_;
};

}  // namespace scarp
