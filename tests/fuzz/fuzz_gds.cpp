#include "levelset/start/gds.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::InputFile file(".gds");
  return fuzz::read_or_refuse([&] { read_gds(file.with(data, size), {.layer = 1}); });
}
