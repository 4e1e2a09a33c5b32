#pragma once

#include "apps/scarp/commands.h"

namespace scarp {

/// scarp volume, where all regions go into one mesh.
ExitCode write_regions(const VolumeArguments& arguments, const CommonOptions& common);

/// Whether the name of the file asks for that.
bool holds_regions(const std::string& file);

}  // namespace scarp
