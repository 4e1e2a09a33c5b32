#include "core/recipe/quantity.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const Dimension dimension : {Dimension::length, Dimension::rate, Dimension::flux,
                                    Dimension::temperature, Dimension::percentage}) {
    fuzz::read_or_refuse([&] {
      const double value = parse_quantity(fuzz::text_of(data, size), dimension);
      if (parse_quantity(format_quantity(value, dimension), dimension) != value) __builtin_trap();
    });
  }
  return 0;
}
