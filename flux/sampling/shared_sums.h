#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

#include "core/system/huge_pages.h"

namespace scarp {

/// Whole numbers that several threads add to, in rows of equal length: exact in any order.
///
/// What a thread adds waits in its own buffer and goes to one part of the columns after the other,
/// under that part's lock: a locked addition for each term would wait for the memory of each.
class SharedSums {
 public:
  SharedSums(std::size_t rows, std::size_t columns);

  std::int64_t at(std::size_t row, std::size_t column) const {
    return sums_[row * columns_ + column];
  }

  /// Terms of one thread; they are added at the latest when it is destroyed.
  class Buffer {
   public:
    explicit Buffer(SharedSums& sums) : sums_(sums) { terms_.reserve(capacity); }
    ~Buffer() { flush(); }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;

    void add(std::size_t row, std::size_t column, std::uint32_t term) {
      terms_.push_back({static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(column), term});
      if (terms_.size() == capacity) flush();
    }

   private:
    struct Term {
      std::uint32_t row;
      std::uint32_t column;
      std::uint32_t term;
    };

    void flush();

    static constexpr std::size_t capacity = std::size_t{1} << 14;

    SharedSums& sums_;
    std::vector<Term> terms_;
    std::vector<Term> by_part_;
  };

 private:
  static constexpr std::size_t part_count = 32;

  std::size_t columns_;
  std::size_t columns_of_part_;
  LargeVector<std::int64_t> sums_;
  std::array<std::mutex, part_count> locks_;
};

}  // namespace scarp
