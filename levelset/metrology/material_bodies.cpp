#include "levelset/metrology/material_bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <unordered_map>

#include "core/disjoint_sets.h"
#include "core/error.h"
#include "core/triangulate.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

using Vertex = std::uint32_t;

/// An edge with its direction.
struct DirectedEdge {
  Vertex from = 0;
  Vertex to = 0;

  friend bool operator<(const DirectedEdge& a, const DirectedEdge& b) {
    return a.from != b.from ? a.from < b.from : a.to < b.to;
  }
};

/// Triangles over vertices of which no two are at one place.
class Welded {
 public:
  explicit Welded(std::size_t count) { numbers_.reserve(count); }

  void add(const TriMesh& mesh, bool is_turned) {
    std::vector<Vertex> number;
    for (const Vec3f& r : mesh.vertices) number.push_back(vertex(r));
    for (Triangle t : mesh.triangles) {
      for (Vertex& v : t) v = number[v];
      if (is_turned) std::swap(t[1], t[2]);
      triangles_.push_back(t);
    }
  }

  void add(const Triangle& triangle) { triangles_.push_back(triangle); }

  /// Where two surfaces lie on each other nothing is between them.
  void cancel_opposite() {
    const auto from_lowest = [](Triangle t) {
      std::rotate(t.begin(), std::ranges::min_element(t), t.end());
      return t;
    };
    std::map<Triangle, int> surplus;
    for (const Triangle& t : triangles_) {
      Triangle same = from_lowest(t);
      Triangle opposite = same;
      std::swap(opposite[1], opposite[2]);
      const auto found = surplus.find(opposite);
      if (found != surplus.end() && found->second > 0) {
        --found->second;
      } else {
        ++surplus[same];
      }
    }
    std::vector<Triangle> kept;
    for (const Triangle& t : triangles_) {
      const auto found = surplus.find(from_lowest(t));
      if (found == surplus.end() || found->second == 0) continue;
      --found->second;
      kept.push_back(t);
    }
    triangles_ = std::move(kept);
  }

  /// Edges that no triangle goes through the other way.
  std::vector<DirectedEdge> border() const {
    std::map<DirectedEdge, int> surplus;
    for (const Triangle& t : triangles_) {
      for (std::size_t n = 0; n < 3; ++n) {
        const DirectedEdge edge{t[n], t[(n + 1) % 3]};
        const auto opposite = surplus.find({edge.to, edge.from});
        if (opposite != surplus.end() && opposite->second > 0) {
          --opposite->second;
        } else {
          ++surplus[edge];
        }
      }
    }
    std::vector<DirectedEdge> edges;
    for (const auto& [edge, count] : surplus) edges.insert(edges.end(), count, edge);
    return edges;
  }

  const std::vector<Vec3f>& vertices() const { return vertices_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }

 private:
  struct PlaceHash {
    std::size_t operator()(const std::array<std::uint32_t, 3>& place) const {
      std::uint64_t hash = 0;
      for (const std::uint32_t bits : place) hash = (hash ^ bits) * 0x9e3779b97f4a7c15U;
      return hash ^ (hash >> 32);
    }
  };

  Vertex vertex(const Vec3f& r) {
    const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x + 0.0F); };
    const auto [place, is_new] = numbers_.try_emplace({bits(r.x), bits(r.y), bits(r.z)},
                                                      static_cast<Vertex>(vertices_.size()));
    if (is_new) vertices_.push_back(r);
    return place->second;
  }

  std::unordered_map<std::array<std::uint32_t, 3>, Vertex, PlaceHash> numbers_;
  std::vector<Vec3f> vertices_;
  std::vector<Triangle> triangles_;
};

/// A side of the domain, seen from outside.
struct SidePlane {
  int axis = 0;
  bool is_upper = false;
  float position = 0;

  bool holds(const Vec3f& r) const { return r[axis] == position; }

  /// To the right and upwards.
  std::array<double, 2> project(const Vec3f& r) const {
    const bool is_mirrored = (axis == 0) != is_upper;
    const double right = r[1 - axis];
    return {is_mirrored ? -right : right, r.z};
  }
};

std::array<SidePlane, 4> planes_of(const Sides& sides) {
  std::array<SidePlane, 4> planes;
  for (int n = 0; n < 4; ++n) {
    const int axis = n / 2;
    const bool is_upper = n % 2 != 0;
    planes[static_cast<std::size_t>(n)] = {
        .axis = axis,
        .is_upper = is_upper,
        .position = static_cast<float>(is_upper ? sides.upper[axis] : sides.lower[axis])};
  }
  return planes;
}

