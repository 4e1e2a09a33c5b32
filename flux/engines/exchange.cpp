#include "flux/engines/exchange.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <string>
#include <type_traits>

#include "core/error.h"
#include "core/parallel.h"
#include "core/recipe/quantity.h"
#include "core/vector_kernel.h"
#include "flux/engines/coarse_exchange.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 512;  // rows
constexpr int max_iterations = 2000;

// The error of the iteration is estimated within a factor of two or so.
constexpr double margin = 0.25;

constexpr double square(double x) { return x * x; }

template <class Number>
using Block = std::vector<Number>;

// One number per column.
using Scalars = std::vector<double>;

// A quotient that switches a column off when it has nothing left to do.
double ratio(double a, double b) {
  const double quotient = a / b;
  return std::isfinite(quotient) ? quotient : 0;
}

// The number of columns where it is known when this is compiled: loops over them then need no
// counter.
inline constexpr std::size_t any_number = 0;

// y = x - K scaled, for some rows.
template <std::size_t Columns, class Number>
void subtract_seen(const ExchangeRows& rows, std::size_t columns, const Number* scaled,
                   const Number* x, Number* y, std::size_t begin, std::size_t end) {
  std::conditional_t<Columns == any_number, std::vector<Number>, std::array<Number, Columns>> sum{};
  if constexpr (Columns == any_number) sum.resize(columns);
  for (std::size_t i = begin; i < end; ++i) {
    std::ranges::fill(sum, Number{0});
    rows.for_each_part(i, [&](std::size_t hit, double part) {
      const Number* row = &scaled[hit * columns];
      for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += static_cast<Number>(part) * row[c];
    });
    for (std::size_t c = 0; c < sum.size(); ++c) y[i * columns + c] = x[i * columns + c] - sum[c];
  }
}

// The same for eight columns, as vectors along the row: left to itself, the compiler takes rows
// together instead of columns.
SCARP_VECTOR_KERNEL void subtract_seen(const ExchangeRows& rows, const float* scaled,
                                       const float* x, float* y, std::size_t begin,
                                       std::size_t end) {
  using Eight [[gnu::vector_size(8 * sizeof(float))]] = float;
  for (std::size_t i = begin; i < end; ++i) {
    Eight rest;
    std::memcpy(&rest, &x[8 * i], sizeof(rest));
    Eight sum{};
    for (std::uint64_t k = rows.first[i]; k < rows.first[i + 1]; ++k) {
      Eight row;
      std::memcpy(&row, &scaled[std::size_t{8} * rows.seen[k].hit], sizeof(row));
      sum += rows.seen[k].part * row;
    }
    rest -= sum;
    std::memcpy(&y[8 * i], &rest, sizeof(rest));
  }
}

template <class Number, std::size_t Columns>
class Iteration {
 public:
  Iteration(const ExchangeRows& rows, std::span<const float> reemitted,
            const CoarseExchange& coarse, std::span<const Number> b, std::size_t columns)
      : rows_(rows),
        reemitted_(reemitted),
        coarse_(coarse),
        b_(b),
        columns_(Columns == any_number ? columns : Columns) {}

  Block<Number> solve(std::span<const Number> start, double tolerance);

 private:
  std::size_t columns() const { return Columns == any_number ? columns_ : Columns; }
  Block<Number> block() const { return Block<Number>(rows_.size() * columns()); }

  template <class Body>
  void for_each_entry(const Body& body) const {
    parallel_for(rows_.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        for (std::size_t c = 0; c < columns(); ++c) body(i * columns() + c, c);
    });
  }

  // Sums over fixed ranges of rows, then over ranges in their order: the same bits for any number
  // of threads.
  Scalars dot(std::span<const Number> x, std::span<const Number> y) const;

  // x - K (c x)
  void apply(const Block<Number>& x, Block<Number>& y);
  Block<Number> corrected(Block<Number> x) const {
    coarse_.correct(x, columns());
    return x;
  }
  bool iterate(Block<Number>& x, double tolerance);

  const ExchangeRows& rows_;
  std::span<const float> reemitted_;
  const CoarseExchange& coarse_;
  std::span<const Number> b_;
  std::size_t columns_;
  Block<Number> scaled_;
};

