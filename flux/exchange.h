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

class CoarseExchange;

/// Solves x = b + K (c x) for several right-hand sides at once.
///
/// The tolerance is that of x, relative, in the root mean square of each column: residuals say
/// little where particles hardly stick and hardly leave.
///
/// Shape: reemitted is c, one per row in [0, 1]; it and the matrix have to outlive the solver. It
///        is quick where rows that follow each other lie close together.
/// Source: van der Vorst 1992 (stabilised biconjugate gradients), preconditioned by the exchange
///         between groups of rows (coarse_exchange.h); the true residual is checked at the end.
class ExchangeSolver {
 public:
  ExchangeSolver(const ExchangeMatrix& matrix, std::span<const float> reemitted);
  ~ExchangeSolver();

  /// Shape: b and the result hold size * columns numbers, those of a row together.
  /// Throws: NumericalError if the iteration does not reach the tolerance.
  /// Cost:  two products with K per iteration; a tolerance of 1e-2 takes 2 or 3 iterations, 1e-7 up
  ///        to 8, also at the bottom of a hole 20 times as deep as wide with a sticking of 0.01. 8
  ///        columns cost less than 3 times one.
  template <class Number>
  std::vector<Number> solve(std::span<const Number> b, std::size_t columns, double tolerance) const;

 private:
  const ExchangeMatrix& matrix_;
  std::span<const float> reemitted_;
  std::unique_ptr<const CoarseExchange> coarse_;
};

}  // namespace scarp
