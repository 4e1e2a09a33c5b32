#pragma once

namespace scarp {

/// Elementary functions whose bits do not depend on the machine.
///
/// The ones of the C library pick fused instructions at run time where there are any, so their last
/// bit differs between machines. These use plain additions, products and quotients.

/// x to the power y for 0 <= x <= 1, with zero for x = 0; relative error below 1e-13 for |y| <= 10.
double portable_power(double x, double y);

struct SineCosine {
  double sine;
  double cosine;
};

/// Sine and cosine for |angle| <= pi / 4; absolute error below 1e-15.
SineCosine portable_sine_cosine(double angle);

}  // namespace scarp
