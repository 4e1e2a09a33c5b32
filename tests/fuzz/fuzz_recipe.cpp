#include "apps/simulator/recipe.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::InputFile file(".toml");
  return fuzz::read_or_refuse([&] { read_recipe(recipe_in(file.with(data, size))); });
}
