#pragma once

#include <span>

namespace scarp {

/// Elementary functions whose bits do not depend on the machine.
///
/// The ones of the C library pick fused instructions at run time where there are any, so their last
/// bit differs between machines. These use plain additions, products and quotients.

/// x to the power y for x > 0, and zero for other x; relative error below 1e-13 for |y| <= 10 and x
/// within a factor of 1e4 of 1.
double portable_power(double x, double y);

/// portable_power() of each of some numbers in place, to the bit; none of them may be subnormal.
void portable_powers(std::span<double> x, double y);

/// The natural logarithm of x > 0; absolute error below 2e-15 (1 + |ln x|).
double portable_log(double x);

/// e to the power x; relative error below 1e-13 for |x| <= 100. No number stays none.
double portable_exp(double x);

struct SineCosine {
  double sine;
  double cosine;
};

/// Sine and cosine for |angle| <= pi / 4; absolute error below 1e-15.
///
/// Taylor series: the first terms left out are below 1e-17. Written out, so that loops over angles
/// become vectors.
inline SineCosine portable_sine_cosine(double angle) {
  const double square = angle * angle;
  double sine = 1.0 / 1307674368000;
  sine = 1.0 / 6227020800 - sine * square;
  sine = 1.0 / 39916800 - sine * square;
  sine = 1.0 / 362880 - sine * square;
  sine = 1.0 / 5040 - sine * square;
  sine = 1.0 / 120 - sine * square;
  sine = 1.0 / 6 - sine * square;
  sine = 1.0 - sine * square;
  double cosine = 1.0 / 20922789888000;
  cosine = 1.0 / 87178291200 - cosine * square;
  cosine = 1.0 / 479001600 - cosine * square;
  cosine = 1.0 / 3628800 - cosine * square;
  cosine = 1.0 / 40320 - cosine * square;
  cosine = 1.0 / 720 - cosine * square;
  cosine = 1.0 / 24 - cosine * square;
  cosine = 1.0 / 2 - cosine * square;
  cosine = 1.0 - cosine * square;
  return {angle * sine, cosine};
}

/// Sine and cosine of angle + quarters pi / 2, for |angle| <= pi / 4 and a whole number of quarter
/// turns.
SineCosine portable_sine_cosine(double angle, double quarters);

}  // namespace scarp
