#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace scarp {

/// An upright rectangle.
template <class T>
struct PlaneBox {
  std::array<T, 2> lower{};
  std::array<T, 2> upper{};
};

/// Calls visit(n, m) once for each pair of boxes that overlap or touch, until it returns true; says
/// whether it did. The order is a function of the boxes alone.
///
/// Cost: O(n log n + pairs) for boxes that are small or all of one size, O(n sqrt n) for boxes as
/// high as all together.
template <class T, class Visit>
bool any_pair_of_boxes(std::span<const PlaneBox<T>> boxes, const Visit& visit) {
  if (boxes.empty()) return false;
  double lowest = static_cast<double>(boxes[0].lower[1]);
  double highest = lowest;
  for (const PlaneBox<T>& box : boxes) {
    lowest = std::min(lowest, static_cast<double>(box.lower[1]));
    highest = std::max(highest, static_cast<double>(box.upper[1]));
  }
  const auto row_count = static_cast<std::size_t>(std::sqrt(static_cast<double>(boxes.size())));
  const double row_height = (highest - lowest) / static_cast<double>(row_count);
  const auto row_of = [&](T level) {
    const double row = row_height > 0 ? (static_cast<double>(level) - lowest) / row_height : 0;
    return std::min(static_cast<std::size_t>(std::max(row, 0.0)), row_count - 1);
  };
  std::vector<std::uint32_t> order(boxes.size());
  for (std::size_t n = 0; n < order.size(); ++n) order[n] = static_cast<std::uint32_t>(n);
  std::sort(order.begin(), order.end(), [&](std::uint32_t n, std::uint32_t m) {
    return std::pair(boxes[n].lower[0], n) < std::pair(boxes[m].lower[0], m);
  });
  std::vector<std::vector<std::uint32_t>> rows(row_count);
  for (const std::uint32_t n : order) {
    const std::size_t last = row_of(boxes[n].upper[1]);
    for (std::size_t row = row_of(boxes[n].lower[1]); row <= last; ++row) rows[row].push_back(n);
  }
  // Along each row from the left; a pair belongs to the lowest row that both reach.
  std::vector<std::uint32_t> open;
  for (std::size_t row = 0; row < row_count; ++row) {
    open.clear();
    for (const std::uint32_t n : rows[row]) {
      const PlaneBox<T>& box = boxes[n];
      std::erase_if(open, [&](std::uint32_t m) { return boxes[m].upper[0] < box.lower[0]; });
      for (const std::uint32_t m : open) {
        const PlaneBox<T>& other = boxes[m];
        if (other.upper[1] < box.lower[1] || box.upper[1] < other.lower[1]) continue;
        if (row_of(std::max(box.lower[1], other.lower[1])) != row) continue;
        if (visit(m, n)) return true;
      }
      open.push_back(n);
    }
  }
  return false;
}

}  // namespace scarp
