#include "levelset/start/gds.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::read_or_refuse(
      [&] { read_gds("fuzz.gds", fuzz::text_of(data, size), {.layer = 1}); });
}
