#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/engines/exchange.h"

namespace scarp {

/// The exchange between runs of consecutive rows, solved exactly: what remains of the error of an
/// iteration where particles hardly stick and hardly leave is smooth, and this takes it away.
///
/// Rows that follow each other have to lie close together. With R the mean over each run and P
/// what spreads a run's number over its rows, the correction is M^-1 = 1 + P (Ac^-1 - 1) R of
/// A = 1 - K c, with Ac = R A P. Rows that no path joins to the sky are left out: nothing arrives
/// in a closed void, and nothing may be put there.
///
/// Cost: one look at the hits, and the runs cubed; a correction costs the runs squared.
/// Source: Nicolaides 1987 (deflation).
class CoarseExchange {
 public:
  CoarseExchange(const ExchangeRows& rows, std::span<const float> reemitted);

  /// x := M^-1 x.
  ///
  /// Shape: x holds rows * columns numbers, those of a row together.
  template <class Number>
  void correct(std::vector<Number>& x, std::size_t columns) const;

 private:
  void factorise();
  template <std::size_t Columns>
  void solve(std::vector<double>& b, std::size_t columns) const;
  std::size_t begin_of(std::size_t run) const { return run * rows_ / runs_; }

  std::size_t rows_ = 0;
  std::size_t runs_ = 0;
  std::vector<char> open_;       ///< per row: joined to the sky
  std::vector<double> weight_;   ///< per run: one over its open rows
  std::vector<double> factors_;  ///< L below the diagonal, U on and above it, row by row
};

}  // namespace scarp
