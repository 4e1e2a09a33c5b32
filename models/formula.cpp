#include "models/formula.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/limits.h"
#include "core/recipe/quantity.h"
#include "core/suggestion.h"
#include "flux/sampling/portable_math.h"

namespace scarp {

namespace {

constexpr std::size_t deepest = 64;  // of parentheses
// Each holds back a term, a factor, and the first value of a function.
constexpr std::size_t largest_stack = 3 * deepest;
constexpr std::size_t longest_text = 4096;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool starts_name(char c) { return is_letter(c) || c == '_'; }
bool is_in_name(char c) { return starts_name(c) || is_digit(c); }

// The text of a formula, read from left to right.
class FormulaText {
 public:
  explicit FormulaText(std::string_view text) : text_(text) {}

  std::size_t place() const { return place_; }
  bool is_at_end() const { return place_ >= text_.size(); }
  // The place of the next word.
  std::size_t next() {
    skip_spaces();
    return place_;
  }
  bool is_at_name() const { return !is_at_end() && starts_name(text_[place_]); }

  [[noreturn]] void fail(std::size_t place, const std::string& what) const {
    // Bytes that continue a character of UTF-8 do not count.
    const auto before = text_.substr(0, place);
    const auto column = 1 + std::count_if(before.begin(), before.end(), [](char c) {
                          return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
                        });
    throw InputError("column " + std::to_string(column) + ": " + what);
  }

  void skip_spaces() {
    while (place_ < text_.size() && (text_[place_] == ' ' || text_[place_] == '\t')) ++place_;
  }

  bool take(char c) {
    skip_spaces();
    if (place_ >= text_.size() || text_[place_] != c) return false;
    ++place_;
    return true;
  }

  std::optional<double> number() {
    double value = 0;
    if (place_ >= text_.size() || text_[place_] == '-') return std::nullopt;
    const char* const begin = text_.data() + place_;
    const char* const end = text_.data() + text_.size();
    if (!is_digit(*begin) && *begin != '.') return std::nullopt;
    const auto [rest, problem] = std::from_chars(begin, end, value);
    if (problem != std::errc{}) return std::nullopt;
    if (value > largest_number)
      fail(place_, "the number is beyond what may be, " + format_number(largest_number));
    place_ += static_cast<std::size_t>(rest - begin);
    return value;
  }

  std::string_view name() {
    const std::size_t at = place_;
    while (!is_at_end() && is_in_name(text_[place_])) ++place_;
    return text_.substr(at, place_ - at);
  }

  // Letters, a slash, letters; nothing is taken where there is no unit. The place after it, if any.
  bool take_unit() {
    const std::size_t before = place_;
    skip_spaces();
    if (is_at_end() || !starts_unit()) {
      place_ = before;
      return false;
    }
    while (!is_at_end() && (starts_unit() || text_[place_] == '/')) ++place_;
    return true;
  }
  // What was read since a place.
  std::string since(std::size_t at) const { return std::string(text_.substr(at, place_ - at)); }

 private:
  // Also the bytes of the micro sign.
  bool starts_unit() const {
    const char c = text_[place_];
    return is_letter(c) || static_cast<unsigned char>(c) >= 0x80;
  }

  std::string_view text_;
  std::size_t place_ = 0;
};

}  // namespace

/// Recursive descent; every rule returns whether its value is a rate, and appends its program.
class FormulaParser {
  using Code = RateFormula::Code;
  enum class Kind { number, rate };

 public:
  struct Function {
    std::string_view name;
    Code code;
    int arguments;
  };
  static const Function* find_function(std::string_view name) {
    static constexpr std::array functions{
        Function{"min", Code::minimum, 2}, Function{"max", Code::maximum, 2},
        Function{"sqrt", Code::square_root, 1}, Function{"exp", Code::exponential, 1}};
    const auto* const found = std::find_if(functions.begin(), functions.end(),
                                           [name](const Function& f) { return f.name == name; });
    return found == functions.end() ? nullptr : found;
  }

  FormulaParser(std::string_view text, std::span<const std::string> names)
      : text_(text), names_(names) {
    if (text.size() > longest_text) text_.fail(0, "the formula is longer than 4096 characters");
  }

  RateFormula parse() {
    const Kind kind = sum();
    if (text_.skip_spaces(); !text_.is_at_end())
      text_.fail(text_.place(), "expected an operator or the end");
    if (kind == Kind::number && !is_zero()) {
      text_.fail(0,
                 "the formula is a number, not a rate; write its rates with a unit, for example "
                 "\"-20 nm/s * F\"");
    }
    return std::move(formula_);
  }

 private:
  bool is_zero() const {
    return formula_.program_.size() == 1 && formula_.program_[0].code == Code::number &&
           formula_.program_[0].number == 0;
  }

  void append(Code code, double number = 0, std::size_t name = 0) {
    formula_.program_.push_back({code, number, name});
  }

  Kind sum() {
    if (++nesting_ > deepest) text_.fail(text_.place(), "the formula is nested too deeply");
    Kind kind = product();
    for (;;) {
      const std::size_t at = text_.next();
      const bool plus = text_.take('+');
      if (!plus && !text_.take('-')) break;
      if (product() != kind) text_.fail(at, "a rate and a number cannot be added");
      append(plus ? Code::add : Code::subtract);
    }
    --nesting_;
    return kind;
  }

