#include "core/error.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "core/printable.h"

namespace scarp {

namespace {

std::string joined(const std::vector<Problem>& problems) {
  std::string text;
  for (const Problem& each : problems) text.append(text.empty() ? "" : "\n").append(each.text());
  return text;
}

}  // namespace

std::string Problem::text() const {
  return (place.empty() ? "" : place + ": ") + what + (remedy.empty() ? "" : "; " + remedy);
}

Problem problem_at(std::string place, std::string_view text) {
  constexpr std::string_view parting = "; ";
  const std::size_t end = std::min(text.find(parting), text.size());
  const std::size_t next = std::min(end + parting.size(), text.size());
  return {.place = std::move(place),
          .what = std::string(text.substr(0, end)),
          .remedy = std::string(text.substr(next))};
}

InputError::InputError(std::vector<Problem> problems)
    : std::runtime_error(joined(problems)),
      problems_(std::make_shared<const std::vector<Problem>>(std::move(problems))) {}

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
