#pragma once

#include <cstdint>
#include <vector>

#include "flux/engines/exchange.h"

namespace scarp {

/// Rows of rays that all weigh the same; both sets have the same.
/// Shape: what each ray of a set hits, by row.
inline ExchangeMatrix exchange_matrix(const std::vector<std::vector<std::uint32_t>>& rows) {
  ExchangeMatrix matrix;
  matrix.first.push_back(0);
  for (const std::vector<std::uint32_t>& row : rows) {
    for (const std::uint32_t hit : row) matrix.rays.insert(matrix.rays.end(), 2, {hit, 1});
    matrix.first.push_back(matrix.rays.size());
    const double part = 0.5 / static_cast<double>(row.size());
    matrix.scale.push_back({part, part});
  }
  return matrix;
}

}  // namespace scarp
