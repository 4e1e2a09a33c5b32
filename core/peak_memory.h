#pragma once

namespace scarp {

/// The most memory that this process has held at once. Units: MB of 1024 * 1024 bytes.
double peak_memory_mb();

}  // namespace scarp
