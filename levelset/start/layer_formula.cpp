#include "levelset/start/layer_formula.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "core/error.h"

namespace scarp {

namespace {

constexpr int highest_layer = 65535;
constexpr std::size_t most_operands = 1000;
constexpr int most_brackets = 100;

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

/// sum = product { ("+" | "-") product }, product = operand { "&" operand },
/// operand = number [ "/" number ] | "(" sum ")".
class LayerFormula::Reader {
 public:
  Reader(std::string_view text, LayerFormula& formula) : text_(text), formula_(formula) {}

  void run() {
    sum(0);
    if (at_ < text_.size())
      refuse(text_[at_] == ')' ? "has a bracket that nothing opens"
                               : "has no +, - or & before " + rest());
  }

 private:
  void sum(int depth) {
    product(depth);
    for (char c = next(); c == '+' || c == '-'; c = next()) {
      ++at_;
      product(depth);
      formula_.steps_.push_back({.operation = c});
    }
  }

  void product(int depth) {
    operand(depth);
    while (next() == '&') {
      ++at_;
      operand(depth);
      formula_.steps_.push_back({.operation = '&'});
    }
  }

  void operand(int depth) {
    if (next() == '(') {
      if (depth == most_brackets) refuse(fmt::format("has more than {} brackets", most_brackets));
      ++at_;
      sum(depth + 1);
      if (next() != ')') refuse("has a bracket that nothing closes");
      ++at_;
      return;
    }
    if (!is_digit(next()))
      refuse(at_ < text_.size() ? "has no layer at " + rest() : "ends too early");
    GdsLayer layer{.layer = number()};
    if (next() == '/') {
      ++at_;
      if (!is_digit(next())) refuse("has no datatype after the /");
      layer.datatype = number();
    }
    auto& layers = formula_.layers_;
    const auto found = std::find(layers.begin(), layers.end(), layer);
    formula_.steps_.push_back({.layer = static_cast<std::size_t>(found - layers.begin())});
    if (found == layers.end()) layers.push_back(layer);
    if (++operands_ > most_operands)
      refuse(fmt::format("names more than {} layers", most_operands));
  }

  int number() {
    int value = 0;
    while (at_ < text_.size() && is_digit(text_[at_])) {
      value = 10 * value + (text_[at_++] - '0');
      if (value > highest_layer) refuse(fmt::format("has a number above {}", highest_layer));
    }
    return value;
  }

  /// The next character that is no blank; 0 at the end.
  char next() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }

  std::string rest() const { return fmt::format("\"{}\"", text_.substr(at_)); }

  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError(
        fmt::format("\"{}\" {}; write layers or layer/datatype with + (union), - (difference), & "
                    "(intersection) and brackets, for example \"1/0 + (2 - 3/0)\"",
                    text_, why));
  }

  std::string_view text_;
  LayerFormula& formula_;
  std::size_t at_ = 0;
  std::size_t operands_ = 0;
};

LayerFormula::LayerFormula(std::string_view text) { Reader(text, *this).run(); }

std::vector<Loop> LayerFormula::region(const RegionGrid& grid,
                                       std::span<const std::vector<Loop>> regions) const {
  using Combination = RegionGrid::Combination;
  std::vector<std::vector<Loop>> stack;
  for (const Step& step : steps_) {
    if (step.operation == 0) {
      stack.push_back(regions[step.layer]);
      continue;
    }
    const std::vector<Loop> second = std::move(stack.back());
    stack.pop_back();
    stack.back() = grid.combined(stack.back(), second,
                                 step.operation == '+'   ? Combination::sum
                                 : step.operation == '-' ? Combination::difference
                                                         : Combination::intersection);
  }
  return stack.back();
}

}  // namespace scarp
