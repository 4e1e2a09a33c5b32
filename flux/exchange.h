#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace scarp {

/// Which facets a facet sees: for each row, the facets that rays from it arrived on.
///
/// The matrix K has K(i, j) = the part of row i's rays that arrived on j. Rays that arrived on no
/// facet (hit >= size) count in the row's number of rays only.
///
/// Shape: row i holds hits[first[i]] to hits[first[i + 1] - 1]; every row has a ray.
struct ExchangeMatrix {
  std::vector<std::uint64_t> first;
  std::vector<std::uint32_t> hits;

  std::size_t size() const { return first.empty() ? 0 : first.size() - 1; }
};

/// Solves x = b + K (c x) for several right-hand sides at once.
///
/// Shape: b and the result hold size * columns numbers, those of a row together; reemitted is c,
/// one per row in [0, 1].
/// Throws: NumericalError if the iteration does not reach the tolerance.
/// Cost:  two products with K per iteration; 6 to 20 iterations are usual, more where particles
///        hardly stick and hardly leave.
/// Source: van der Vorst 1992 (stabilised biconjugate gradients), with the true residual checked.
template <class Number>
std::vector<Number> solve_exchange(const ExchangeMatrix& matrix, std::span<const float> reemitted,
                                   std::span<const Number> b, std::size_t columns,
                                   double tolerance);

}  // namespace scarp
