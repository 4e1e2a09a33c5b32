#include "levelset/grid/welded.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "core/disjoint_sets.h"

namespace scarp {

namespace {

/// Facets at an edge whose directions differ by less lie on each other, radians.
constexpr double same_direction = 1e-4;

/// An edge of a triangle.
struct Side {
  std::uint32_t low, high;  ///< its ends, the lower one first
  std::uint32_t corner;     ///< 3 f + c, where it begins
  bool forward;             ///< from low to high

  std::uint32_t facet() const { return corner / 3; }
  std::uint32_t next() const { return corner % 3 == 2 ? corner - 2 : corner + 1; }
  std::uint32_t apex() const { return corner % 3 == 0 ? corner + 2 : corner - 1; }
  std::uint32_t at_low() const { return forward ? corner : next(); }
  std::uint32_t at_high() const { return forward ? next() : corner; }
};

std::uint32_t vertex_at(std::span<const Triangle> triangles, std::uint32_t corner) {
  return triangles[corner / 3][corner % 3];
}

/// By edges; within one in the order of the triangles.
std::vector<Side> sides_of(const std::vector<Triangle>& triangles) {
  std::vector<Side> sides;
  for (std::uint32_t corner = 0; corner < 3 * triangles.size(); ++corner) {
    const Side side{0, 0, corner, true};
    const std::uint32_t a = vertex_at(triangles, corner);
    const std::uint32_t b = vertex_at(triangles, side.next());
    sides.push_back({std::min(a, b), std::max(a, b), corner, a < b});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.corner) < std::tie(b.low, b.high, b.corner);
  });
  return sides;
}

template <class Visit>
void for_each_edge(const std::vector<Side>& sides, const Visit& visit) {
  for (std::size_t begin = 0; begin < sides.size();) {
    std::size_t end = begin + 1;
    while (end < sides.size() && sides[end].low == sides[begin].low &&
           sides[end].high == sides[begin].high) {
      ++end;
    }
    visit(std::span(sides).subspan(begin, end - begin));
    begin = end;
  }
}

using Pair = std::array<Side, 2>;

/// Takes those out of an edge that share it in the input, two of them alone.
std::vector<Pair> pairs_of_input(const std::vector<Triangle>& input, std::vector<Side>& edge) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Side>> at;
  for (const Side& side : edge) {
    at[{vertex_at(input, side.at_low()), vertex_at(input, side.at_high())}].push_back(side);
  }
  std::vector<Pair> pairs;
  edge.clear();
  for (const auto& entry : at) {
    const std::vector<Side>& same = entry.second;
    if (same.size() == 2 && same[0].forward != same[1].forward) {
      pairs.push_back({same[0], same[1]});
    } else {
      edge.insert(edge.end(), same.begin(), same.end());
    }
  }
  return pairs;
}

/// Round an edge, from the widest gap on: facets that lie on each other have one direction.
struct Turned {
  Side side;
  double angle;
  int direction;
};

std::vector<Turned> turned_round(const TriMesh& mesh, const std::vector<Side>& edge) {
  const Vec3d origin(mesh.vertices[edge[0].low]);
  const Vec3d along = normalized(Vec3d(mesh.vertices[edge[0].high]) - origin);
  const Vec3d other = std::abs(along.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d x = normalized(cross(other, along));
  const Vec3d y = cross(along, x);
  std::vector<Turned> turned;
  for (const Side& side : edge) {
    const Vec3d to_apex = Vec3d(mesh.vertices[vertex_at(mesh.triangles, side.apex())]) - origin;
    turned.push_back({side, std::atan2(dot(to_apex, y), dot(to_apex, x)), 0});
  }
  std::sort(turned.begin(), turned.end(), [](const Turned& a, const Turned& b) {
    return std::tie(a.angle, a.side.corner) < std::tie(b.angle, b.side.corner);
  });
  const std::size_t count = turned.size();
  const auto gap_before = [&](std::size_t n) {
    return n > 0 ? turned[n].angle - turned[n - 1].angle
                 : turned[0].angle + 2 * std::numbers::pi - turned[count - 1].angle;
  };
  std::size_t first = 0;
  for (std::size_t n = 1; n < count; ++n) first = gap_before(n) > gap_before(first) ? n : first;
  std::vector<bool> is_apart(count);
  for (std::size_t n = 0; n < count; ++n) is_apart[n] = gap_before(n) > same_direction;
  int direction = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t k = (first + n) % count;
    direction += is_apart[k] ? 1 : 0;
    turned[k].direction = direction;
  }
  std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(first), turned.end());
  return turned;
}

