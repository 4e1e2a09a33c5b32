#include "mesh/files/mesh_file.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::InputFile file(".obj");
  return fuzz::read_or_refuse([&] { read_mesh(file.with(data, size)); });
}
