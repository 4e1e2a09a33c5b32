#pragma once

#include <fstream>
#include <string>

#include "apps/simulator/recipe.h"
#include "core/system/temporary_folder.h"

namespace scarp {

/// The beginning of a recipe: a wafer of silicon in two dimensions, 20 cells of 10 nm wide.
inline const std::string silicon_wafer = R"(
[domain]
spacing = "10 nm"
extent = ["200 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
)";

/// The same, etched by 60 nm in a minute.
inline const std::string etch_of_a_wafer = silicon_wafer + R"([[step]]
model = "isotropic"
duration = "60 s"
etch_rate = "1 nm/s"
)";

/// A trench in silicon under a film of oxide, in space.
inline const std::string lined_trench = R"(
[domain]
spacing = "10 nm"
extent = ["400 nm", "100 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "200 nm"
depth = "300 nm"
[[step]]
model = "conformal"
material = "SiO2"
thickness = "25 nm"
)";

/// A recipe that stands in a test.
inline Recipe read_text(const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder / "r.toml") << text;
  return read_recipe(recipe_in(folder / "r.toml"));
}

}  // namespace scarp
