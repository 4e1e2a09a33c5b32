#pragma once

#include <cstdio>
#include <string>

namespace scarp {

/// Writes to standard error. Where nobody can be told nothing happens, unlike fmt::print, which
/// throws and so would end what it only reports.
inline void tell(const std::string& text) { std::fputs(text.c_str(), stderr); }

}  // namespace scarp
