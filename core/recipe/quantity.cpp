#include "core/recipe/quantity.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/trimmed.h"

namespace scarp {

namespace {

/// Powers of the base quantities.
struct Powers {
  int length = 0;
  int time = 0;
  int energy = 0;
  int angle = 0;
  int temperature = 0;
  int pressure = 0;

  friend bool operator==(const Powers&, const Powers&) = default;
};

Powers sum(const Powers& a, const Powers& b, int times_b) {
  return {a.length + times_b * b.length,           a.time + times_b * b.time,
          a.energy + times_b * b.energy,           a.angle + times_b * b.angle,
          a.temperature + times_b * b.temperature, a.pressure + times_b * b.pressure};
}

struct DimensionRow {
  std::string_view name;
  Powers powers;
  int inside_exponent;  ///< the unit of the inside is 10^this in nm, s, eV, rad, K, Pa
  /// In order of preference for writing; the first one and the last one differ from the unit of the
  /// inside by a power of ten only.
  std::vector<std::string_view> units;
};

const DimensionRow& row(Dimension dimension) {
  static const std::array<DimensionRow, 13> rows{{
      {"a length", {.length = 1}, 0, {"nm", "um"}},
      {"a time", {.time = 1}, 0, {"s", "min", "h"}},
      {"an energy", {.energy = 1}, 0, {"eV", "keV"}},
      {"an angle", {.angle = 1}, 0, {"deg", "rad"}},
      {"a rate", {.length = 1, .time = -1}, 0, {"nm/s", "nm/min", "um/min"}},
      {"a flux", {.length = -2, .time = -1}, 1, {"/cm2/s"}},
      {"a density", {.length = -3}, 1, {"/cm3"}},
      {"an areal density", {.length = -2}, 1, {"/cm2"}},
      {"a temperature", {.temperature = 1}, 0, {"K"}},
      {"a pressure", {.pressure = 1}, 0, {"Pa"}},
      {"a diffusivity", {.length = 2, .time = -1}, 0, {"cm2/s"}},
      {"a percentage", {}, 0, {"%"}},
      {"a number", {}, 0, {""}},
  }};
  return rows[static_cast<std::size_t>(dimension)];
}

/// A unit is scale * 10^exponent of the base units; degrees Celsius have an offset.
struct Unit {
  Powers powers;
  int exponent = 0;
  double scale = 1;
  double offset = 0;
};

struct NamedUnit {
  std::string_view name;
  Unit unit;
};

std::optional<Unit> find_unit(std::string_view name) {
  constexpr Powers length{.length = 1};
  constexpr Powers time{.time = 1};
  constexpr Powers energy{.energy = 1};
  constexpr Powers angle{.angle = 1};
  constexpr Powers temperature{.temperature = 1};
  constexpr Powers pressure{.pressure = 1};
  constexpr double degree = std::numbers::pi / 180;
  static constexpr std::array<NamedUnit, 36> units{{
      {"nm", {length, 0}},
      {"um", {length, 3}},
      {"\u00b5m", {length, 3}},
      {"\u03bcm", {length, 3}},
      {"A", {length, -1}},
      {"\u00c5", {length, -1}},
      {"\u212b", {length, -1}},
      {"angstrom", {length, -1}},
      {"mm", {length, 6}},
      {"cm", {length, 7}},
      {"m", {length, 9}},
      {"s", {time, 0}},
      {"ms", {time, -3}},
      {"us", {time, -6}},
      {"min", {time, 0, 60}},
      {"h", {time, 0, 3600}},
      {"eV", {energy, 0}},
      {"meV", {energy, -3}},
      {"keV", {energy, 3}},
      {"MeV", {energy, 6}},
      {"deg", {angle, 0, degree}},
      {"\u00b0", {angle, 0, degree}},
      {"rad", {angle, 0}},
      {"mrad", {angle, -3}},
      {"K", {temperature, 0}},
      {"degC", {temperature, 0, 1, 273.15}},
      {"\u00b0C", {temperature, 0, 1, 273.15}},
      {"Pa", {pressure, 0}},
      {"mPa", {pressure, -3}},
      {"kPa", {pressure, 3}},
      {"bar", {pressure, 5}},
      {"mbar", {pressure, 2}},
      {"atm", {pressure, 0, 101325}},
      {"Torr", {pressure, 0, 101325.0 / 760}},
      {"mTorr", {pressure, -3, 101325.0 / 760}},
      {"%", {Powers{}, -2}},
  }};
  for (const NamedUnit& unit : units) {
    if (unit.name == name) return unit.unit;
  }
  return std::nullopt;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// One factor of a unit: a name and, behind it, "2", "^2" or "^-2".
std::optional<Unit> parse_factor(std::string_view text, int direction) {
  std::size_t end = text.size();
  while (end > 0 && is_digit(text[end - 1])) --end;
  int power = 1;
  if (end < text.size()) {
    if (std::from_chars(text.data() + end, text.data() + text.size(), power).ec != std::errc{}) {
      return std::nullopt;
    }
    if (end > 0 && text[end - 1] == '-') {
      power = -power;
      --end;
    }
    if (end > 0 && text[end - 1] == '^') --end;
  }
  const std::optional<Unit> base = find_unit(text.substr(0, end));
  if (!base || std::abs(power) > 9) return std::nullopt;
  const int times = direction * power;
  if (base->offset != 0 && times != 1) return std::nullopt;
  // Repeated multiplication, so that no library function decides about bits.
  double scale = 1;
  for (int i = 0; i < std::abs(times); ++i) scale *= base->scale;
  return Unit{sum({}, base->powers, times), times * base->exponent, times < 0 ? 1 / scale : scale,
              base->offset};
}

/// A product of factors: "um/min", "cm^-2 s^-1", "/cm2/s", "1/cm3". A slash holds for the next
/// factor only.
std::optional<Unit> parse_unit(std::string_view text) {
  Unit unit;
  int direction = 1;
  std::size_t factor_count = 0;
  while (!text.empty()) {
    if (text[0] == ' ' || text[0] == '*' || text[0] == '/') {
      if (text[0] == '/') {
        if (direction < 0) return std::nullopt;
        direction = -1;
      }
      text.remove_prefix(1);
      continue;
    }
    const std::string_view factor_text = text.substr(0, text.find_first_of(" */"));
    text.remove_prefix(factor_text.size());
    if (factor_text == "1" && factor_count == 0 && direction > 0) continue;
    const std::optional<Unit> factor = parse_factor(factor_text, direction);
    if (!factor || (factor->offset != 0 && factor_count > 0)) return std::nullopt;
    unit = {sum(unit.powers, factor->powers, 1), unit.exponent + factor->exponent,
            unit.scale * factor->scale, factor->offset};
    direction = 1;
    ++factor_count;
  }
  if (direction < 0 || factor_count == 0) return std::nullopt;
  return unit;
}

/// A decimal number as digits and a power of ten, so that moving the point costs no rounding.
struct Decimal {
  std::string_view mantissa;  ///< sign, digits, perhaps a point
  int exponent = 0;
  std::size_t length = 0;  ///< characters read
};

std::optional<Decimal> parse_decimal(std::string_view text) {
  std::size_t end = !text.empty() && (text[0] == '-' || text[0] == '+') ? 1 : 0;
  std::size_t digit_count = 0;
  bool point = false;
  for (; end < text.size() && (is_digit(text[end]) || (text[end] == '.' && !point)); ++end) {
    if (text[end] == '.') {
      point = true;
    } else {
      ++digit_count;
    }
  }
  if (digit_count == 0) return std::nullopt;
  Decimal decimal{text.substr(0, end), 0, end};
  // An "e" that no digits follow belongs to the unit ("5 eV" without the space).
  if (end < text.size() && (text[end] == 'e' || text[end] == 'E')) {
    std::size_t digits = end + 1;
    if (digits < text.size() && text[digits] == '+') ++digits;
    const auto result =
        std::from_chars(text.data() + digits, text.data() + text.size(), decimal.exponent);
    if (result.ec == std::errc::result_out_of_range) return std::nullopt;
    if (result.ec == std::errc{}) {
      decimal.length = static_cast<std::size_t>(result.ptr - text.data());
    }
  }
  return decimal;
}

/// The double next to mantissa * 10^exponent.
std::optional<double> rounded(std::string_view mantissa, long exponent) {
  if (mantissa.starts_with('+')) mantissa.remove_prefix(1);
  const std::string text = std::string(mantissa) + 'e' + std::to_string(exponent);
  double value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "5 nm" for a text that has the 5 but not the unit.
std::string example(Dimension dimension, std::string_view number) {
  std::string unit(row(dimension).units.front());
  if (unit.empty()) return in_quotes(number);
  if (dimension == Dimension::flux) number = "1e15";
  if (dimension == Dimension::density) number = "5e22";
  if (dimension == Dimension::areal_density) number = "1e15";
  return in_quotes(std::string(number).append(" ").append(unit));
}

/// How units are written elsewhere, in small letters, and what they are here.
constexpr std::array<std::pair<std::string_view, std::string_view>, 44> other_spellings{{
    {"nanometer", "nm"},  {"nanometers", "nm"},  {"nanometre", "nm"},  {"nanometres", "nm"},
    {"micron", "um"},     {"microns", "um"},     {"micrometer", "um"}, {"micrometers", "um"},
    {"micrometre", "um"}, {"micrometres", "um"}, {"\u00b5", "um"},     {"angstroms", "angstrom"},
    {"millimeter", "mm"}, {"millimeters", "mm"}, {"millimetre", "mm"}, {"millimetres", "mm"},
    {"sec", "s"},         {"secs", "s"},         {"second", "s"},      {"seconds", "s"},
    {"minute", "min"},    {"minutes", "min"},    {"mins", "min"},      {"hr", "h"},
    {"hrs", "h"},         {"hour", "h"},         {"hours", "h"},       {"electronvolt", "eV"},
    {"ev", "eV"},         {"kev", "keV"},        {"degree", "deg"},    {"degrees", "deg"},
    {"c", "degC"},        {"celsius", "degC"},   {"kelvin", "K"},      {"k", "K"},
    {"pascal", "Pa"},     {"pa", "Pa"},          {"torr", "Torr"},     {"mtorr", "mTorr"},
    {"percent", "%"},     {"radian", "rad"},     {"radians", "rad"},   {"nm", "nm"},
}};

/// A unit in the spelling of this program, if all of its factors are known in another one.
std::string respelt(std::string_view unit_text) {
  std::string unit;
  std::string_view rest = unit_text;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find_first_of(" */^-0123456789"), rest.size());
    if (end == 0) {
      unit += rest[0];
      rest.remove_prefix(1);
      continue;
    }
    const std::string_view factor = rest.substr(0, end);
    rest.remove_prefix(end);
    if (factor == "per") {
      while (unit.ends_with(' ')) unit.pop_back();
      unit += '/';
      while (rest.starts_with(' ')) rest.remove_prefix(1);
      continue;
    }
    std::string small(factor);
    for (char& c : small) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    const auto* const known =
        std::ranges::find(other_spellings, small, [](const auto& pair) { return pair.first; });
    unit += find_unit(factor) || known == other_spellings.end() ? factor : known->second;
  }
  return unit;
}

/// "nm or um".
std::string units_text(Dimension dimension) {
  const std::vector<std::string_view>& units = row(dimension).units;
  std::string text;
  for (std::size_t n = 0; n < units.size(); ++n)
    text.append(n == 0 ? "" : n + 1 == units.size() ? " or " : ", ").append(units[n]);
  return text;
}

/// The part of a text that is digits in groups, with what sets them apart.
std::string_view grouped_digits(std::string_view text) {
  std::size_t end = 0;
  while (end < text.size()) {
    const bool sets_apart = std::string_view(",.'_ ").find(text[end]) != std::string_view::npos;
    const bool goes_on = end + 1 < text.size() && is_digit(text[end + 1]);
    if (!is_digit(text[end]) && !(sets_apart && goes_on)) break;
    ++end;
  }
  return text.substr(0, end);
}

/// Without what sets digits apart; with a point in place of one of them.
std::string joined_digits(std::string_view grouped, std::size_t point) {
  std::string joined;
  for (std::size_t n = 0; n < grouped.size(); ++n) {
    if (n == point) joined += '.';
    if (std::string_view(",.'_ ").find(grouped[n]) == std::string_view::npos) joined += grouped[n];
  }
  return joined;
}

/// A number that goes on behind a comma, or in groups of three digits.
void refuse_separators(std::string_view text, std::string_view number, std::string_view behind) {
  const std::string_view more = grouped_digits(behind);
  if (more.empty()) return;
  const std::string_view rest = behind.substr(more.size());
  // "1e15 1/cm2/s" is a unit.
  const std::size_t first = std::min(more.find_first_of(",.'_ "), more.size());
  if (first > 0 && (first % 3 != 0 || rest.starts_with('/'))) return;
  const std::string grouped = std::string(number).append(first > 0 ? " " : "").append(more);
  const auto written = [&](std::size_t point) {
    return in_quotes(joined_digits(grouped, point).append(rest));
  };
  const auto commas = std::ranges::count(grouped, ',');
  const auto points = std::ranges::count(grouped, '.');
  const std::size_t comma = grouped.rfind(',');
  const std::size_t point = grouped.rfind('.');
  const bool comma_is_point = commas == 1 && (points == 0 || comma > point);
  if (comma_is_point) {
    const bool may_be_group = points == 0 && grouped.size() - comma == 4;
    throw InputError(in_quotes(text) + ": a comma is no decimal point; write " + written(comma) +
                     (may_be_group ? " or " + written(std::string::npos) : ""));
  }
  const bool has_point = points == 1 && (commas == 0 || point > comma);
  throw InputError(in_quotes(text) + ": digits are not set apart; write " +
                   written(has_point ? point : std::string::npos));
}

// A hint is of the same size, or none.
[[noreturn]] void throw_wrong_unit(std::string_view text, std::string_view number,
                                   std::string_view unit_text, Dimension dimension) {
  const std::optional<Unit> unit = parse_unit(unit_text);
  if (!unit) {
    const std::string mended = respelt(unit_text);
    const std::optional<Unit> meant = parse_unit(mended);
    const bool is_right = meant && meant->powers == row(dimension).powers;
    throw InputError(in_quotes(text) + ": " + in_quotes(unit_text) + " is not a unit; write " +
                     (is_right ? in_quotes(std::string(number) + ' ' + mended)
                               : "it in " + units_text(dimension)));
  }
  const std::string wanted = dimension == Dimension::number
                                 ? "write it without a unit"
                                 : "write it in " + units_text(dimension);
  for (int other = 0; other < static_cast<int>(Dimension::number); ++other) {
    const DimensionRow& found = row(static_cast<Dimension>(other));
    if (found.powers == unit->powers) {
      throw InputError(
          in_quotes(text) + " is " + std::string(found.name) + "; " +
          std::string(row(dimension).name) + " is wanted, " +
          (dimension == Dimension::number ? "without a unit" : "in " + units_text(dimension)));
    }
  }
  throw InputError(in_quotes(text) + " is not " + std::string(row(dimension).name) + "; " + wanted);
}

/// The digits of a number and the power of ten of the first: 400 is "4", 2.
struct Digits {
  bool negative = false;
  std::string digits;
  int exponent = 0;
};

Digits split(std::string_view scientific) {
  Digits result;
  if (scientific.starts_with('-')) {
    result.negative = true;
    scientific.remove_prefix(1);
  }
  const auto e = scientific.find('e');
  for (const char c : scientific.substr(0, e)) {
    if (is_digit(c)) result.digits.push_back(c);
  }
  std::string_view exponent = scientific.substr(e + 1);
  if (exponent.starts_with('+')) exponent.remove_prefix(1);
  std::from_chars(exponent.data(), exponent.data() + exponent.size(), result.exponent);
  while (result.digits.size() > 1 && result.digits.back() == '0') result.digits.pop_back();
  if (result.digits == "0") result.exponent = 0;
  return result;
}

Digits shortest_digits(double value) {
  std::array<char, 64> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::scientific);
  return split({text.data(), end.ptr});
}

Digits digits_of(double value, int count) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::scientific, count - 1);
  return split({text.data(), end.ptr});
}

