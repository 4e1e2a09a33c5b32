#include "flux/sampling/shared_sums.h"

#include <algorithm>

namespace scarp {

SharedSums::SharedSums(std::size_t rows, std::size_t columns)
    : columns_(columns),
      columns_of_part_(std::max<std::size_t>(1, (columns + part_count - 1) / part_count)),
      sums_(rows * columns) {}

void SharedSums::Buffer::flush() {
  std::array<std::size_t, part_count + 1> first{};
  const auto part_of = [&](const Term& term) { return term.column / sums_.columns_of_part_; };
  for (const Term& term : terms_) ++first[part_of(term) + 1];
  for (std::size_t part = 0; part < part_count; ++part) first[part + 1] += first[part];
  by_part_.resize(terms_.size());
  std::array<std::size_t, part_count + 1> next = first;
  for (const Term& term : terms_) by_part_[next[part_of(term)]++] = term;
  for (std::size_t part = 0; part < part_count; ++part) {
    if (first[part] == first[part + 1]) continue;
    const std::scoped_lock lock(sums_.locks_[part]);
    for (std::size_t k = first[part]; k < first[part + 1]; ++k) {
      const auto [row, column, term] = by_part_[k];
      sums_.sums_[row * sums_.columns_ + column] += term;
    }
  }
  terms_.clear();
}

}  // namespace scarp
