#include "mesh/files/mesh_file.h"
#include "tests/fuzz/target.h"

using namespace scarp;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::InputFile file(".vtp");
  const std::filesystem::path& path = file.with(data, size);
  fuzz::read_or_refuse([&] { read_mesh(path); });
  fuzz::read_or_refuse([&] { read_facet_arrays(path); });
  return fuzz::read_or_refuse([&] { read_material_names(path); });
}
