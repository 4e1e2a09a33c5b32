#include <array>
#include <string>

#include "models/formula.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::read_or_refuse([&] {
    const std::array<std::string, 3> names{"F", "ion", "s"};
    const RateFormula rate(fuzz::text_of(data, size), names);
    const std::array<float, 3> values{0.5F, 0, 2};
    rate.at(values);
  });
}
