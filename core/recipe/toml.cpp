#include "core/recipe/toml.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/toml_text.h"
#include "core/trimmed.h"

namespace scarp {

namespace {

TomlPlace place_of(const toml::source_region& region) {
  return {region.begin.line, region.begin.column};
}

bool stands_before(const TomlValue& a, const TomlValue& b) {
  if (a.key_place.line != b.key_place.line) return a.key_place.line < b.key_place.line;
  return a.key_place.column < b.key_place.column;
}

TomlValue converted(const toml::node& node) {
  TomlValue value;
  value.place = place_of(node.source());
  if (const auto* text = node.as_string()) {
    value.kind = TomlValue::Kind::text;
    value.text = text->get();
  } else if (const auto* integer = node.as_integer()) {
    value.kind = TomlValue::Kind::integer;
    value.integer = integer->get();
  } else if (const auto* decimal = node.as_floating_point()) {
    value.kind = TomlValue::Kind::decimal;
    value.decimal = decimal->get();
  } else if (const auto* flag = node.as_boolean()) {
    value.kind = TomlValue::Kind::flag;
    value.flag = flag->get();
  } else if (const auto* list = node.as_array()) {
    value.kind = TomlValue::Kind::list;
    for (const toml::node& entry : *list) value.entries.push_back(converted(entry));
  } else if (const auto* table = node.as_table()) {
    for (const auto& [key, entry] : *table) {
      TomlValue& child = value.entries.emplace_back(converted(entry));
      child.key = key.str();
      child.key_place = place_of(key.source());
    }
    std::stable_sort(value.entries.begin(), value.entries.end(), stands_before);
  } else {
    value.kind = TomlValue::Kind::date;
  }
  return value;
}

std::string decimal_text(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  const std::string text = format_number(value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

/// Goes through the text of a document and refuses tables within tables without end, which would
/// overflow the stack of the parser and of all that walks its result.
class DepthCheck {
 public:
  DepthCheck(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  void run() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"' || c == '\'') {
        skip_string(c);
        continue;
      }
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
        continue;
      }
      if (c == '[' || c == '{') refuse_beyond(++brackets_);
      if (c == ']' || c == '}') --brackets_;
      if (c == '.') refuse_beyond(++dots_);
      if (std::string_view("[]{}=,\n").find(c) != std::string_view::npos) dots_ = 0;
      ++at_;
    }
  }

 private:
  void refuse_beyond(int depth) const {
    if (depth <= max_toml_depth) return;
    const std::string_view before = text_.substr(0, at_);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const std::size_t column = at_ - (before.rfind('\n') + 1) + 1;
    throw InputError({problem_at(name_ + ':' + std::to_string(line) + ':' + std::to_string(column),
                                 "more than " + std::to_string(max_toml_depth) +
                                     " levels of tables or lists within each other")});
  }

  /// At a quote: to behind the string. One that does not end is left to the parser.
  void skip_string(char quote) {
    const bool is_long = text_.substr(at_, 3) == std::string(3, quote);
    const std::string_view end = text_.substr(at_, is_long ? 3 : 1);
    at_ += end.size();
    while (at_ < text_.size() && text_.substr(at_, end.size()) != end) {
      if (!is_long && text_[at_] == '\n') return;
      at_ += quote == '"' && text_[at_] == '\\' ? 2 : 1;
    }
    at_ = std::min(at_ + end.size(), text_.size());
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
  int brackets_ = 0;
  int dots_ = 0;
};

std::string_view line_of(std::string_view text, std::uint32_t line) {
  for (; line > 1 && text.find('\n') != std::string_view::npos; --line)
    text.remove_prefix(text.find('\n') + 1);
  return text.substr(0, text.find('\n'));
}

/// What to do about a fault that the parser describes, as far as the line tells.
std::string remedy(std::string_view description, std::string_view line) {
  const auto says = [&](std::string_view words) {
    return description.find(words) != std::string_view::npos;
  };
  if (says("utf-8") || says("unicode")) return "; save the file as UTF-8";
  for (const char* const quote : {"\u201c", "\u201d", "\u201e", "\u2018", "\u2019"})
    if (line.find(quote) != std::string_view::npos && !says("header"))
      return "; texts stand in straight quotes: \"";
  if (says("string")) return "; is a quote missing at the end of a text?";
  if (says("table header")) return "; a line with the name of a table is [name] or [[name]]";
  const std::string_view content = trimmed(line);
  if (content.starts_with("//") || content.starts_with(';') || content.starts_with('%'))
    return "; comments begin with #";
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos)
    return says("key-value pair") ? "; a line is key = value" : "";
  const std::string_view key = trimmed(line.substr(0, equals));
  std::string_view value = line.substr(equals + 1);
  value = trimmed(value.substr(0, value.find('#')));
  if (value.empty()) return "; a value is missing behind the =";
  if (value.starts_with('=')) return "; a line is key = value";
  if (value.ends_with(';')) return "; a line ends without ;";
  if (value.find_first_of("\"'[]{}=") != std::string_view::npos) return "";
  if (value.starts_with('.')) return "; write 0" + repeated(value);
  if (value.find_first_not_of("+-.0123456789eE_") == std::string_view::npos) return "";
  return "; texts, and numbers with a unit, stand in quotes: " + repeated(key) + " = \"" +
         repeated(value) + '"';
}

}  // namespace

const TomlValue* TomlValue::find(std::string_view wanted) const {
  if (!is_table()) return nullptr;
  const auto entry = std::find_if(entries.begin(), entries.end(),
                                  [&](const TomlValue& other) { return other.key == wanted; });
  return entry == entries.end() ? nullptr : &*entry;
}

TomlValue* TomlValue::find(std::string_view wanted) {
  return const_cast<TomlValue*>(std::as_const(*this).find(wanted));
}

TomlValue parse_toml(std::string_view text, const std::string& name) {
  DepthCheck(text, name).run();
  try {
    return converted(toml::parse(text));
  } catch (const toml::parse_error& error) {
    const TomlPlace place = place_of(error.source());
    throw InputError(
        {problem_at(name + ':' + std::to_string(place.line) + ':' + std::to_string(place.column),
                    std::string(error.description()) +
                        remedy(error.description(), line_of(text, place.line)))});
  }
}

std::string described(const TomlValue& value) {
  switch (value.kind) {
    case TomlValue::Kind::list:
      return "a list";
    case TomlValue::Kind::table:
      return "a table";
    case TomlValue::Kind::date:
      return "a date or a time of day";
    default:
      return format_toml(value);
  }
}

std::string format_toml(const TomlValue& value) {
  std::string inner;
  switch (value.kind) {
    case TomlValue::Kind::text:
      return toml_string(value.text);
    case TomlValue::Kind::integer:
      return std::to_string(value.integer);
    case TomlValue::Kind::decimal:
      return decimal_text(value.decimal);
    case TomlValue::Kind::flag:
      return value.flag ? "true" : "false";
    case TomlValue::Kind::list:
      for (const TomlValue& entry : value.entries) {
        inner.append(inner.empty() ? "" : ", ").append(format_toml(entry));
      }
      return '[' + inner + ']';
    default:
      for (const TomlValue& entry : value.entries) {
        inner.append(inner.empty() ? " " : ", ").append(toml_key(entry.key));
        inner.append(" = ").append(format_toml(entry));
      }
      return '{' + inner + " }";
  }
}

}  // namespace scarp
