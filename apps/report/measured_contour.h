#pragma once

#include <filesystem>
#include <string>

#include "apps/report/comparison.h"

namespace scarp {

/// Compares the profile of a run or a state with a contour that was measured, such as one from a
/// picture of a microscope: distances both ways where the contour is, its depth, and its widths at
/// 10, 50 and 90 % of that. The contour is the reference.
///
/// The file has a head "x [um],z [um]" (any unit of length) and a point per line, along the
/// surface from field to field, in the coordinates of the recipe. If the last point is the first
/// one, it is compared with the nearest void.
///
/// Shape:  line as for parse_section.
/// Throws: InputError if it cannot be read, has fewer than three points, or lies beside the wafer.
Comparison compare_with_contour(const std::filesystem::path& where,
                                const std::filesystem::path& contour, const std::string& line,
                                const Tolerances& tolerances);

}  // namespace scarp
