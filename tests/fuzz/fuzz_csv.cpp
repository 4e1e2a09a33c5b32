#include <array>

#include "core/recipe/number_table.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::read_or_refuse([&] {
    const std::array<Column, 2> columns{
        {{"energy", Dimension::energy}, {"density", Dimension::number}}};
    read_csv("t.csv", {reinterpret_cast<const char*>(data), size}, columns);
  });
}