/// Plain from 0.0001 to 999999, with an exponent beyond.
std::string decimal_text(const Digits& number) {
  const int count = static_cast<int>(number.digits.size());
  const int e = number.exponent;
  std::string text(number.negative ? "-" : "");
  const auto append = [&](int first, int last) {
    for (int i = first; i < last; ++i) {
      text.push_back(i < count ? number.digits[static_cast<std::size_t>(i)] : '0');
    }
  };
  const bool plain = e >= -4 && e <= 5;
  const int whole = !plain ? 1 : e < 0 ? 0 : e + 1;
  append(0, whole);
  if (whole == 0) text.push_back('0');
  if (whole < count) text.push_back('.');
  if (plain && e < 0) text.append(static_cast<std::size_t>(-e - 1), '0');
  append(whole, count);
  if (!plain) text.append("e").append(std::to_string(e));
  return text;
}

}  // namespace

double parse_quantity(std::string_view text, Dimension dimension) {
  const DimensionRow& wanted = row(dimension);
  const std::string_view body = trimmed(text);
  const std::optional<Decimal> decimal = parse_decimal(body);
  if (!decimal) {
    throw InputError(in_quotes(text) + " is not " + std::string(wanted.name) +
                     "; write for example " + example(dimension, "5"));
  }
  const std::string_view number = body.substr(0, decimal->length);
  const std::string_view unit_text = trimmed(body.substr(decimal->length));
  refuse_separators(text, number, unit_text);
  Unit unit;
  if (unit_text.empty() && dimension != Dimension::number) {
    throw InputError(in_quotes(text) + " has no unit; write for example " +
                     example(dimension, number));
  }
  if (!unit_text.empty()) {
    const std::optional<Unit> found = parse_unit(unit_text);
    if (!found || found->powers != wanted.powers) {
      throw_wrong_unit(text, number, unit_text, dimension);
    }
    unit = *found;
  }
  const std::optional<double> scaled =
      rounded(decimal->mantissa, long{decimal->exponent} + unit.exponent - wanted.inside_exponent);
  const double value = scaled ? *scaled * unit.scale + unit.offset : HUGE_VAL;
  if (!std::isfinite(value)) {
    throw InputError(in_quotes(text) + " is beyond the numbers that can be held");
  }
  return value;
}

