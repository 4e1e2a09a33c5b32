#pragma once

#include "levelset/grid/layers.h"
#include "levelset/grid/scheme.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// Largest part of a spacing by which the surface may move in one time step: Godunov's scheme is
/// monotone up to 1 / sqrt(3), the band follows up to 1.
inline constexpr double max_cfl = 0.577;

/// Moves the top layer by its speeds for dt, re-distances it, and cuts the lower layers by it.
///
/// Speeds that depend on the normal are moved by the local Lax-Friedrichs scheme, with WENO5 where
/// ENO2 is asked for: with ENO2 a facet 10 spacings long would lie a spacing too deep.
///
/// Bit for bit the same for any number of threads; symmetric to the last bit under mirroring in x
/// and y and under exchange of the two.
///
/// Returns the volume of residues, see keep_inert_layers; of all else that goes, speeds tell.
///
/// Units:  dt in s, at most that in which the fastest place moves by max_cfl; the volume in nm^3.
/// Throws: NumericalError for a speed that is not finite.
/// Cost:   see docs; linear in the area of the surface.
/// Source: Osher and Sethian 1988; Shu and Osher 1988 (TVD Runge-Kutta); differences.h.
double advect(Layers& layers, const SpeedField& field, double dt, Scheme scheme = Scheme::eno2);

}  // namespace scarp