template <class Number, std::size_t Columns>
Scalars Iteration<Number, Columns>::dot(std::span<const Number> x,
                                        std::span<const Number> y) const {
  const std::size_t ranges = (rows_.size() + grain - 1) / grain;
  Scalars partial(ranges * columns());
  parallel_for(rows_.size(), grain, [&](std::size_t begin, std::size_t end) {
    double* sums = &partial[begin / grain * columns()];
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t c = 0; c < columns(); ++c)
        sums[c] +=
            static_cast<double>(x[i * columns() + c]) * static_cast<double>(y[i * columns() + c]);
  });
  Scalars sums(columns());
  for (std::size_t k = 0; k < partial.size(); ++k) sums[k % columns()] += partial[k];
  return sums;
}

template <class Number, std::size_t Columns>
void Iteration<Number, Columns>::apply(const Block<Number>& x, Block<Number>& y) {
  scaled_.resize(x.size());
  parallel_for(rows_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t k = i * columns(); k < (i + 1) * columns(); ++k)
        scaled_[k] = static_cast<Number>(reemitted_[i]) * x[k];
  });
  parallel_for(rows_.size(), grain, [&](std::size_t begin, std::size_t end) {
    if constexpr (Columns == 8 && std::is_same_v<Number, float>)
      subtract_seen(rows_, scaled_.data(), x.data(), y.data(), begin, end);
    else
      subtract_seen<Columns>(rows_, columns(), scaled_.data(), x.data(), y.data(), begin, end);
  });
}

// One run of the recurrence from x; true once every column is known to its tolerance. A column that
// is there, or whose recurrence breaks down, stays; the next run starts it again.
template <class Number, std::size_t Columns>
bool Iteration<Number, Columns>::iterate(Block<Number>& x, double tolerance) {
  Block<Number> r = block();
  apply(x, r);
  for_each_entry([&](std::size_t k, std::size_t) { r[k] = b_[k] - r[k]; });
  std::vector<char> active(columns(), 1);
  // The corrected residual is about what x still lacks.
  const auto all_done = [&](const Block<Number>& lacks) {
    const Scalars squares = dot(lacks, lacks);
    const Scalars goal = dot(x, x);
    bool done = true;
    for (std::size_t c = 0; c < columns(); ++c) {
      if (squares[c] <= square(margin * tolerance) * goal[c]) active[c] = 0;
      done = done && active[c] == 0;
    }
    return done;
  };
  if (all_done(corrected(r))) return true;

  const Block<Number> shadow = r;
  Block<Number> p = r;
  Block<Number> v = block();
  Block<Number> t = block();
  Scalars rho = dot(shadow, r);
  Scalars alpha(columns());
  Scalars beta(columns());
  Scalars omega(columns());
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const Block<Number> along_p = corrected(p);
    apply(along_p, v);
    const Scalars projection = dot(shadow, v);
    for (std::size_t c = 0; c < columns(); ++c)
      alpha[c] = active[c] == 0 ? 0 : ratio(rho[c], projection[c]);
    for_each_entry([&](std::size_t k, std::size_t c) {
      x[k] += static_cast<Number>(alpha[c]) * along_p[k];
      r[k] -= static_cast<Number>(alpha[c]) * v[k];
    });
    const Block<Number> along_r = corrected(r);
    if (all_done(along_r)) return false;  // by the recurrence; the caller asks the true residual
    apply(along_r, t);
    const Scalars tr = dot(t, r);
    const Scalars tt = dot(t, t);
    for (std::size_t c = 0; c < columns(); ++c) omega[c] = active[c] == 0 ? 0 : ratio(tr[c], tt[c]);
    for_each_entry([&](std::size_t k, std::size_t c) {
      x[k] += static_cast<Number>(omega[c]) * along_r[k];
      r[k] -= static_cast<Number>(omega[c]) * t[k];
    });
    const Scalars next = dot(shadow, r);
    bool stuck = true;
    for (std::size_t c = 0; c < columns(); ++c) {
      beta[c] = ratio(next[c], rho[c]) * ratio(alpha[c], omega[c]);
      stuck = stuck && beta[c] == 0;
    }
    if (stuck) return false;
    rho = next;
    for_each_entry([&](std::size_t k, std::size_t c) {
      p[k] = r[k] + static_cast<Number>(beta[c]) * (p[k] - static_cast<Number>(omega[c]) * v[k]);
    });
  }
  return false;
}