/// Counter-clockwise as seen from high to low solid begins behind a facet that runs backwards, and
/// ends at one that runs forwards. Where two bodies touch the one ends before the other begins.
std::vector<Pair> pairs_by_solid(const TriMesh& mesh, const std::vector<Side>& edge) {
  std::vector<Turned> turned = turned_round(mesh, edge);
  std::stable_sort(turned.begin(), turned.end(), [](const Turned& a, const Turned& b) {
    return std::pair(a.direction, !a.side.forward) < std::pair(b.direction, !b.side.forward);
  });
  // Begins where no solid is open.
  int open = 0;
  int least = 0;
  std::size_t first = 0;
  for (std::size_t n = 0; n < turned.size(); ++n) {
    open += turned[n].side.forward ? -1 : 1;
    if (open < least) {
      least = open;
      first = n + 1;
    }
  }
  if (open != 0) return {};
  std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(first), turned.end());
  std::vector<Pair> pairs;
  std::vector<Side> begun;
  for (const Turned& each : turned) {
    if (!each.side.forward) {
      begun.push_back(each.side);
    } else {
      pairs.push_back({begun.back(), each.side});
      begun.pop_back();
    }
  }
  return pairs;
}

/// The pairs of triangles at an edge with more than two; none if they cannot be told apart.
std::vector<Pair> pairs_at(const TriMesh& mesh, const std::vector<Triangle>& input,
                           std::span<const Side> edge) {
  std::vector<Side> rest(edge.begin(), edge.end());
  std::vector<Pair> pairs = pairs_of_input(input, rest);
  if (rest.empty()) return pairs;
  const std::vector<Pair> others = pairs_by_solid(mesh, rest);
  if (others.empty()) return {};
  pairs.insert(pairs.end(), others.begin(), others.end());
  return pairs;
}

/// Gives bodies that touch along an edge vertices of their own. input: the triangles with the
/// vertices that they had.
void part_bodies(const std::vector<Triangle>& input, TriMesh& mesh) {
  const std::vector<Side> sides = sides_of(mesh.triangles);
  DisjointSets corners(3 * mesh.triangles.size());
  std::vector<bool> is_shared(mesh.vertices.size(), false);
  const auto join = [&](const Side& a, const Side& b) {
    corners.join(a.at_low(), b.at_low());
    corners.join(a.at_high(), b.at_high());
  };
  for_each_edge(sides, [&](std::span<const Side> edge) {
    const std::vector<Pair> pairs =
        edge.size() > 2 ? pairs_at(mesh, input, edge) : std::vector<Pair>{};
    for (const Pair& pair : pairs) join(pair[0], pair[1]);
    if (!pairs.empty()) {
      is_shared[edge[0].low] = is_shared[edge[0].high] = true;
    } else {
      for (const Side& side : edge) join(edge[0], side);
    }
  });
  if (std::find(is_shared.begin(), is_shared.end(), true) == is_shared.end()) return;
  constexpr std::uint32_t none = ~0U;
  std::vector<std::uint32_t> first_at(mesh.vertices.size(), none);
  std::map<std::uint32_t, std::uint32_t> own;  // by the lowest corner of a body at a vertex
  for (std::uint32_t corner = 0; corner < 3 * mesh.triangles.size(); ++corner) {
    std::uint32_t& v = mesh.triangles[corner / 3][corner % 3];
    if (!is_shared[v]) continue;
    const std::uint32_t lowest = corners.lowest(corner);
    if (first_at[v] == none) first_at[v] = lowest;
    if (first_at[v] == lowest) continue;
    const auto [entry, is_new] =
        own.insert({lowest, static_cast<std::uint32_t>(mesh.vertices.size())});
    if (is_new) mesh.vertices.push_back(Vec3f(mesh.vertices[v]));
    v = entry->second;
  }
}

/// Calls visit(side) for each edge with one triangle only.
template <class Visit>
void for_each_border(const TriMesh& mesh, const Visit& visit) {
  for_each_edge(sides_of(mesh.triangles), [&](std::span<const Side> edge) {
    if (edge.size() == 1) visit(edge[0]);
  });
}

std::vector<bool> border_vertices(const TriMesh& mesh) {
  std::vector<bool> is_on_border(mesh.vertices.size(), false);
  for_each_border(
      mesh, [&](const Side& side) { is_on_border[side.low] = is_on_border[side.high] = true; });
  return is_on_border;
}

/// In edges.
std::size_t border_length(const TriMesh& mesh) {
  std::size_t count = 0;
  for_each_border(mesh, [&](const Side& /*side*/) { ++count; });
  return count;
}

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
  std::vector<Triangle> input;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    const Triangle triangle{number[t[0]], number[t[1]], number[t[2]]};
    if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0]) {
      result.triangles.push_back(triangle);
      input.push_back(t);
      if (!mesh.materials.empty()) result.materials.push_back(mesh.materials[f]);
    }
  }
  part_bodies(input, result);
  return result;
}

bool is_unwelded(const TriMesh& mesh) {
  const std::vector<bool> is_on_border = border_vertices(mesh);
  std::vector<std::tuple<float, float, float>> places;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3f& r = mesh.vertices[v];
    if (is_on_border[v]) places.emplace_back(r.x, r.y, r.z);
  }
  std::sort(places.begin(), places.end());
  if (std::adjacent_find(places.begin(), places.end()) == places.end()) return false;
  return border_length(welded(mesh)) < border_length(mesh);
}

}  // namespace scarp
