// A public header: installed as scarp/levelset/metrology/opening_names.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "levelset/metrology/openings.h"

namespace scarp {

/// An opening by its number, which is its place in a list: as it was seen last.
///
/// Units: nm. A place moves on beyond a periodic side, it does not jump to the other one.
struct NamedOpening {
  std::array<double, 2> place{};
  bool is_there = true;  ///< in the surface that was seen last
  /// Numbers of the openings that merged into this one, or into which it fell; ascending.
  std::vector<std::size_t> parts{};
  std::vector<NodeRun> nodes{};
};

/// Gives the openings of one surface after another numbers that stay.
///
/// An opening keeps its number where it has nodes in common with what had it before, also after
/// none was seen there for a while. What merges gets a new number, and so does each part of what
/// falls apart, unless nine tenths of the nodes belong to one: that one goes on. What merges or
/// falls apart in the same way again gets the same numbers again, as it does by noise. New numbers
/// go by place, see OpeningMap::openings.
class OpeningNames {
 public:
  OpeningNames() = default;
  explicit OpeningNames(std::vector<NamedOpening> known) : known_(std::move(known)) {}

  /// Shape: an entry per number.
  const std::vector<NamedOpening>& known() const { return known_; }

  /// Shape: the number of each opening of the map.
  std::vector<std::size_t> add(const OpeningMap& map);

 private:
  std::vector<NamedOpening> known_;
};

/// Everything that is known, as numbers for a file.
std::vector<double> numbers_of(const OpeningNames& names);

/// What numbers_of() gave; nothing if the numbers are not whole.
std::optional<OpeningNames> opening_names_of(std::span<const double> numbers);

/// Of a lateral position and its copies over periodic sides the one that is nearest to another.
double copy_near(const Frame& frame, int axis, double position, double other);

}  // namespace scarp
