#include "core/error.h"

#include <cstdio>
#include <cstdlib>

#include "core/printable.h"

namespace scarp {

std::string in_quotes(std::string_view word) { return '"' + repeated(word) + '"'; }

namespace detail {

void assertion_failed(const char* text, const std::string& left, const std::string& right,
                      const char* file, int line) {
  std::fprintf(stderr,
               "%s:%d: scarp made a mistake: %s does not hold: %s against %s. Please report it.\n",
               file, line, text, left.c_str(), right.c_str());
  std::abort();
}

}  // namespace detail

}  // namespace scarp