  Kind product() {
    Kind kind = factor();
    for (;;) {
      const std::size_t at = text_.next();
      const bool times = text_.take('*');
      if (!times && !text_.take('/')) break;
      const Kind right = factor();
      if (times && kind == Kind::rate && right == Kind::rate)
        text_.fail(at, "a rate times a rate is no rate");
      if (!times && kind == Kind::number && right == Kind::rate)
        text_.fail(at, "a number over a rate is no rate");
      if (right == Kind::rate) kind = times ? Kind::rate : Kind::number;
      append(times ? Code::multiply : Code::divide);
    }
    return kind;
  }

  // A power with signs before it.
  Kind factor() {
    bool negative = false;
    while (text_.take('-')) negative = !negative;
    const Kind kind = power();
    if (negative) append(Code::negate);
    return kind;
  }

  Kind power() {
    const Kind kind = primary();
    const std::size_t at = text_.next();
    if (!text_.take('^')) return kind;
    if (kind == Kind::rate) text_.fail(at, "a power of a rate is no rate");
    const bool negative = text_.take('-');
    text_.skip_spaces();
    const std::optional<double> exponent = text_.number();
    if (!exponent) text_.fail(text_.place(), "expected a number as the exponent");
    if (*exponent > 10) text_.fail(at, "an exponent is at most 10");
    append(Code::power, negative ? -*exponent : *exponent);
    return Kind::number;
  }

  Kind primary() {
    const std::size_t at = text_.next();
    if (text_.take('(')) {
      const Kind kind = sum();
      if (!text_.take(')'))
        text_.fail(text_.place(), "expected ) for the ( in column " + std::to_string(at + 1));
      return kind;
    }
    if (const std::optional<double> value = text_.number()) return quantity(at, *value);
    if (text_.is_at_name()) return name();
    text_.fail(
        at, !text_.is_at_end() ? "expected a number, a name or (" : "the formula ends too early");
  }

  // A number alone, or with the unit of a rate: letters, a slash, letters.
  Kind quantity(std::size_t at, double value) {
    if (!text_.take_unit()) {
      append(Code::number, value);
      return Kind::number;
    }
    try {
      append(Code::number, parse_quantity(text_.since(at), Dimension::rate));
    } catch (const InputError& error) {
      text_.fail(at, error.what());
    }
    return Kind::rate;
  }

  Kind name() {
    const std::size_t at = text_.place();
    const std::string written(text_.name());
    if (const Function* const function = find_function(written)) return call(*function);
    const auto found = std::find(names_.begin(), names_.end(), written);
    if (found == names_.end()) {
      text_.fail(at, "there is no " + written + suggestion(written, names_) + known_names());
    }
    append(Code::name, 0, static_cast<std::size_t>(found - names_.begin()));
    return Kind::number;
  }

  std::string known_names() const {
    std::string all;
    for (const std::string& name : names_) all += (all.empty() ? "; there are " : ", ") + name;
    return all.empty() ? "; there are no names here" : all;
  }

  // What takes several values takes rates, too, if all are.
  Kind call(const Function& function) {
    const std::string name(function.name);
    const std::size_t at = text_.place();
    if (!text_.take('(')) text_.fail(at, "expected ( after " + name);
    const Kind kind = sum();
    if (function.arguments == 1 && kind == Kind::rate)
      text_.fail(at, name + " of a rate is no rate");
    for (int n = 1; n < function.arguments; ++n) {
      if (!text_.take(','))
        text_.fail(text_.place(), name + " takes two values, with a comma between");
      if (sum() != kind) text_.fail(at, name + " of a rate and a number");
    }
    append(function.code);
    if (!text_.take(')')) text_.fail(text_.place(), "expected ) after the values of " + name);
    return kind;
  }

  FormulaText text_;
  std::span<const std::string> names_;
  std::size_t nesting_ = 0;
  RateFormula formula_;
};

bool is_formula_name(std::string_view word) {
  return !word.empty() && starts_name(word.front()) &&
         std::all_of(word.begin(), word.end(), is_in_name) &&
         FormulaParser::find_function(word) == nullptr;
}

RateFormula::RateFormula(std::string_view text, std::span<const std::string> names)
    : RateFormula(FormulaParser(text, names).parse()) {
  text_ = text;
}

double RateFormula::of_one(Code code, double a, double exponent) {
  switch (code) {
    case Code::negate:
      return -a;
    case Code::power:
      if (a < 0) return std::numeric_limits<double>::quiet_NaN();
      if (a == 0) return exponent > 0 ? 0 : std::numeric_limits<double>::infinity();
      return portable_power(a, exponent);
    case Code::square_root:
      return std::sqrt(a);
    default:
      return portable_exp(a);
  }
}

double RateFormula::of_two(Code code, double a, double b) {
  switch (code) {
    case Code::add:
      return a + b;
    case Code::subtract:
      return a - b;
    case Code::multiply:
      return a * b;
    case Code::divide:
      return a / b;
    case Code::minimum:
      return a < b || std::isnan(a) ? a : b;
    default:
      return a > b || std::isnan(a) ? a : b;
  }
}

float RateFormula::at(std::span<const float> values) const {
  std::array<double, largest_stack> stack;
  std::size_t size = 0;
  for (const Instruction& instruction : program_) {
    switch (instruction.code) {
      case Code::number:
        stack[size++] = instruction.number;
        break;
      case Code::name:
        stack[size++] = values[instruction.name];
        break;
      case Code::negate:
      case Code::power:
      case Code::square_root:
      case Code::exponential:
        stack[size - 1] = of_one(instruction.code, stack[size - 1], instruction.number);
        break;
      default:
        stack[size - 2] = of_two(instruction.code, stack[size - 2], stack[size - 1]);
        --size;
        break;
    }
  }
  return static_cast<float>(stack[0]);
}

}  // namespace scarp
