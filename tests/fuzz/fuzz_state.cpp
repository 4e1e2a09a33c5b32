#include "levelset/grid/checkpoint.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::InputFile file(".vdb");
  return fuzz::read_or_refuse([&] { read_checkpoint(file.with(data, size)); });
}
