#pragma once

namespace scarp {

/// Elementary functions whose bits do not depend on the machine.
///
/// The ones of the C library pick fused instructions at run time where there are any, so their last
/// bit differs between machines. These use plain additions, products and quotients.

/// x to the power y for x > 0, and zero for other x; relative error below 1e-13 for |y| <= 10 and x
/// within a factor of 1e4 of 1.
double portable_power(double x, double y);

/// The natural logarithm of x > 0; absolute error below 2e-15 (1 + |ln x|).
double portable_log(double x);

/// e to the power x; relative error below 1e-13 for |x| <= 100. No number stays none.
double portable_exp(double x);

struct SineCosine {
  double sine;
  double cosine;
};

/// Sine and cosine for |angle| <= pi / 4; absolute error below 1e-15.
SineCosine portable_sine_cosine(double angle);

/// Sine and cosine of angle + quarters pi / 2, for |angle| <= pi / 4 and a whole number of quarter
/// turns.
SineCosine portable_sine_cosine(double angle, double quarters);

}  // namespace scarp
