#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/recipe_node.h"
#include "core/recipe/recipe_path.h"
#include "core/recipe/recipe_table.h"
#include "core/recipe/toml.h"
#include "core/suggestion.h"
#include "core/system/read_file.h"

namespace scarp {

namespace detail {

std::string content_of(const RecipeContent& content, const std::string& name) {
  return content.load_file ? content.load_file(name) : read_file(content.folder / name);
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text.append(text.empty() ? "" : ", ").append(name);
  return text;
}

}  // namespace detail

namespace {

using detail::inner_path;
using detail::RecipeContent;
using detail::RecipeNode;

void set_place(TomlValue& value, const TomlPlace& place) {
  value.place = place;
  value.key_place = place;
  for (TomlValue& entry : value.entries) set_place(entry, place);
}

/// A text that somebody forgot to quote, rather than a number or a list with a mistake in it.
bool lacks_quotes(std::string_view text) {
  return !text.starts_with('[') && !text.starts_with('{') &&
         text.find_first_not_of("+-0123456789._eE") != std::string_view::npos;
}

/// VALUE of PATH=VALUE.
TomlValue parse_override_value(std::string_view text, const TomlPlace& place,
                               std::string_view path) {
  std::string fault = "there is more than one value";
  try {
    TomlValue document = parse_toml("value = " + std::string(text), "");
    if (document.entries.size() == 1) {
      set_place(document, place);
      return std::move(document.entries.front());
    }
  } catch (const InputError& error) {
    // Without the place in a text that nobody wrote.
    fault = error.what();
    fault.erase(0, fault.find(": ") + 2);
  }
  std::string unquoted(text);
  std::erase(unquoted, '"');
  const std::string value = text.empty() ? "nothing" : repeated(text);
  const std::string remedy = lacks_quotes(text)
                                 ? "; a text keeps its quotes: --set " + repeated(path) + "='\"" +
                                       repeated(unquoted) + "\"'"
                             : text.starts_with('.') ? "; write 0" + value
                                                     : ": " + fault;
  throw InputError(place.source + ": " + value + " is not a value of TOML" + remedy);
}

/// The value at a path, made if it is a key that is not there yet.
TomlValue& value_to_set(TomlValue& root, const RecipePath& path, const TomlPlace& place) {
  TomlValue* at = &root;
  RecipePath walked;
  for (const auto& part : path) {
    const auto fail = [&](std::string_view text) {
      throw InputError(std::string(place.source).append(": ") +
                       format_recipe_path(walked).append(text));
    };
    if (const auto* const key = std::get_if<std::string>(&part)) {
      if (at->is_list()) fail(" is a list; say which entry, [0] for the first");
      if (!at->is_table()) fail(" is not a table");
      if (at->find(*key) == nullptr) {
        TomlValue& added = at->entries.emplace_back();
        added.key = *key;
        added.place = added.key_place = place;
      }
      at = at->find(*key);
    } else {
      const std::size_t index = std::get<std::size_t>(part);
      if (!at->is_list()) fail(" is not a list");
      if (index >= at->entries.size()) {
        fail(" has no entry " + std::to_string(index) + "; they are counted from 0 and there are " +
             std::to_string(at->entries.size()));
      }
      at = &at->entries[index];
    }
    walked.push_back(part);
  }
  return *at;
}

void apply_override(TomlValue& recipe, const std::string& text) {
  const TomlPlace place{.source = "--set " + repeated(text)};
  const auto equals = text.find('=');
  if (equals == std::string::npos) {
    throw InputError(place.source + ": write PATH=VALUE, for example step[0].sticking=0.5");
  }
  const std::string path_text = text.substr(0, equals);
  RecipePath path;
  try {
    path = parse_recipe_path(path_text);
  } catch (const InputError& error) {
    throw InputError(place.source + ": " + error.what());
  }
  TomlValue value = parse_override_value(text.substr(equals + 1), place, path_text);
  TomlValue& old = value_to_set(recipe, path, place);
  value.key = old.key;
  value.key_place = old.key_place;
  old = std::move(value);
}

/// Gathers the paths of keys that are there misspelt.
void add_unknown_keys(const RecipeNode& node, RecipeErrors& errors,
                      std::set<std::string>& misspelt) {
  if (node.toml == nullptr || node.rest_accepted) return;
  for (const TomlValue& entry : node.toml->entries) {
    if (std::find(node.asked.begin(), node.asked.end(), entry.key) != node.asked.end()) continue;
    const std::string nearest = nearest_name(entry.key, node.asked);
    std::string text = "unknown key";
    if (!nearest.empty()) {
      text += suggestion(entry.key, node.asked);
      misspelt.insert(inner_path(node, nearest));
    } else if (!node.asked.empty()) {
      text += "; known here: " + detail::joined(node.asked);
    }
    errors.add({inner_path(node, entry.key), entry.key_place, text});
  }
}

}  // namespace

RecipeFile::RecipeFile(const RecipeSource& source) {
  const std::string name = shown(source.name);
  content_.reset(new RecipeContent{.toml = parse_toml(source.text, name),
                                   .folder = source.folder,
                                   .load_file = source.load_file,
                                   .errors = RecipeErrors(name),
                                   .warnings = RecipeErrors(name),
                                   .record = {},
                                   .nodes = {}});
  if (content_->toml.entries.empty())
    throw InputError({problem_at(name, "the recipe is empty; start from one in configs/")});
  for (const std::string& change : source.overrides) apply_override(content_->toml, change);
  content_->nodes.push_back(
      {.content = content_.get(), .record = &content_->record, .toml = &content_->toml});
}

RecipeFile::~RecipeFile() = default;
RecipeFile::RecipeFile(RecipeFile&&) noexcept = default;
RecipeFile& RecipeFile::operator=(RecipeFile&&) noexcept = default;

RecipeTable RecipeFile::root() const { return RecipeTable(content_->nodes.front()); }

bool RecipeFile::ok() const { return content_->errors.empty(); }

void RecipeFile::finish() const {
  RecipeErrors errors = content_->errors;
  std::set<std::string> misspelt;
  for (const RecipeNode& node : content_->nodes) add_unknown_keys(node, errors, misspelt);
  errors.forget_missing(misspelt);
  if (!errors.empty()) throw InputError(errors.problems());
}

std::vector<std::string> RecipeFile::warnings() const {
  std::vector<std::string> lines;
  for (const Problem& doubt : content_->warnings.problems()) lines.push_back(doubt.text());
  return lines;
}

std::string RecipeFile::resolved() const { return content_->record.toml(); }

}  // namespace scarp
