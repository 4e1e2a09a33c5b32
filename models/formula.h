#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace scarp {

/// Whether a word can name a number in formulas: letters of ASCII, digits and _, a letter or _
/// first, and not the name of a function.
bool is_formula_name(std::string_view word);

/// A rate as a formula of named numbers: "-20 nm/s * F * ion^0.5 - 3 nm/s".
///
/// Numbers, rates (a number and a unit, "0.5 um/min"), names, + - * / ^ and parentheses, and
/// min(a, b), max(a, b), sqrt(a), exp(a). Exponents are numbers. What is added has to be alike, and
/// the whole has to be a rate; a bare 0 is one. The bits do not depend on the machine.
class RateFormula {
 public:
  /// Throws: InputError that names the column, counted from 1, and what is wrong there.
  RateFormula(std::string_view text, std::span<const std::string> names);

  /// The rate for one value per name. Not finite where any part of the formula is not a number, as
  /// 0 / 0. Units: nm/s.
  float at(std::span<const float> values) const;

  /// As it was written.
  const std::string& text() const { return text_; }

 private:
  friend class FormulaParser;

  enum class Code : std::uint8_t {
    number,
    name,
    negate,
    add,
    subtract,
    multiply,
    divide,
    power,
    minimum,
    maximum,
    square_root,
    exponential
  };
  /// In the order of a stack machine: operands come first.
  struct Instruction {
    Code code;
    double number = 0;     ///< of Code::number, in nm/s for a rate; exponent of Code::power
    std::size_t name = 0;  ///< of Code::name
  };

  RateFormula() = default;
  static double of_one(Code code, double a, double exponent);
  static double of_two(Code code, double a, double b);

  std::string text_;
  std::vector<Instruction> program_;
};

}  // namespace scarp
