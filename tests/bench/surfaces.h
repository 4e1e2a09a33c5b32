#pragma once

// The surfaces that benchmarks of simplification run on.

#include <unistd.h>
#include <zlib.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/tri_mesh.h"
#include "mesh/mesh_file.h"
#include "tests/mesh/generated_surface.h"

namespace scarp::bench {

struct Surface {
  std::string name;
  TriMesh mesh;
};

inline double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Unpacks NAME.obj.gz to a file of its own and reads that.
inline TriMesh read_packed(const std::filesystem::path& file) {
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

/// Those of the files; without files an array of tapered vias and deep trenches, of about 70k and
/// 175k vertices.
inline std::vector<Surface> surfaces_of(const std::vector<std::string>& files) {
  std::vector<Surface> surfaces;
  for (const std::filesystem::path file : files) {
    const bool packed = file.extension() == ".gz";
    const std::filesystem::path name = packed ? file.stem() : file;
    surfaces.push_back({name.stem().string(), packed ? read_packed(file) : read_mesh(file)});
  }
  if (!surfaces.empty()) return surfaces;
  const Grid vias{.cells = {184, 142, 84}, .noise = 0.006, .seed = 1};
  surfaces.push_back({"vias", polygonised(vias, via_array(184, 142, 60))});
  const Grid trenches{.cells = {150, 145, 190}, .noise = 0.006, .seed = 2};
  surfaces.push_back({"trenches", polygonised(trenches, deep_trenches(150, 172))});
  return surfaces;
}

}  // namespace scarp::bench
