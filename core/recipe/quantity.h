#pragma once

#include <string>
#include <string_view>

#include "core/vec3.h"

namespace scarp {

/// The kinds of values that a recipe holds.
///
/// Units: inside, in this order: nm, s, eV, rad, nm/s, 1e15 cm^-2 s^-1, 1e22 cm^-3, 1e15 cm^-2, K,
/// Pa, nm^2/s, 1 (a percentage as a part of the whole), 1.
enum class Dimension {
  length,
  time,
  energy,
  angle,
  rate,
  flux,
  density,
  areal_density,
  temperature,
  pressure,
  diffusivity,
  percentage,
  number,
};

/// A metre: lengths of a wafer's topography beyond it are taken for mistakes of units. Units: nm.
constexpr double longest_length = 1e9;

/// The value of a text such as "4 um", "1 um/min" or "12e15 /cm2/s" in the unit of the inside.
///
/// Texts that mean the same give the same bits as far as their units differ by powers of ten ("0.4
/// um" and "400 nm"). Does not depend on the locale.
/// Throws: InputError that says what is wrong and shows a text that is right; it names no place.
double parse_quantity(std::string_view text, Dimension dimension);

/// A short text that parse_quantity turns into the same bits. The value has to be finite.
std::string format_quantity(double value, Dimension dimension);

/// The shortest decimal text of the same bits, without a unit; dots and digits whatever the locale.
std::string format_number(double value);

/// Rounded to six digits, for messages: "12.3457", "1e+06".
std::string rounded_number(double value);
/// A place so: "(12.3457, 0, -1e-07)".
std::string rounded_place(const Vec3d& r);

/// "a length", "an angle", ...
std::string_view dimension_name(Dimension dimension);

/// A text that parse_quantity accepts, to show how one is written: "5 nm".
std::string quantity_example(Dimension dimension, std::string_view number = "5");

/// The unit that the inside uses, as a recipe writes it: "nm", "nm/s", ...; empty for numbers and
/// percentages.
std::string_view inside_unit(Dimension dimension);

}  // namespace scarp
