#include "apps/report/packed_volume.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/system/deflate.h"

namespace scarp {

namespace {

constexpr double most_nodes = 64 * 64 * 64;
constexpr std::size_t most_layers = 5;
constexpr double border = 128;
constexpr double codes_per_step = 63;

struct Lattice {
  std::array<int, 3> nodes{};
  Vec3d lower;
  Vec3d step;

  std::size_t size() const {
    return static_cast<std::size_t>(nodes[0]) * static_cast<std::size_t>(nodes[1]) *
           static_cast<std::size_t>(nodes[2]);
  }
  Vec3d place(int i, int j, int k) const {
    return lower + Vec3d{i * step.x, j * step.y, k * step.z};
  }
  double longest_step() const { return std::max({step.x, step.y, step.z}); }
};

Lattice lattice_of(const Box& box, double spacing) {
  Lattice lattice{.lower = box.lower, .step = {}};
  const Vec3d size = box.upper - box.lower;
  const double wanted = std::max(spacing, std::cbrt(size.x * size.y * size.z / most_nodes));
  for (int axis = 0; axis < 3; ++axis) {
    const int cells = std::max(1, static_cast<int>(std::floor(size[axis] / wanted)));
    lattice.nodes[static_cast<std::size_t>(axis)] = cells + 1;
    lattice.step[axis] = size[axis] / cells;
  }
  return lattice;
}

std::string codes_of(const LevelSet& phi, const Lattice& lattice) {
  std::string codes(lattice.size(), '\0');
  const double scale = codes_per_step / lattice.longest_step();
  const auto [nx, ny, nz] = lattice.nodes;
  parallel_for(
      static_cast<std::size_t>(nz), 1, [&, nx = nx, ny = ny](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
          std::size_t n = k * static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
          for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i, ++n) {
              const double distance = phi.distance(lattice.place(i, j, static_cast<int>(k)));
              const double code = std::clamp(border + scale * distance, 0.0, 255.0);
              codes[n] = static_cast<char>(static_cast<unsigned char>(std::lround(code)));
            }
          }
        }
      });
  return codes;
}

}  // namespace

PackedVolume pack_volume(const Layers& layers, const Box& box) {
  std::vector<const Layer*> seen;
  for (std::size_t n = 0; n < layers.stack.size(); ++n)
    if (n == 0 || adds_material(layers, n)) seen.push_back(&layers.stack[n]);
  if (seen.size() > most_layers) return {};
  const Lattice lattice = lattice_of(box, layers.frame.spacing);
  PackedVolume packed{.nodes = lattice.nodes, .box = box};
  std::string bytes;
  for (const Layer* layer : seen) {
    packed.materials.push_back(layer->material);
    if (layer != seen.back()) bytes += codes_of(layer->phi, lattice);
  }
  packed.bytes = deflated(bytes);
  return packed;
}

}  // namespace scarp
