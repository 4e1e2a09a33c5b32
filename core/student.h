#pragma once

namespace scarp {

/// The chance that a mean lies within t standard errors of the truth, on either side, where the
/// standard error comes from values with so many degrees of freedom.
///
/// Source: Abramowitz and Stegun, 26.7.3 and 26.7.4.
double student_probability(double t, int degrees_of_freedom);

/// The chance to be more than three standard errors off that are known exactly: 0.27 %.
double three_standard_errors_chance();

/// How many standard errors leave a chance of a larger error. Infinity without degrees of freedom.
double standard_errors(double chance, int degrees_of_freedom);

/// How many standard errors leave the chance that three would if they were known exactly (0.27 %):
/// 6.6 with four degrees of freedom, 3.3 with thirty. Infinity without any.
double three_standard_errors(int degrees_of_freedom);

}  // namespace scarp
