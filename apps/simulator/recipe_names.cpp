#include "apps/simulator/recipe_names.h"

#include "core/error.h"
#include "core/printable.h"

namespace scarp {

namespace {

void check_name(const RecipeTable& table, std::string_view key, std::string_view name) {
  if (printable(name) != name || name.find_first_of("\n\t") != std::string_view::npos)
    table.error(key, in_quotes(name) + ": a name is one line without control characters");
  if (!name.empty() && std::string_view("=+-@").find(name[0]) != std::string_view::npos)
    table.error(key, in_quotes(name) +
                         ": a name does not begin with =, +, - or @: spreadsheets "
                         "take it for a formula");
}

}  // namespace

std::string read_name(const RecipeTable& table, std::string_view key, std::string_view fallback) {
  std::string name = table.text(key, fallback);
  check_name(table, key, name);
  return name;
}

void read_materials(const RecipeTable& table, Materials& materials) {
  for (const std::string& name : table.keys()) {
    // Files of volumes and meshes are called by it.
    if (name.find('/') != std::string::npos)
      table.error(name, "a material's name becomes part of names of files: leave out the /");
    const RecipeTable material = table.table(name);
    check_name(material, "density", name);
    materials.add({name, material.quantity("density", Dimension::density,
                                           {.minimum = 0, .exclusive = true})});
  }
}

}  // namespace scarp