std::string format_number(double value) { return decimal_text(shortest_digits(value)); }

std::string format_quantity(double value, Dimension dimension) {
  const DimensionRow& wanted = row(dimension);
  std::string shortest;
  for (const std::string_view name : wanted.units) {
    const Unit unit = name.empty() ? Unit{} : *parse_unit(name);
    // By powers of ten the digits stay; otherwise as few digits as give the same bits, if any do.
    for (int count = unit.scale == 1 ? 0 : 15; count <= 17; ++count) {
      Digits digits = count == 0 ? shortest_digits(value) : digits_of(value / unit.scale, count);
      if (digits.digits != "0") digits.exponent += wanted.inside_exponent - unit.exponent;
      const std::string text = decimal_text(digits) + (name.empty() ? "" : ' ' + std::string(name));
      if (parse_quantity(text, dimension) == value) {
        if (shortest.empty() || text.size() < shortest.size()) shortest = text;
        break;
      }
    }
  }
  return shortest;
}

std::string rounded_number(double value) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 6)
          .ptr;
  return {text.data(), end};
}

std::string rounded_place(const Vec3d& r) {
  return "(" + rounded_number(r.x) + ", " + rounded_number(r.y) + ", " + rounded_number(r.z) + ")";
}

std::string_view dimension_name(Dimension dimension) { return row(dimension).name; }

std::string quantity_example(Dimension dimension, std::string_view number) {
  const std::string text = example(dimension, number);
  return text.substr(1, text.size() - 2);
}

std::string_view inside_unit(Dimension dimension) {
  if (dimension == Dimension::angle) return "rad";
  return dimension == Dimension::percentage ? "" : row(dimension).units.front();
}

}  // namespace scarp