/// Closes edges on a plane along its upright borders: at each of them, what comes and what goes on
/// belongs together in pairs from below.
void close_along_corners(const std::vector<Vec3f>& vertices, const SidePlane& plane,
                         std::vector<DirectedEdge>& edges) {
  std::map<Vertex, int> surplus;  // edges that end there less those that begin
  for (const DirectedEdge& edge : edges) {
    ++surplus[edge.to];
    --surplus[edge.from];
  }
  std::map<float, std::vector<Vertex>> open;  // by corner
  for (const auto& [v, count] : surplus)
    open[vertices[v][1 - plane.axis]].insert(open[vertices[v][1 - plane.axis]].end(),
                                             static_cast<std::size_t>(std::abs(count)), v);
  for (auto& [corner, ends] : open) {
    std::ranges::stable_sort(ends, {}, [&](Vertex v) { return vertices[v].z; });
    std::vector<Vertex> waiting;
    for (const Vertex v : ends) {
      if (waiting.empty() || (surplus[waiting.back()] > 0) == (surplus[v] > 0)) {
        waiting.push_back(v);
        continue;
      }
      const Vertex other = waiting.back();
      waiting.pop_back();
      edges.push_back(surplus[v] > 0 ? DirectedEdge{v, other} : DirectedEdge{other, v});
    }
    SCARP_ASSERT(waiting.size(), ==, std::size_t{0});
  }
}

/// Closed lines of edges; one ends as soon as it comes back to a vertex that it has.
std::vector<VertexLoop> loops_of(const std::vector<DirectedEdge>& edges) {
  std::map<Vertex, std::vector<Vertex>> onward;
  for (const DirectedEdge& edge : edges) onward[edge.from].push_back(edge.to);
  std::vector<VertexLoop> loops;
  for (auto& [start, ends] : onward) {
    while (!ends.empty()) {
      VertexLoop path{start};
      std::map<Vertex, std::size_t> place{{start, 0}};
      while (!path.empty()) {
        std::vector<Vertex>& next = onward[path.back()];
        if (next.empty()) break;
        const Vertex v = next.back();
        next.pop_back();
        const auto seen = place.find(v);
        if (seen == place.end()) {
          place[v] = path.size();
          path.push_back(v);
          continue;
        }
        loops.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(seen->second), path.end());
        for (std::size_t n = seen->second + 1; n < path.size(); ++n) place.erase(path[n]);
        path.resize(seen->second + 1);
      }
    }
  }
  return loops;
}

/// Adds what closes a surface at the sides of the domain.
void close_at_sides(const Sides& sides, Welded& body) {
  std::vector<DirectedEdge> border = body.border();
  for (const SidePlane& plane : planes_of(sides)) {
    std::vector<DirectedEdge> edges;
    const auto is_on_plane = [&](const DirectedEdge& edge) {
      return plane.holds(body.vertices()[edge.from]) && plane.holds(body.vertices()[edge.to]);
    };
    // An edge on the corner of two sides belongs to the first.
    std::erase_if(border, [&](const DirectedEdge& edge) {
      if (!is_on_plane(edge)) return false;
      edges.push_back({edge.to, edge.from});
      return true;
    });
    close_along_corners(body.vertices(), plane, edges);
    std::vector<std::array<double, 2>> points;
    for (const Vec3f& r : body.vertices()) points.push_back(plane.project(r));
    for (const Triangle& t : triangulate(points, loops_of(edges))) body.add(t);
  }
  SCARP_ASSERT(border.size(), ==, std::size_t{0});
}

/// A closed surface without edges of more than two triangles: vertices are doubled where it touches
/// itself.
class Separation {
 public:
  explicit Separation(const Welded& body)
      : body_(body), corners_(3 * body.triangles().size()), sets_(corners_), is_joined_(corners_) {}

  TriMesh run() {
    join_neighbours();
    TriMesh mesh;
    std::vector<Vertex> number(corners_, none);
    for (std::size_t f = 0; f < body_.triangles().size(); ++f) {
      Triangle triangle{};
      for (std::size_t n = 0; n < 3; ++n) {
        Vertex& v = number[sets_.lowest(static_cast<std::uint32_t>(3 * f + n))];
        if (v == none) {
          v = static_cast<Vertex>(mesh.vertices.size());
          mesh.vertices.push_back(body_.vertices()[body_.triangles()[f][n]]);
        }
        triangle[n] = v;
      }
      mesh.triangles.push_back(triangle);
    }
    return mesh;
  }

 private:
  static constexpr Vertex none = ~Vertex{0};

  /// A triangle at an edge, by its corner there.
  struct Side {
    std::size_t corner = 0;  ///< 3 * triangle + the place where the edge begins
    bool is_forward = false;
    double angle = 0;
  };

