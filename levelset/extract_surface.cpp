#include "levelset/extract_surface.h"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/band.h"
#include "levelset/surface_triangles.h"
#include "levelset/surface_vertices.h"

namespace scarp {

namespace {

/// Puts the parts together: vertices on the grid, then those in cells, then copies on the upper
/// periodic sides.
class Assembly {
 public:
  Assembly(const Band& band, const SurfaceVertices& vertices,
           const std::vector<PartTriangles>& parts)
      : sides_(band.frame().sides()) {
    std::size_t vertex_count = vertices.count();
    std::size_t triangle_count = 0;
    for (const PartTriangles& part : parts) {
      vertex_count += part.cell_vertices.size();
      triangle_count += part.triangles.size();
    }
    mesh_.vertices.reserve(vertex_count);
    mesh_.triangles.reserve(triangle_count);
    vertices.append_positions(mesh_.vertices);
    std::vector<std::uint32_t> first_in_cells;
    for (const PartTriangles& part : parts) {
      first_in_cells.push_back(static_cast<std::uint32_t>(mesh_.vertices.size()));
      mesh_.vertices.insert(mesh_.vertices.end(), part.cell_vertices.begin(),
                            part.cell_vertices.end());
    }
    for (std::size_t n = 0; n < parts.size(); ++n) {
      add_triangles(parts[n], first_in_cells[n]);
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
  void add_triangles(const PartTriangles& part, std::uint32_t first_in_cells) {
    if (part.plain) {
      mesh_.triangles.insert(mesh_.triangles.end(), part.triangles.begin(), part.triangles.end());
      return;
    }
    for (Triangle triangle : part.triangles) {
      for (std::uint32_t& corner : triangle) {
        const std::uint32_t kind = Corner::kind(corner);
        if (kind == Corner::in_cell) {
          corner = first_in_cells + Corner::number(corner);
        } else if (kind != 0) {
          corner = copied(corner);
        }
      }
      mesh_.triangles.push_back(triangle);
    }
  }

  std::uint32_t copied(std::uint32_t corner) {
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
  std::unordered_map<std::uint32_t, std::uint32_t> copies_;
  std::vector<std::uint32_t> originals_;  ///< of the copies
};

TriMesh extract(const Band& band, const OpenGas* gas, const Layers* layers) {
  const std::size_t count = band.leaves().size();
  const SurfaceVertices vertices(band, gas, layers);
  SCARP_ASSERT(vertices.count(), <, Corner::most);
  std::vector<PartTriangles> parts((count + leaves_per_part - 1) / leaves_per_part);
  parallel_for(count, leaves_per_part, [&](std::size_t begin, std::size_t end) {
    TriangleMaker maker(band, vertices);
    for (std::size_t n = begin; n < end; ++n) {
      maker.add_leaf(n, parts[begin / leaves_per_part]);
    }
  });
  Assembly assembly(band, vertices, parts);
  if (layers != nullptr) {
    std::vector<std::uint16_t> exposed;
    vertices.append_exposed(exposed);
    assembly.set_materials(*layers, std::move(exposed));
  }
  return assembly.take_mesh();
}

}  // namespace

TriMesh extract_surface(const Layers& layers) {
  return extract(layers.top().band(), nullptr, &layers);
}

TriMesh extract_surface(const Layers& layers, const OpenGas& gas) {
  return extract(layers.top().band(), &gas, &layers);
}

TriMesh extract_surface(const LevelSet& phi) { return extract(phi.band(), nullptr, nullptr); }

}  // namespace scarp
