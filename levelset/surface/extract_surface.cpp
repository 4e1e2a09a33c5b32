#include "levelset/surface/extract_surface.h"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/surface/closed_gas.h"
#include "levelset/surface/phase_graph.h"
#include "levelset/surface/surface_triangles.h"
#include "levelset/surface/surface_vertices.h"

namespace scarp {

namespace {

/// Parts that are made before they go to the mesh: few, so that what they hold stays in the caches.
constexpr std::size_t parts_at_once = 256;

/// Puts the parts together: vertices on the grid, then those in cells, then copies on the upper
/// periodic sides.
class Assembly {
 public:
  Assembly(const Band& band, const SurfaceVertices& vertices) : sides_(band.frame().sides()) {
    // A little more for vertices in cells and copies; a closed surface has two triangles per
    // vertex, less where it ends at sides.
    mesh_.vertices.reserve(vertices.count() + vertices.count() / 32);
    mesh_.triangles.reserve(2 * std::size_t{vertices.count()});
    vertices.append_positions(mesh_.vertices);
  }

  /// The next part in their order.
  void add(const PartTriangles& part) {
    if (!part.plain) {
      unnumbered_.push_back({mesh_.triangles.size(), mesh_.triangles.size() + part.triangles.size(),
                             static_cast<std::uint32_t>(mesh_.vertices.size())});
    }
    mesh_.triangles.insert(mesh_.triangles.end(), part.triangles.begin(), part.triangles.end());
    mesh_.vertices.insert(mesh_.vertices.end(), part.cell_vertices.begin(),
                          part.cell_vertices.end());
  }

  /// Once all parts are there: corners that are not vertices on the grid get their numbers.
  void number_corners() {
    for (const Unnumbered& part : unnumbered_) {
      for (std::size_t f = part.begin; f < part.end; ++f) {
        for (std::uint32_t& corner : mesh_.triangles[f]) {
          const std::uint32_t kind = Corner::kind(corner);
          if (kind == Corner::in_cell) {
            corner = part.first_in_cells + Corner::number(corner);
          } else if (kind != 0) {
            corner = copied(corner);
          }
        }
      }
    }
  }

  TriMesh take_mesh() { return std::move(mesh_); }

  /// exposed has the layer seen at each vertex on the grid; those in cells see the lowest.
  void set_materials(const Layers& layers, std::vector<std::uint16_t> exposed) {
    if (layers.stack.size() == 1) {
      mesh_.materials.assign(mesh_.triangles.size(), layers.stack.front().material);
      return;
    }
    const std::size_t first_copy = mesh_.vertices.size() - originals_.size();
    exposed.resize(first_copy, 0);
    for (const std::uint32_t original : originals_) exposed.push_back(exposed[original]);
    mesh_.materials.resize(mesh_.triangles.size());
    for (std::size_t f = 0; f < mesh_.triangles.size(); ++f) {
      const auto [a, b, c] = mesh_.triangles[f];
      // Of the lowest layer that is seen at two of its corners at least.
      std::array<std::uint16_t, 3> seen{exposed[a], exposed[b], exposed[c]};
      std::sort(seen.begin(), seen.end());
      mesh_.materials[f] = layers.stack[seen[1]].material;
    }
  }

 private:
  /// Triangles with corners of other kinds than vertices on the grid.
  struct Unnumbered {
    std::size_t begin;
    std::size_t end;
    std::uint32_t first_in_cells;
  };

  std::uint32_t copied(std::uint32_t corner) {
    if (Corner::number(corner) >= mesh_.vertices.size()) {
      throw NumericalError(
          "the level set changes its sign where its band ends, so that its surface cannot be "
          "found; "
          "please report it with the recipe");
    }
    const auto [copy, is_new] =
        copies_.try_emplace(corner, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (is_new) {
      Vec3f r = mesh_.vertices[Corner::number(corner)];
      for (int axis = 0; axis < 2; ++axis) {
        if ((Corner::kind(corner) >> axis & 1) != 0) {
          r[axis] = static_cast<float>(sides_.upper[axis]);
        }
      }
      mesh_.vertices.push_back(r);
      originals_.push_back(Corner::number(corner));
    }
    return copy->second;
  }

  Sides sides_;
  TriMesh mesh_;
  std::vector<Unnumbered> unnumbered_;
  std::unordered_map<std::uint32_t, std::uint32_t> copies_;
  std::vector<std::uint32_t> originals_;  ///< of the copies
};

TriMesh extract(const Band& band, const OpenGas* gas, const Layers* layers,
                const Band* above = nullptr) {
  const std::size_t count = band.leaves().size();
  const SurfaceVertices vertices(band, gas, layers, above);
  SCARP_ASSERT(vertices.count(), <, Corner::most);
  Assembly assembly(band, vertices);
  std::vector<PartTriangles> parts(parts_at_once);
  for (std::size_t first = 0; first < count; first += parts_at_once * leaves_per_part) {
    const std::size_t leaf_count = std::min(count - first, parts_at_once * leaves_per_part);
    parallel_for(leaf_count, leaves_per_part, [&](std::size_t begin, std::size_t end) {
      PartTriangles& part = parts[begin / leaves_per_part];
      part.clear();
      TriangleMaker maker(band, vertices);
      for (std::size_t n = begin; n < end; ++n) maker.add_leaf(first + n, part);
    });
    for (std::size_t n = 0; n < leaf_count; n += leaves_per_part) {
      assembly.add(parts[n / leaves_per_part]);
    }
  }
  assembly.number_corners();
  if (layers != nullptr) {
    std::vector<std::uint16_t> exposed;
    vertices.append_exposed(exposed);
    assembly.set_materials(*layers, std::move(exposed));
  }
  return assembly.take_mesh();
}

TriMesh extract_closed(const Band& band, const PhaseGraph& graph, const Layers* layers) {
  const ClosedGas voids = closed_gas(band, graph);
  return extract(voids.phi.band(), &voids.gas, layers);
}

void append(const TriMesh& part, TriMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const Triangle& t : part.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  mesh.materials.insert(mesh.materials.end(), part.materials.begin(), part.materials.end());
}

/// All of the surface.
TriMesh extract_all(const Band& band, const Layers* layers, const Band* above = nullptr) {
  const PhaseGraph graph(band, Phase::gas);
  if (!graph.has_closed_regions()) return extract(band, nullptr, layers, above);
  const OpenGas open{
      .open = graph.nodes_where([](const LeafPiece& piece) { return piece.region == 0; })};
  TriMesh mesh = extract(band, &open, layers, above);
  append(extract_closed(band, graph, layers), mesh);
  return mesh;
}

}  // namespace

TriMesh extract_surface(const Layers& layers) { return extract_all(layers.top().band(), &layers); }

TriMesh extract_surface(const Layers& layers, const OpenGas& gas) {
  return extract(layers.top().band(), &gas, &layers);
}

TriMesh extract_voids(const Layers& layers, const PhaseGraph& gas) {
  return extract_closed(layers.top().band(), gas, &layers);
}

TriMesh extract_surface(const Layers& layers, std::size_t layer) {
  const Band& top = layers.top().band();
  const Band& band = layers.stack[layer].phi.band();
  return extract_all(band, nullptr, &band == &top ? nullptr : &top);
}

TriMesh extract_surface(const LevelSet& phi) { return extract_all(phi.band(), nullptr); }

}  // namespace scarp