  void join_neighbours() {
    std::map<DirectedEdge, std::vector<Side>> edges;
    for (std::size_t c = 0; c < corners_; ++c) {
      const Vertex from = body_.triangles()[c / 3][c % 3];
      const Vertex to = body_.triangles()[c / 3][(c + 1) % 3];
      const bool is_forward = from < to;
      edges[is_forward ? DirectedEdge{from, to} : DirectedEdge{to, from}].push_back(
          {.corner = c, .is_forward = is_forward});
    }
    for (auto& [edge, around] : edges) {
      if (around.size() > 2) sort_around(edge, around);
      // The solid lies between one that goes back and the next that goes forward.
      std::vector<const Side*> open;
      for (std::size_t n = 0; n < 2 * around.size(); ++n) {
        const Side& side = around[n % around.size()];
        if (!side.is_forward) {
          if (n < around.size()) open.push_back(&side);
        } else if (!open.empty() && !is_joined_[side.corner]) {
          join(*open.back(), side);
          open.pop_back();
        }
      }
    }
  }

  void sort_around(const DirectedEdge& edge, std::vector<Side>& around) const {
    const Vec3d origin(body_.vertices()[edge.from]);
    const Vec3d along = normalized(Vec3d(body_.vertices()[edge.to]) - origin);
    const auto across = [&](const Side& side) {
      const std::size_t opposite = (side.corner % 3 + 2) % 3;
      const Vec3d r =
          Vec3d(body_.vertices()[body_.triangles()[side.corner / 3][opposite]]) - origin;
      return r - dot(r, along) * along;
    };
    const Vec3d right = normalized(across(around.front()));
    const Vec3d up = cross(along, right);
    for (Side& side : around)
      side.angle = std::atan2(dot(across(side), up), dot(across(side), right));
    std::ranges::stable_sort(around, {}, &Side::angle);
  }

  void join(const Side& back, const Side& forward) {
    const auto after = [](std::size_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; };
    is_joined_[forward.corner] = true;
    join(back.corner, after(forward.corner));
    join(after(back.corner), forward.corner);
  }

  void join(std::size_t a, std::size_t b) {
    sets_.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
  }

  const Welded& body_;
  std::size_t corners_;
  DisjointSets sets_;
  std::vector<bool> is_joined_;  ///< of corners whose edge goes forward
};

TriMesh plane_at(const Sides& sides, double height) {
  const auto corner = [&](bool right, bool back) {
    return Vec3f(Vec3d{right ? sides.upper[0] : sides.lower[0],
                       back ? sides.upper[1] : sides.lower[1], height});
  };
  return {.vertices = {corner(false, false), corner(true, false), corner(true, true),
                       corner(false, true)},
          .triangles = {{0, 1, 2}, {0, 2, 3}},
          .materials = {}};
}

void append(const TriMesh& mesh, TriMesh& to) {
  const auto first = static_cast<Vertex>(to.vertices.size());
  to.vertices.insert(to.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (Triangle t : mesh.triangles) {
    for (Vertex& v : t) v += first;
    to.triangles.push_back(t);
  }
}

}  // namespace

std::vector<MaterialBody> material_bodies(const Layers& layers, double bottom) {
  const Sides sides = layers.frame.sides();
  TriMesh below = plane_at(sides, bottom);
  std::vector<MaterialBody> bodies;
  for (std::size_t k = 0; k < layers.stack.size(); ++k) {
    if (!adds_material(layers, k)) continue;
    TriMesh surface = extract_surface(layers, k);
    if (k == 0 && !(bounding_box(surface).lower.z > bottom)) {
      throw InputError(
          fmt::format("the bottom at {:g} nm is not below the lowest surface, which "
                      "goes down to {:g} nm",
                      bottom, bounding_box(surface).lower.z));
    }
    Welded body(surface.vertices.size() + below.vertices.size());
    body.add(surface, false);
    body.add(below, true);
    body.cancel_opposite();
    close_at_sides(sides, body);
    const MaterialId material = layers.stack[k].material;
    auto same = std::ranges::find(bodies, material, &MaterialBody::material);
    if (same == bodies.end()) {
      bodies.push_back({.material = material, .surface = {}});
      same = bodies.end() - 1;
    }
    append(Separation(body).run(), same->surface);
    below = std::move(surface);
  }
  return bodies;
}

double default_bottom(const Layers& layers) {
  constexpr double depth = 10;  // spacings
  const TriMesh lowest = extract_surface(layers, 0);
  return bounding_box(lowest).lower.z - depth * layers.frame.spacing;
}

double enclosed_volume(const TriMesh& surface) {
  double volume = 0;
  const Vec3d origin(surface.vertices.front());
  for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
    const auto [a, b, c] = corners(surface, f);
    volume += dot(a - origin, cross(b - origin, c - origin)) / 6;
  }
  return volume;
}

}  // namespace scarp
