#pragma once

#include <string>

namespace scarp {

/// The most memory that this process has held at once. Units: MB of 1024 * 1024 bytes.
double peak_memory_mb();

/// What this process may hold: the memory of the machine, or what its control group (of a batch
/// system or a container) allows where that is less. limit_file: where the group says so, in bytes;
/// "max", or no file, is no limit. Units: MB of 1024 * 1024 bytes.
double available_memory_mb(const std::string& limit_file = "/sys/fs/cgroup/memory.max");

}  // namespace scarp
