#include "levelset/mesh_solid.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <tuple>

namespace scarp {

namespace {

using VertexPair = std::pair<std::uint32_t, std::uint32_t>;

/// How many triangles pass an edge in a direction.
using DirectedEdges = std::map<VertexPair, int>;

DirectedEdges directed_edges(const TriMesh& mesh) {
  DirectedEdges directed;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t c = 0; c < 3; ++c) ++directed[{t[c], t[(c + 1) % 3]}];
  }
  return directed;
}

std::vector<VertexPair> border_of(const DirectedEdges& directed) {
  std::vector<VertexPair> border;
  for (const auto& [edge, count] : directed) {
    if (!directed.contains({edge.second, edge.first})) border.push_back(edge);
  }
  return border;
}

std::string text(Vec3f r) {
  std::ostringstream out;
  out << '(' << r.x << ", " << r.y << ", " << r.z << ") nm";
  return out.str();
}

std::string edge_text(const TriMesh& mesh, const VertexPair& edge) {
  return "the edge from " + text(mesh.vertices[edge.first]) + " to " +
         text(mesh.vertices[edge.second]);
}

/// On the same side of the domain, or beyond it.
bool is_beyond(const Sides& sides, double tolerance, Vec3f a, Vec3f b) {
  for (int axis = 0; axis < 2; ++axis) {
    if (std::max(a[axis], b[axis]) <= sides.lower[axis] + tolerance ||
        std::min(a[axis], b[axis]) >= sides.upper[axis] - tolerance) {
      return true;
    }
  }
  return false;
}

std::optional<std::string> fault_of_patch(const Frame& frame, const TriMesh& mesh,
                                          const std::vector<VertexPair>& border) {
  const Sides sides = frame.sides();
  const double tolerance = 1e-3 * frame.spacing;
  for (const VertexPair& edge : border) {
    if (!is_beyond(sides, tolerance, mesh.vertices[edge.first], mesh.vertices[edge.second])) {
      return "is open inside the domain: " + edge_text(mesh, edge) +
             " has one triangle only; close the mesh, or let it reach the sides of the domain all "
             "around";
    }
  }
  const Box box = bounding_box(mesh);
  for (int axis = 0; axis < 2; ++axis) {
    if (box.lower[axis] > sides.lower[axis] + tolerance ||
        box.upper[axis] < sides.upper[axis] - tolerance) {
      return std::string("is open and does not cover the domain along ") + "xy"[axis];
    }
  }
  double upwards = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) upwards += area_vector(mesh, f).z;
  if (upwards <= 0) return "is an open patch that faces down; turn its triangles over";
  return std::nullopt;
}

double angle(Vec3d a, Vec3d b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

}  // namespace

TriMesh welded(const TriMesh& mesh) {
  std::map<std::tuple<float, float, float>, std::uint32_t> known;
  std::vector<std::uint32_t> number;
  TriMesh result;
  for (const Vec3f& r : mesh.vertices) {
    const auto [entry, is_new] =
        known.insert({{r.x, r.y, r.z}, static_cast<std::uint32_t>(result.vertices.size())});
    if (is_new) result.vertices.push_back(r);
    number.push_back(entry->second);
  }
  for (const Triangle& t : mesh.triangles) {
    const Triangle triangle{number[t[0]], number[t[1]], number[t[2]]};
    if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0]) {
      result.triangles.push_back(triangle);
    }
  }
  return result;
}

std::size_t mesh_border(const TriMesh& mesh) { return border_of(directed_edges(mesh)).size(); }

std::optional<std::string> mesh_fault(const Frame& frame, const TriMesh& mesh) {
  if (mesh.triangles.empty()) return "has no triangle";
  const DirectedEdges directed = directed_edges(mesh);
  for (const auto& [edge, count] : directed) {
    if (count > 1) {
      return edge_text(mesh, edge) +
             " has more than two triangles, or two that are oriented differently";
    }
  }
  const std::vector<VertexPair> border = border_of(directed);
  if (!border.empty()) return fault_of_patch(frame, mesh, border);
  double volume = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    volume += dot(corners(mesh, f)[0], area_vector(mesh, f));
  }
  if (volume <= 0) {
    return "is inside out, for example at " + text(mesh.vertices[mesh.triangles[0][0]]) +
           "; turn its triangles over";
  }
  return std::nullopt;
}

MeshSolid::MeshSolid(const TriMesh& mesh) : triangles_(mesh.triangles), tree_(mesh) {
  vertex_normals_.resize(mesh.vertices.size());
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const std::array<Vec3d, 3> corner = corners(mesh, f);
    const Vec3d normal = normalized(area_vector(mesh, f));
    face_normals_.push_back(normal);
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t next = (c + 1) % 3;
      const Vec3d to_next = corner[next] - corner[c];
      const Vec3d to_last = corner[(c + 2) % 3] - corner[c];
      vertex_normals_[triangles_[f][c]] += angle(to_next, to_last) * normal;
      edge_normals_[std::minmax(triangles_[f][c], triangles_[f][next])] += normal;
    }
  }
}

/// A direction that points outside next to the closest point.
Vec3d MeshSolid::outside(const ClosestPoint& closest) const {
  constexpr double on_edge = 1e-12;
  const Triangle& triangle = triangles_[closest.triangle];
  std::vector<std::uint32_t> touched;
  for (std::size_t c = 0; c < 3; ++c) {
    if (closest.barycentric[c] > on_edge) touched.push_back(triangle[c]);
  }
  if (touched.size() == 1) return vertex_normals_[touched[0]];
  if (touched.size() == 2) return edge_normals_.at(std::minmax(touched[0], touched[1]));
  return face_normals_[closest.triangle];
}

Distance MeshSolid::operator()(Vec3d r) const {
  const ClosestPoint closest = tree_.closest(r);
  const Vec3d direction = outside(closest);
  const Vec3d away = r - closest.point;
  const double sign = dot(away, direction) < 0 ? -1 : 1;
  if (closest.distance == 0) return {0, normalized(direction)};
  return {sign * closest.distance, (sign / closest.distance) * away};
}

}  // namespace scarp
