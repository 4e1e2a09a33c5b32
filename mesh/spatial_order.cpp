#include "mesh/spatial_order.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "mesh/cube_lattice.h"

namespace scarp {

namespace {

constexpr double vertices_per_cube = 100;
constexpr std::size_t grain = 8192;

/// The size of a square with as much area as that many vertices have; from every 16th triangle.
double cube_size(const TriMesh& mesh) {
  constexpr std::size_t stride = 16;
  double area = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); f += stride) {
    area += length(area_vector(mesh, f));
  }
  const auto vertices = static_cast<double>(mesh.vertices.size());
  return std::sqrt(area * stride * vertices_per_cube / vertices);
}

/// Numbers 0..keys.size() by their key, equal keys in the order of the numbers.
std::vector<std::uint32_t> sorted_by(const std::vector<std::uint32_t>& keys,
                                     std::size_t key_count) {
  std::vector<std::uint32_t> begin(key_count + 1, 0);
  for (const std::uint32_t key : keys) ++begin[key + 1];
  for (std::size_t key = 0; key < key_count; ++key) begin[key + 1] += begin[key];
  std::vector<std::uint32_t> result(keys.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i) result[begin[keys[i]]++] = i;
  return result;
}

std::vector<std::uint32_t> inverse(const std::vector<std::uint32_t>& order) {
  std::vector<std::uint32_t> place(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  return place;
}

}  // namespace

SpatialOrder spatial_order(const TriMesh& mesh) {
  const CubeLattice cubes(bounding_box(mesh), cube_size(mesh), 0);
  std::vector<std::uint32_t> keys(mesh.vertices.size());
  parallel_for(keys.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) keys[v] = cubes.of(Vec3d(mesh.vertices[v]));
  });
  SpatialOrder order;
  order.vertices = sorted_by(keys, cubes.count());
  const std::vector<std::uint32_t> place = inverse(order.vertices);
  keys.resize(mesh.triangles.size());
  parallel_for(keys.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const Triangle& t = mesh.triangles[f];
      keys[f] = std::min({place[t[0]], place[t[1]], place[t[2]]});
    }
  });
  order.triangles = sorted_by(keys, place.size());
  return order;
}

TriMesh reordered(const TriMesh& mesh, const SpatialOrder& order) {
  const std::vector<std::uint32_t> place = inverse(order.vertices);
  TriMesh result{std::vector<Vec3f>(mesh.vertices.size()),
                 std::vector<Triangle>(mesh.triangles.size()),
                 std::vector<MaterialId>(mesh.materials.size())};
  parallel_for(result.vertices.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) result.vertices[v] = mesh.vertices[order.vertices[v]];
  });
  parallel_for(result.triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const Triangle& t = mesh.triangles[order.triangles[f]];
      result.triangles[f] = {place[t[0]], place[t[1]], place[t[2]]};
      if (!mesh.materials.empty()) result.materials[f] = mesh.materials[order.triangles[f]];
    }
  });
  return result;
}

std::vector<float> reordered(std::span<const float> values, const SpatialOrder& order) {
  std::vector<float> result(values.size());
  for (std::size_t v = 0; v < result.size(); ++v) result[v] = values[order.vertices[v]];
  return result;
}

}  // namespace scarp
