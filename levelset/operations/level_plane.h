#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "levelset/grid/band.h"

namespace scarp {

/// Numbers on the nodes of a level plane, those beyond the sides folded.
template <class T>
class LevelPlane {
 public:
  explicit LevelPlane(const Band& band, T value = {})
      : band_(&band),
        count_{band.node_count(0), band.node_count(1)},
        values_(static_cast<std::size_t>(count_[0]) * static_cast<std::size_t>(count_[1]), value) {}

  int count(int axis) const { return count_[static_cast<std::size_t>(axis)]; }
  T& at(int i, int j) { return values_[index(i, j)]; }
  T at(int i, int j) const { return values_[index(i, j)]; }
  T folded(int i, int j) const { return at(band_->fold(0, i), band_->fold(1, j)); }

 private:
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(count_[1]) +
           static_cast<std::size_t>(j);
  }

  const Band* band_;
  std::array<int, 2> count_;
  std::vector<T> values_;
};

}  // namespace scarp
