#include "tests/bench/surfaces.h"

#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <limits>

#include "apps/simulator/recipe.h"
#include "apps/simulator/simulator.h"
#include "core/error.h"
#include "core/system/atomic_file.h"
#include "levelset/surface/extract_surface.h"
#include "mesh/files/mesh_file.h"

namespace scarp::bench {

namespace {

/// Unpacks NAME.obj.gz to a file of its own and reads that.
TriMesh read_packed(const std::filesystem::path& file) {
  const std::filesystem::path unpacked =
      std::filesystem::temp_directory_path() /
      ("scarp_bench_" + std::to_string(::getpid()) + file.stem().string());
  const gzFile in = gzopen(file.c_str(), "rb");
  if (in == nullptr) throw InputError(file.string() + ": cannot be read");
  std::string content;
  std::string block(1 << 20, '\0');
  int count = 0;
  while ((count = gzread(in, block.data(), static_cast<unsigned>(block.size()))) > 0) {
    content.append(block.data(), static_cast<std::size_t>(count));
  }
  gzclose(in);
  if (count < 0) throw InputError(file.string() + ": is not a complete .gz file");
  write_file(unpacked, content);
  TriMesh mesh = read_mesh(unpacked);
  std::filesystem::remove(unpacked);
  return mesh;
}

/// What a recipe leaves, in the unit of its spacing: computed once, then kept in
/// build/bench_surfaces.
TriMesh run_surface(const std::filesystem::path& folder, const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path root = SCARP_SOURCE_DIR;
  const fs::path file = root / folder / (name + ".toml");
  const fs::path kept = root / "build/bench_surfaces" / (name + ".ply");
  if (fs::exists(kept) && fs::last_write_time(kept) > fs::last_write_time(file)) {
    return read_mesh(kept);
  }
  fmt::print(stderr, "running {} (once; takes a minute or more)\n", file.string());
  const Recipe recipe = read_recipe(recipe_in(file));
  State state = start_state(recipe.domain.frame, recipe.start);
  while (!finished(state, recipe.steps)) {
    begin_step(state, recipe.steps);
    advance(state, recipe, survey(state, recipe), std::numeric_limits<double>::infinity());
  }
  TriMesh mesh = extract_surface(state.layers);
  mesh.materials.clear();
  for (Vec3f& r : mesh.vertices) r = r / static_cast<float>(recipe.domain.frame.spacing);
  fs::create_directories(kept.parent_path());
  write_mesh(kept, mesh);
  return mesh;
}

}  // namespace

std::vector<Surface> surfaces_of(const std::vector<std::string>& files) {
  std::vector<Surface> surfaces;
  for (const std::filesystem::path file : files) {
    const bool packed = file.extension() == ".gz";
    const std::filesystem::path name = packed ? file.stem() : file;
    surfaces.push_back({name.stem().string(), packed ? read_packed(file) : read_mesh(file)});
  }
  if (!surfaces.empty()) return surfaces;
  for (const char* name : {"vias", "trenches", "scallops"}) {
    surfaces.push_back({name, run_surface("tests/bench/surfaces", name)});
  }
  return surfaces;
}

Surface trench_deposition() {
  constexpr const char* name = "trench_deposition";
  return {name, run_surface("configs", name)};
}

}  // namespace scarp::bench
