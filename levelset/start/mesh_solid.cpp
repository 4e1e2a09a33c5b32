#include "levelset/start/mesh_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/triangle_tree.h"

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
  const std::vector<TriMesh> parts = separate_parts(mesh);
  if (parts.size() > 1) {
    return "is open and in pieces: nothing joins those at " + text(parts[0].vertices[0]) + " and " +
           text(parts[1].vertices[0]) + "; write each to a file of its own";
  }
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

double volume_of(const TriMesh& mesh) {
  double volume = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    volume += dot(corners(mesh, f)[0], area_vector(mesh, f)) / 3;
  }
  return volume;
}

double distance_to(const Box& box, Vec3d r) {
  Vec3d beyond;
  for (int axis = 0; axis < 3; ++axis) {
    beyond[axis] = std::max({box.lower[axis] - r[axis], r[axis] - box.upper[axis], 0.0});
  }
  return length(beyond);
}

template <class Solid>
bool is_within(const TriMesh& mesh, const Solid& solid) {
  return std::all_of(mesh.vertices.begin(), mesh.vertices.end(),
                     [&](Vec3f r) { return solid(Vec3d(r)).value <= 0; });
}

double angle(Vec3d a, Vec3d b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

}  // namespace

/// The surface of one part of a mesh, closed or an open patch.
class MeshSolid::Part {
 public:
  explicit Part(const TriMesh& mesh);

  Distance operator()(Vec3d r) const;
  double volume() const { return volume_; }

  /// No point of it is nearer to r than that.
  double at_least(Vec3d r) const { return distance_to(box_, r); }

 private:
  Vec3d outside(const ClosestPoint& closest) const;

  std::vector<Triangle> triangles_;
  std::vector<Vec3d> face_normals_;
  std::vector<Vec3d> vertex_normals_;
  std::map<VertexPair, Vec3d> edge_normals_;  ///< lower vertex first
  TriangleTree tree_;
  Box box_;
  double volume_;
};

