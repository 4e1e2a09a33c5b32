#pragma once

#include "apps/scarp/command_line.h"

namespace scarp {

/// One function per command, each in command_NAME.cpp.
/// @return the exit code; exceptions of core/error.h mean wrong input or a simulation that cannot
/// go on
ExitCode execute(const RunArguments& arguments, const CommonOptions& common);
ExitCode execute(const CheckArguments& arguments, const CommonOptions& common);
ExitCode execute(const PreviewArguments& arguments, const CommonOptions& common);
ExitCode execute(const SimplifyArguments& arguments, const CommonOptions& common);
ExitCode execute(const FluxArguments& arguments, const CommonOptions& common);
ExitCode execute(const DistanceArguments& arguments, const CommonOptions& common);
ExitCode execute(const MeasureArguments& arguments, const CommonOptions& common);
ExitCode execute(const SectionArguments& arguments, const CommonOptions& common);
ExitCode execute(const CompareArguments& arguments, const CommonOptions& common);
ExitCode execute(const BaselineArguments& arguments, const CommonOptions& common);
ExitCode execute(const VolumeArguments& arguments, const CommonOptions& common);
ExitCode execute(const RenderArguments& arguments, const CommonOptions& common);
ExitCode execute(const ReportArguments& arguments, const CommonOptions& common);
ExitCode execute(const ModelsArguments& arguments, const CommonOptions& common);

}  // namespace scarp
