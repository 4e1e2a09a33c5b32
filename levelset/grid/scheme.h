#pragma once

namespace scarp {

/// Order in space and time.
///
/// On surfaces that are smooth on the scale of the grid, phi next to the surface has that order; at
/// edges all have order one, with an error that falls from first_order to weno5.
enum class Scheme {
  first_order,  ///< upwind differences, one Euler step
  eno2,         ///< ENO2 differences, TVD Runge-Kutta 2
  weno5,        ///< WENO5 differences, TVD Runge-Kutta 3
};

}  // namespace scarp
