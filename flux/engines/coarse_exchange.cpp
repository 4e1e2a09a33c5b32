#include "flux/engines/coarse_exchange.h"

#include <algorithm>

#include "core/disjoint_sets.h"
#include "core/parallel.h"

namespace scarp {

namespace {

// Fewer rows make no smooth part, and more runs cost more than they save.
constexpr std::size_t least_rows = 32;
constexpr std::size_t most_runs = 512;

// Rows are joined where one sees the other; a few facets that each sees show it. What is not found
// to be open is only not corrected.
constexpr std::uint64_t hits_to_join = 16;

std::vector<char> joined_to_sky(const ExchangeRows& rows) {
  const auto size = static_cast<std::uint32_t>(rows.size());
  DisjointSets sets(size + 1);  // the last one is the sky
  for (std::uint32_t i = 0; i < size; ++i) {
    if (rows.sees_sky[i] != 0) sets.join(i, size);
    const std::uint64_t end = std::min(rows.first[i + 1], rows.first[i] + hits_to_join);
    for (std::uint64_t k = rows.first[i]; k < end; ++k) sets.join(i, rows.seen[k].hit);
  }
  std::vector<char> open(size);
  for (std::uint32_t i = 0; i < size; ++i) open[i] = sets.lowest(i) == sets.lowest(size) ? 1 : 0;
  return open;
}

}  // namespace

CoarseExchange::CoarseExchange(const ExchangeRows& rows, std::span<const float> reemitted)
    : rows_(rows.size()), runs_(std::min(most_runs, rows_ / least_rows)) {
  if (runs_ == 0) return;
  open_ = joined_to_sky(rows);
  std::vector<std::uint32_t> run_of(rows_);
  for (std::size_t run = 0; run < runs_; ++run) {
    std::size_t count = 0;
    for (std::size_t i = begin_of(run); i < begin_of(run + 1); ++i) {
      run_of[i] = static_cast<std::uint32_t>(run);
      if (open_[i] != 0) ++count;
    }
    weight_.push_back(count > 0 ? 1 / static_cast<double>(count) : 0);
  }
  factors_.resize(runs_ * runs_);
  parallel_for(runs_, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t run = first; run < last; ++run) {
      double* row = &factors_[run * runs_];
      row[run] = 1;
      for (std::size_t i = begin_of(run); i < begin_of(run + 1); ++i) {
        if (open_[i] == 0) continue;
        rows.for_each_part(i, [&](std::uint32_t j, double part) {
          row[run_of[j]] -= weight_[run] * part * static_cast<double>(reemitted[j]);
        });
      }
    }
  });
  factorise();
}

// Without pivots: no row's other entries are together larger than its diagonal.
void CoarseExchange::factorise() {
  // Runs that hardly see anything but each other and keep everything.
  constexpr double closed = 1e-9;
  for (std::size_t k = 0; k < runs_; ++k) {
    const double* pivot_row = &factors_[k * runs_];
    if (pivot_row[k] < closed) factors_[k * runs_ + k] = 1;
    const double inverse = 1 / pivot_row[k];
    parallel_for(runs_ - k - 1, 64, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = k + 1 + first; i < k + 1 + last; ++i) {
        double* row = &factors_[i * runs_];
        const double factor = row[k] * inverse;
        row[k] = factor;
        for (std::size_t j = k + 1; j < runs_; ++j) row[j] -= factor * pivot_row[j];
      }
    });
  }
}

// Columns: as many, if it is not 0. It makes the innermost loops short.
template <std::size_t Columns>
void CoarseExchange::solve(std::vector<double>& b, std::size_t columns) const {
  if (Columns > 0) columns = Columns;
  const auto subtract = [&](std::size_t i, std::size_t j) {
    const double factor = factors_[i * runs_ + j];
    for (std::size_t c = 0; c < columns; ++c) b[i * columns + c] -= factor * b[j * columns + c];
  };
  for (std::size_t i = 0; i < runs_; ++i)
    for (std::size_t j = 0; j < i; ++j) subtract(i, j);
  for (std::size_t i = runs_; i-- > 0;) {
    for (std::size_t j = i + 1; j < runs_; ++j) subtract(i, j);
    for (std::size_t c = 0; c < columns; ++c) b[i * columns + c] /= factors_[i * runs_ + i];
  }
}

template <class Number>
void CoarseExchange::correct(std::vector<Number>& x, std::size_t columns) const {
  if (runs_ == 0) return;
  std::vector<double> means(runs_ * columns);
  parallel_for(runs_, 8, [&](std::size_t first, std::size_t last) {
    for (std::size_t run = first; run < last; ++run) {
      double* mean = &means[run * columns];
      for (std::size_t i = begin_of(run); i < begin_of(run + 1); ++i) {
        if (open_[i] == 0) continue;
        for (std::size_t c = 0; c < columns; ++c)
          mean[c] += weight_[run] * static_cast<double>(x[i * columns + c]);
      }
    }
  });
  std::vector<double> solved = means;
  columns == 1   ? solve<1>(solved, columns)
  : columns == 8 ? solve<8>(solved, columns)
                 : solve<0>(solved, columns);
  parallel_for(runs_, 8, [&](std::size_t first, std::size_t last) {
    for (std::size_t run = first; run < last; ++run) {
      for (std::size_t i = begin_of(run); i < begin_of(run + 1); ++i) {
        if (open_[i] == 0) continue;
        for (std::size_t c = 0; c < columns; ++c)
          x[i * columns + c] +=
              static_cast<Number>(solved[run * columns + c] - means[run * columns + c]);
      }
    }
  });
}

template void CoarseExchange::correct(std::vector<float>&, std::size_t) const;
template void CoarseExchange::correct(std::vector<double>&, std::size_t) const;

}  // namespace scarp
