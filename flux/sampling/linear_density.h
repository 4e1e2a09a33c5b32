#pragma once

#include <span>
#include <vector>

namespace scarp {

/// A density of one variable, linear between the points of a table and 0 outside.
class LinearDensity {
 public:
  /// None.
  LinearDensity() = default;

  /// Need not be normalised.
  ///
  /// Throws: InputError unless there are two or more arguments that ascend, and densities are
  ///         finite, not negative and not all zero; the message says what is wrong with the table,
  ///         not where it stands.
  LinearDensity(std::span<const double> arguments, std::span<const double> densities);

  bool empty() const { return x_.empty(); }

  /// Its integral is 1.
  double at(double x) const;

  /// The place below which a part u in [0, 1] lies: exact, so that a density and what is drawn from
  /// it agree to the last digits.
  double quantile(double u) const;

  /// The ends of where it is not zero.
  double lowest() const { return x_.front(); }
  double highest() const { return x_.back(); }

 private:
  std::vector<double> x_;
  std::vector<double> density_;
  std::vector<double> below_;  // the part below each argument
};

/// An interval of a linear density, and a part of its integral from the lower end on.
struct LinearPart {
  double width = 0;
  double low = 0;
  double high = 0;
  double part = 0;
};

/// How far from the lower end that part reaches; at most the width.
double reach(const LinearPart& interval);

}  // namespace scarp
