#pragma once

#include <filesystem>
#include <string>

namespace scarp {

/// The page of a run: its surface in space and in cross-sections, metrology and errors over time,
/// where the time went, recipe and versions; docs/report.md.
///
/// A run that is not complete has what is there.
/// Throws: InputError if the folder holds no run, or a file of it cannot be read.
std::string run_page(const std::filesystem::path& folder);

/// The page of a comparison: it is made again from the runs that its compare.json names.
///
/// Throws: InputError if there is none, or one of the runs cannot be read.
std::string comparison_page(const std::filesystem::path& folder);

}  // namespace scarp
