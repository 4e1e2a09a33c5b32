#pragma once

#include <string>

namespace scarp {

/// Rounded to so many digits and without an exponent, as people write it: "1000", "-23.5", "12346".
/// All digits before the point stay. What is below 0.0001 or not below 1e9 has an exponent.
std::string plain_number(double value, int digits);

/// What people say of a time that is known roughly: "40 s", "25 min", "3.5 h".
std::string plain_duration(double seconds);

}  // namespace scarp