template <class Number, std::size_t Columns>
Block<Number> Iteration<Number, Columns>::solve(std::span<const Number> start, double tolerance) {
  constexpr int restarts = 8;
  Block<Number> x(start.begin(), start.end());
  // Next to nothing no error is small.
  const Scalars squares = dot(b_, b_);
  for_each_entry([&](std::size_t k, std::size_t c) {
    if (squares[c] == 0) x[k] = 0;
  });
  for (int run = 0; run < restarts; ++run)
    if (iterate(x, tolerance)) return x;
  throw NumericalError("flux: the exchange between facets did not converge to " +
                       rounded_number(tolerance) + " on " + std::to_string(rows_.size()) +
                       " elements; use flux.engine = \"forward\"");
}

}  // namespace

ExchangeRows::ExchangeRows(const ExchangeMatrix& matrix) : sees_sky(matrix.size()) {
  const std::size_t size = matrix.size();
  std::vector<std::vector<Seen>> ranges((size + grain - 1) / grain);
  first.resize(size + 1);
  parallel_for(size, grain, [&](std::size_t begin, std::size_t end) {
    std::vector<Seen>& range = ranges[begin / grain];
    std::vector<double> part_of(size);  // of what the row has met
    std::vector<std::uint32_t> hits;
    for (std::size_t i = begin; i < end; ++i) {
      hits.clear();
      matrix.for_each_part(i, [&](std::uint32_t hit, double part) {
        if (hit >= size) {
          sees_sky[i] = 1;
        } else if (part != 0) {
          if (part_of[hit] == 0) hits.push_back(hit);
          part_of[hit] += part;
        }
      });
      for (const std::uint32_t hit : hits) {
        range.push_back({hit, static_cast<float>(part_of[hit])});
        part_of[hit] = 0;
      }
      first[i + 1] = hits.size();
    }
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
  seen.reserve(first.back());
  for (std::vector<Seen>& range : ranges) {
    seen.insert(seen.end(), range.begin(), range.end());
    range = {};  // so that all is not held twice
  }
}

ExchangeSolver::ExchangeSolver(const ExchangeRows& rows, std::span<const float> reemitted)
    : rows_(rows),
      reemitted_(reemitted),
      coarse_(std::make_unique<CoarseExchange>(rows, reemitted)) {}

ExchangeSolver::~ExchangeSolver() = default;

template <class Number>
std::vector<Number> ExchangeSolver::solve(std::span<const Number> b, std::size_t columns,
                                          double tolerance, std::span<const Number> start) const {
  if (start.empty()) start = b;
  const auto solve_with = [&]<std::size_t Columns>(std::integral_constant<std::size_t, Columns>) {
    return Iteration<Number, Columns>(rows_, reemitted_, *coarse_, b, columns)
        .solve(start, tolerance);
  };
  if (columns == 1) return solve_with(std::integral_constant<std::size_t, 1>{});
  if (columns == 8) return solve_with(std::integral_constant<std::size_t, 8>{});
  return solve_with(std::integral_constant<std::size_t, any_number>{});
}

template std::vector<float> ExchangeSolver::solve(std::span<const float>, std::size_t, double,
                                                  std::span<const float>) const;
template std::vector<double> ExchangeSolver::solve(std::span<const double>, std::size_t, double,
                                                   std::span<const double>) const;

}  // namespace scarp
