#include "apps/simulator/kept_mesh.h"

#include <atomic>
#include <cmath>
#include <set>

#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "mesh/distance.h"

namespace scarp {

namespace {

// Each facet's material, that of what is closest to its middle; nothing if that is too far.
std::optional<std::vector<MaterialId>> closest_materials(const TriMesh& mesh,
                                                         const TriMesh& surface, double distance) {
  const TriangleTree tree(surface);
  std::vector<MaterialId> materials(mesh.triangles.size());
  std::atomic<bool> is_close = true;
  parallel_for(mesh.triangles.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end && is_close; ++f) {
      const auto [a, b, c] = corners(mesh, f);
      const ClosestPoint closest = tree.closest((a + b + c) / 3.0, distance);
      if (closest.found()) {
        materials[f] = surface.materials[closest.triangle];
      } else {
        is_close = false;
      }
    }
  });
  if (!is_close) return std::nullopt;
  return materials;
}

TriMesh part_of(const TriMesh& mesh, MaterialId material) {
  TriMesh part{.vertices = mesh.vertices, .triangles = {}, .materials = {}};
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    if (mesh.materials[f] == material) part.triangles.push_back(mesh.triangles[f]);
  return part;
}

// Whether all corners of a mesh's triangles lie that close to another one.
bool lies_close(const TriMesh& mesh, const TriMesh& other, double distance) {
  const std::vector<Vec3d> vertices = surface_vertices(mesh);
  const TriangleTree tree(other);
  std::atomic<bool> is_close = true;
  parallel_for(vertices.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end && is_close; ++v)
      if (!tree.closest(vertices[v], distance).found()) is_close = false;
  });
  return is_close;
}

// What tells most surfaces that moved at once: meshes that close have such boxes, too.
bool boxes_are_close(const TriMesh& mesh, const TriMesh& surface, double distance) {
  const Box a = bounding_box(mesh);
  const Box b = bounding_box(surface);
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(a.lower[axis] - b.lower[axis]) > distance) return false;
    if (std::abs(a.upper[axis] - b.upper[axis]) > distance) return false;
  }
  return true;
}

}  // namespace

std::shared_ptr<const TriangleTree> tree_of(const KeptMesh& mesh) {
  return mesh.tree ? mesh.tree : std::make_shared<const TriangleTree>(mesh.facets);
}

std::optional<std::vector<MaterialId>> materials_if_close(const TriMesh& mesh,
                                                          const TriMesh& surface, double distance) {
  if (!boxes_are_close(mesh, surface, distance)) return std::nullopt;
  const auto materials = closest_materials(mesh, surface, distance);
  if (!materials) return std::nullopt;
  const TriMesh painted{mesh.vertices, mesh.triangles, *materials};
  std::set<MaterialId> seen(materials->begin(), materials->end());
  seen.insert(surface.materials.begin(), surface.materials.end());
  for (const MaterialId material : seen) {
    const TriMesh here = part_of(painted, material);
    const TriMesh there = part_of(surface, material);
    if (!lies_close(here, there, distance) || !lies_close(there, here, distance))
      return std::nullopt;
  }
  return materials;
}

}  // namespace scarp
