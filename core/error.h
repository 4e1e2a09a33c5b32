// A public header: installed as scarp/core/error.h.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace scarp {

/// One thing that is wrong with an input.
struct Problem {
  std::string place;  ///< "recipe.toml:12:3: step[0].rate"; empty where what says it
  std::string what;
  std::string remedy;  ///< empty where what leaves nothing to say

  /// As a message has it: "place: what; remedy".
  std::string text() const;
};

/// What is wrong and what to do about it, which a message parts by its first "; ".
Problem problem_at(std::string place, std::string_view text);

/// The input is wrong and the user can mend it. The message says where, what is wrong and what is
/// allowed, a line for each problem. Exit code 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& text) : InputError(std::vector{problem_at("", text)}) {}
  explicit InputError(std::vector<Problem> problems);

  /// At least one.
  const std::vector<Problem>& problems() const { return *problems_; }

 private:
  std::shared_ptr<const std::vector<Problem>> problems_;  // errors are copied without throwing
};

/// The simulation could not go on. The message says step, time, place and value. Exit code 3.
class NumericalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A word of the user as messages show it.
std::string in_quotes(std::string_view word);

namespace detail {
[[noreturn]] void assertion_failed(const char* text, const std::string& left,
                                   const std::string& right, const char* file, int line);
}  // namespace detail

}  // namespace scarp

/// A mistake of ours, not of the user: prints both operands and aborts. Checked in every build, so
/// keep it out of inner loops.
#define SCARP_ASSERT(left, op, right)                                                         \
  do {                                                                                        \
    const auto& scarp_left = (left);                                                          \
    const auto& scarp_right = (right);                                                        \
    if (!(scarp_left op scarp_right)) {                                                       \
      ::scarp::detail::assertion_failed(#left " " #op " " #right, std::to_string(scarp_left), \
                                        std::to_string(scarp_right), __FILE__, __LINE__);     \
    }                                                                                         \
  } while (false)
