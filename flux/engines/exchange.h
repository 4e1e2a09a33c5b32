#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace scarp {

/// Which facets a facet sees: for each row, the facets that rays from it arrived on.
///
/// The matrix K has K(i, j) = the sum over row i's rays that arrived on j of their weights, times
/// the row's scale for the set to which the ray belongs. Rays that arrived on no facet (hit >=
/// size) have no part in it.
///
/// Shape: row i holds rays[first[i]] to rays[first[i + 1] - 1], in turn of its first and its second
///        set; every row has a ray of each.
struct ExchangeMatrix {
  struct Ray {
    std::uint32_t hit = 0;
    float weight = 1;
    bool operator==(const Ray&) const = default;
  };
  std::vector<std::uint64_t> first;
  std::vector<Ray> rays;
  std::vector<std::array<double, 2>> scale;

  std::size_t size() const { return scale.size(); }
  std::span<const Ray> row(std::size_t i) const {
    return std::span(rays).subspan(first[i], first[i + 1] - first[i]);
  }
  /// Calls use(hit, part) for each of a row's rays, hits on no facet included.
  template <class Use>
  void for_each_part(std::size_t i, const Use& use) const {
    for (std::uint64_t k = first[i]; k < first[i + 1]; k += 2) {
      use(rays[k].hit, scale[i][0] * static_cast<double>(rays[k].weight));
      use(rays[k + 1].hit, scale[i][1] * static_cast<double>(rays[k + 1].weight));
    }
  }
};

/// The rows of an exchange matrix with the rays that arrived on the same facet taken together, and
/// without those that arrived on none: K as it is multiplied with.
///
/// Shape: row i has seen[first[i]] to seen[first[i + 1] - 1].
struct ExchangeRows {
  struct Seen {
    std::uint32_t hit = 0;
    float part = 0;
  };

  ExchangeRows() = default;
  /// Cost: one look at the rays; in each row hits are in the order in which they were first met.
  explicit ExchangeRows(const ExchangeMatrix& matrix);

  std::vector<std::uint64_t> first{0};
  std::vector<Seen> seen;
  std::vector<char> sees_sky;  ///< per row: whether a ray of it arrived on no facet

  std::size_t size() const { return sees_sky.size(); }
  /// Calls use(hit, part) for each facet that a row sees.
  template <class Use>
  void for_each_part(std::size_t i, const Use& use) const {
    for (std::uint64_t k = first[i]; k < first[i + 1]; ++k)
      use(seen[k].hit, static_cast<double>(seen[k].part));
  }
};

class CoarseExchange;

/// Solves x = b + K (c x) for several right-hand sides at once.
///
/// The tolerance is that of x, relative, in the root mean square of each column: residuals say
/// little where particles hardly stick and hardly leave.
///
/// Shape: reemitted is c, one per row in [0, 1]; it and the rows have to outlive the solver. It is
///        quick where rows that follow each other lie close together.
/// Source: van der Vorst 1992 (stabilised biconjugate gradients), preconditioned by the exchange
///         between groups of rows (coarse_exchange.h); the true residual is checked at the end.
class ExchangeSolver {
 public:
  ExchangeSolver(const ExchangeRows& rows, std::span<const float> reemitted);
  ~ExchangeSolver();

  /// Shape: b, the result and, unless it is empty, the start of the iteration hold size * columns
  ///        numbers, those of a row together.
  /// Throws: NumericalError if the iteration does not reach the tolerance.
  /// Cost:  two products with K per iteration; a tolerance of 1e-2 takes 2 or 3 iterations, 1e-7 up
  ///        to 8, also at the bottom of a hole 20 times as deep as wide with a sticking of 0.01. 8
  ///        columns cost less than 3 times one.
  template <class Number>
  std::vector<Number> solve(std::span<const Number> b, std::size_t columns, double tolerance,
                            std::span<const Number> start = {}) const;

 private:
  const ExchangeRows& rows_;
  std::span<const float> reemitted_;
  std::unique_ptr<const CoarseExchange> coarse_;
};

}  // namespace scarp