MeshSolid::Part::Part(const TriMesh& mesh)
    : triangles_(mesh.triangles), tree_(mesh), box_(bounding_box(mesh)), volume_(volume_of(mesh)) {
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
Vec3d MeshSolid::Part::outside(const ClosestPoint& closest) const {
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

Distance MeshSolid::Part::operator()(Vec3d r) const {
  const ClosestPoint closest = tree_.closest(r);
  const Vec3d direction = outside(closest);
  const Vec3d away = r - closest.point;
  const double sign = dot(away, direction) < 0 ? -1 : 1;
  if (closest.distance == 0) return {0, normalized(direction)};
  return {sign * closest.distance, (sign / closest.distance) * away};
}

/// What one part encloses, without its cavities; those face inwards, so all around one is inside.
struct MeshSolid::Body {
  Part outside;
  std::vector<Part> cavities{};

  Distance operator()(Vec3d r) const {
    Distance distance = outside(r);
    for (const Part& cavity : cavities) {
      if (cavity.at_least(r) < std::abs(distance.value)) {
        distance = intersect(distance, cavity(r));
      }
    }
    return distance;
  }
};

MeshSolid::MeshSolid(const TriMesh& mesh) {
  if (mesh_border(mesh) > 0) {
    bodies_.push_back({.outside = Part(mesh)});
    return;
  }
  std::vector<TriMesh> cavities;
  for (TriMesh& part : separate_parts(mesh)) {
    if (volume_of(part) > 0) {
      bodies_.push_back({.outside = Part(part)});
    } else {
      cavities.push_back(std::move(part));
    }
  }
  for (const TriMesh& cavity : cavities) {
    // It belongs to the smallest body around it; mesh_fault has seen that there is one.
    Body* owner = nullptr;
    for (Body& body : bodies_) {
      const bool is_smaller = owner == nullptr || body.outside.volume() < owner->outside.volume();
      if (is_smaller && is_within(cavity, body.outside)) owner = &body;
    }
    if (owner != nullptr) owner->cavities.emplace_back(cavity);
  }
}

MeshSolid::~MeshSolid() = default;

Distance MeshSolid::operator()(Vec3d r) const {
  Distance all = bodies_[0](r);
  for (std::size_t n = 1; n < bodies_.size(); ++n) {
    // What is further away than the surface known already does not count.
    if (bodies_[n].outside.at_least(r) < std::abs(all.value)) all = unite(all, bodies_[n](r));
  }
  return all;
}

std::vector<TriMesh> separate_parts(const TriMesh& mesh) {
  DisjointSets facets(mesh.triangles.size());
  std::map<VertexPair, std::uint32_t> first_at;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    for (std::size_t c = 0; c < 3; ++c)
      facets.join(f, first_at.insert({std::minmax(t[c], t[(c + 1) % 3]), f}).first->second);
  }
  std::map<std::uint32_t, TriMesh> triangles_at;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    triangles_at[facets.lowest(f)].triangles.push_back(mesh.triangles[f]);
  }
  std::vector<TriMesh> parts;
  for (auto& [first, part] : triangles_at) {
    std::map<std::uint32_t, std::uint32_t> number;
    for (Triangle& t : part.triangles) {
      for (std::uint32_t& v : t) {
        const auto next = static_cast<std::uint32_t>(part.vertices.size());
        const auto [entry, is_new] = number.insert({v, next});
        if (is_new) part.vertices.push_back(mesh.vertices[v]);
        v = entry->second;
      }
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

namespace {

/// A direction in which a body may be thin, beside the axes: across its largest triangle.
Vec3d across_largest_triangle(const TriMesh& mesh) {
  Vec3d largest;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Vec3d area = area_vector(mesh, f);
    if (dot(area, area) > dot(largest, largest)) largest = area;
  }
  return normalized(largest);
}

/// A part that is inside out must be a cavity of another one.
std::optional<std::string> fault_of_bodies(const TriMesh& mesh) {
  const std::vector<TriMesh> parts = separate_parts(mesh);
  for (const TriMesh& cavity : parts) {
    if (volume_of(cavity) > 0) continue;
    const bool is_in_body = std::any_of(parts.begin(), parts.end(), [&](const TriMesh& part) {
      return volume_of(part) > 0 && is_within(cavity, MeshSolid(part));
    });
    if (!is_in_body) {
      return "is inside out, for example at " + text(cavity.vertices[0]) +
             (parts.size() > 1 ? ", and not a cavity: no other body is all around it" : "") +
             "; turn its triangles over";
    }
  }
  return std::nullopt;
}

/// Next to the middle of a facet of one part is outside on the one side and inside on the other,
/// unless another facet lies on it or right beside it: which side is which depends on chance then.
std::optional<std::string> fault_of_folds(const TriMesh& part) {
  constexpr double beside = 1e-3;    // times the height of the facet
  constexpr double rounding = 1e-6;  // times the coordinates
  TriMesh outwards = part;
  if (mesh_border(part) == 0 && volume_of(part) < 0)
    for (Triangle& triangle : outwards.triangles) std::swap(triangle[1], triangle[2]);
  const MeshSolid solid(outwards);
  for (std::size_t f = 0; f < outwards.triangles.size(); ++f) {
    const auto [a, b, c] = corners(outwards, f);
    const Vec3d area = area_vector(outwards, f);
    const Vec3d middle = (a + b + c) / 3.0;
    const double longest = std::max({length(b - a), length(c - b), length(a - c)});
    const double step = beside * 2 * length(area) / longest;
    if (!(step > rounding * length(middle))) continue;
    const Vec3d off = step * normalized(area);
    if (solid(middle + off).value > 0 && solid(middle - off).value < 0) continue;
    return "is folded at " + text(Vec3f(middle)) +
           ": a triangle lies on another one, or is turned over; take away one of them";
  }
  return std::nullopt;
}

}  // namespace

double thickness(const TriMesh& mesh) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Vec3d direction :
       {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}, across_largest_triangle(mesh)}) {
    double lower = std::numeric_limits<double>::infinity();
    double upper = -lower;
    for (const Vec3f& r : mesh.vertices) {
      lower = std::min(lower, dot(Vec3d(r), direction));
      upper = std::max(upper, dot(Vec3d(r), direction));
    }
    thinnest = std::min(thinnest, upper - lower);
  }
  return thinnest;
}

std::size_t mesh_border(const TriMesh& mesh) { return border_of(directed_edges(mesh)).size(); }

std::optional<std::string> mesh_fault(const Frame& frame, const TriMesh& mesh) {
  if (mesh.triangles.empty()) return "has no triangle";
  const DirectedEdges directed = directed_edges(mesh);
  for (const auto& [edge, count] : directed) {
    if (count > 1) {
      return edge_text(mesh, edge) +
             " has more than two triangles, or two that are oriented differently; orient all "
             "outwards, and let bodies overlap rather than share an edge";
    }
  }
  const std::vector<VertexPair> border = border_of(directed);
  const auto fault = border.empty() ? fault_of_bodies(mesh) : fault_of_patch(frame, mesh, border);
  if (fault) return fault;
  for (const TriMesh& part : separate_parts(mesh))
    if (const auto fold = fault_of_folds(part)) return fold;
  return std::nullopt;
}

}  // namespace scarp
