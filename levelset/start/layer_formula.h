#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "levelset/start/gds.h"
#include "levelset/start/region.h"

namespace scarp {

/// What a mask takes of several layers of a layout: "1/0 + (2 - 3/0) & 4".
///
/// + is the union, - what the second leaves of the first, & what both have. & binds tighter; the
/// others act from left to right. A layer without a datatype stands for all its datatypes.
class LayerFormula {
 public:
  /// Throws: InputError that says what is wrong and how it is written; it names no place.
  explicit LayerFormula(std::string_view text);

  /// Each layer once, in the order of the text.
  const std::vector<GdsLayer>& layers() const { return layers_; }

  /// Shape: regions has one for each of layers().
  std::vector<Loop> region(const RegionGrid& grid,
                           std::span<const std::vector<Loop>> regions) const;

 private:
  class Reader;
  /// Of a stack: an operand goes on top, an operation takes two from it and puts one there.
  struct Step {
    char operation = 0;  ///< 0: an operand
    std::size_t layer = 0;
  };

  std::vector<GdsLayer> layers_;
  std::vector<Step> steps_;
};

}  // namespace scarp
