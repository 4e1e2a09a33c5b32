#include "levelset/metrology/cross_section.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

using Point = std::array<double, 2>;

/// One facet's part of a cross-section: from one cut edge to another, by the vertices of the edges.
struct Segment {
  std::uint64_t from = 0;
  std::uint64_t to = 0;
};

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

/// From a plane to the left of its direction.
double distance(const CutPlane& plane, double x, double y) {
  return plane.along[0] * (y - plane.origin[1]) - plane.along[1] * (x - plane.origin[0]);
}

// A vertex in the plane counts as left of it: lines pass beside vertices, never through them.
bool is_left(const CutPlane& plane, double x, double y) { return distance(plane, x, y) >= 0; }

/// Segments joined to lines.
class Chain {
 public:
  Chain(const TriMesh& mesh, const CutPlane& plane, std::vector<Segment> segments)
      : mesh_(mesh), plane_(plane), segments_(std::move(segments)), used_(segments_.size()) {
    for (std::size_t n = 0; n < segments_.size(); ++n) {
      leaves_.emplace_back(segments_[n].from, n);
      arrives_.push_back(segments_[n].to);
    }
    std::ranges::sort(leaves_);
    std::ranges::sort(arrives_);
  }

  std::vector<Polyline> lines() {
    std::vector<Polyline> lines;
    // Open lines start where nothing leads to; what is left are closed ones.
    for (std::size_t n = 0; n < segments_.size(); ++n)
      if (!std::ranges::binary_search(arrives_, segments_[n].from)) lines.push_back(follow(n));
    for (std::size_t n = 0; n < segments_.size(); ++n)
      if (!used_[n]) lines.push_back(follow(n));
    return lines;
  }

 private:
  Point point(std::uint64_t edge) const {
    const Vec3d a(mesh_.vertices[edge >> 32]);
    const Vec3d b(mesh_.vertices[edge & 0xffffffffU]);
    const double before = distance(plane_, a.x, a.y);
    const double after = distance(plane_, b.x, b.y);
    const Vec3d r = a + before / (before - after) * (b - a);
    return {plane_.along[0] * (r.x - plane_.origin[0]) + plane_.along[1] * (r.y - plane_.origin[1]),
            r.z};
  }

  Polyline follow(std::size_t n) {
    Polyline line;
    line.points.push_back(point(segments_[n].from));
    while (!used_[n]) {
      used_[n] = true;
      // Edges that meet in a vertex of the plane are cut at the same point.
      const std::uint64_t edge = segments_[n].to;
      const Point next_point = point(edge);
      if (next_point != line.points.back()) line.points.push_back(next_point);
      const auto next = std::ranges::upper_bound(leaves_, edge, {}, &Leaving::first);
      if (next == leaves_.begin() || std::prev(next)->first != edge) break;
      n = std::prev(next)->second;
    }
    return line;
  }

  using Leaving = std::pair<std::uint64_t, std::size_t>;  ///< an edge, and the segment from there

  const TriMesh& mesh_;
  const CutPlane& plane_;
  std::vector<Segment> segments_;
  std::vector<bool> used_;
  std::vector<Leaving> leaves_;         ///< sorted
  std::vector<std::uint64_t> arrives_;  ///< edges, sorted
};

/// Mirrored about a lateral position; turned round, so that the gas stays on the left.
Polyline mirrored(const Polyline& line, double side) {
  Polyline result;
  for (auto point = line.points.rbegin(); point != line.points.rend(); ++point)
    result.points.push_back({2 * side - (*point)[0], (*point)[1]});
  return result;
}

Polyline shifted(const Polyline& line, double shift) {
  Polyline result;
  for (const Point& point : line.points) result.points.push_back({point[0] + shift, point[1]});
  return result;
}

/// Joins open lines where the end of one is the start of another, or of itself.
std::vector<Polyline> joined(std::vector<Polyline> lines, double tolerance) {
  const auto meet = [&](const Point& a, const Point& b) {
    return std::abs(a[0] - b[0]) < tolerance && std::abs(a[1] - b[1]) < tolerance;
  };
  const auto append = [](Polyline& line, const Polyline& other) {
    line.points.insert(line.points.end(), other.points.begin() + 1, other.points.end());
  };
  std::vector<Polyline> done;
  while (!lines.empty()) {
    Polyline line = std::move(lines.back());
    lines.pop_back();
    if (meet(line.points.back(), line.points.front())) {
      line.points.back() = line.points.front();
      done.push_back(std::move(line));
      continue;
    }
    const auto neighbour = std::find_if(lines.begin(), lines.end(), [&](const Polyline& other) {
      return meet(line.points.back(), other.points.front()) ||
             meet(other.points.back(), line.points.front());
    });
    if (neighbour == lines.end()) {
      done.push_back(std::move(line));
    } else if (meet(line.points.back(), neighbour->points.front())) {
      append(line, *neighbour);
      *neighbour = std::move(line);
    } else {
      append(*neighbour, line);
    }
  }
  return done;
}

/// Volume of the solid under a surface above z = 0, less that of the gas below: the integral of z
/// over the surface's shadow. Side walls add nothing.
double volume_above_zero(const TriMesh& mesh, const Frame& frame) {
  double volume = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    volume += frame.around((a.x + b.x + c.x) / 3) * (a.z + b.z + c.z) / 3 * area_vector(mesh, f).z;
  }
  return volume;
}

}  // namespace

CutPlane CutPlane::across(int axis, double position) {
  if (axis == 0) return {.origin = {position, 0}, .along = {0, 1}};
  return {.origin = {0, position}, .along = {1, 0}};
}

double just_inside(double position, double lower, double upper) {
  const double inside = 1e-6 * (upper - lower);
  return std::clamp(position, lower + inside, upper - inside);
}

Slicer::Slicer(const TriMesh& mesh) : mesh_(mesh) {
  for (std::size_t begin = 0; begin < mesh.triangles.size(); begin += run_length) {
    const std::size_t count = std::min(run_length, mesh.triangles.size() - begin);
    const Vec3f& any = mesh.vertices[mesh.triangles[begin][0]];
    Run run{.lower = {any.x, any.y}, .upper = {any.x, any.y}};
    for (const Triangle& triangle : std::span(mesh.triangles).subspan(begin, count)) {
      for (int c = 0; c < 3; ++c) {
        const Vec3f& r = mesh.vertices[triangle[c]];
        run.lower = {std::min(run.lower[0], r.x), std::min(run.lower[1], r.y)};
        run.upper = {std::max(run.upper[0], r.x), std::max(run.upper[1], r.y)};
      }
    }
    runs_.push_back(run);
  }
}

// Of a run the two corners decide that are farthest to the left and to the right: by the arithmetic
// of a vertex, which no rounding brings beyond them.
bool Slicer::passes(const CutPlane& plane, const Run& run) {
  const auto corner = [&](bool leftmost) {
    return is_left(plane, (plane.along[1] > 0) == leftmost ? run.lower[0] : run.upper[0],
                   (plane.along[0] > 0) == leftmost ? run.upper[1] : run.lower[1]);
  };
  return corner(true) && !corner(false);
}

std::vector<Polyline> Slicer::cut(const CutPlane& plane) const {
  std::vector<Segment> segments;
  const auto add = [&](const Triangle& triangle) {
    std::array<bool, 3> left{};
    for (int c = 0; c < 3; ++c) {
      const Vec3f& r = mesh_.vertices[triangle[c]];
      left[static_cast<std::size_t>(c)] = is_left(plane, r.x, r.y);
    }
    if (left[0] == left[1] && left[1] == left[2]) return;
    Segment segment;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t next = (c + 1) % 3;
      if (left[c] == left[next]) continue;
      (left[c] ? segment.from : segment.to) =
          edge_key(triangle[static_cast<int>(c)], triangle[static_cast<int>(next)]);
    }
    segments.push_back(segment);
  };
  for (std::size_t n = 0; n < runs_.size(); ++n) {
    if (!passes(plane, runs_[n])) continue;
    const std::size_t begin = n * run_length;
    const std::size_t count = std::min(run_length, mesh_.triangles.size() - begin);
    for (const Triangle& triangle : std::span(mesh_.triangles).subspan(begin, count)) add(triangle);
  }
  return Chain(mesh_, plane, std::move(segments)).lines();
}

std::vector<Polyline> cross_section(const TriMesh& mesh, const CutPlane& plane) {
  return Slicer(mesh).cut(plane);
}

std::vector<Polyline> cross_section(const TriMesh& mesh, int axis, double position) {
  const Box box = bounding_box(mesh);
  return cross_section(
      mesh, CutPlane::across(axis, just_inside(position, box.lower[axis], box.upper[axis])));
}

std::vector<Polyline> with_surroundings(const std::vector<Polyline>& lines, double lower,
                                        double upper, Boundary boundary) {
  // Points on a side are rounded in the mesh, and interpolated along the one or the other edge.
  const double tolerance = 1e-5 * (upper - lower);
  std::vector<Polyline> all = lines;
  for (const Polyline& line : lines) {
    if (boundary == Boundary::periodic) {
      all.push_back(shifted(line, lower - upper));
      all.push_back(shifted(line, upper - lower));
    } else {
      all.push_back(mirrored(line, lower));
      all.push_back(mirrored(line, upper));
    }
  }
  return joined(std::move(all), tolerance);
}

std::vector<TriMesh> layer_surfaces(const Layers& layers) {
  std::vector<TriMesh> surfaces(layers.stack.size());
  for (std::size_t n = 0; n < surfaces.size(); ++n)
    if (adds_material(layers, n)) surfaces[n] = extract_surface(layers, n);
  return surfaces;
}

std::vector<Polyline> clipped(std::span<const Polyline> lines, double left, double right) {
  std::vector<Polyline> kept;
  for (const Polyline& line : lines) {
    bool is_inside = false;
    for (std::size_t n = 1; n < line.points.size(); ++n) {
      const Point& a = line.points[n - 1];
      const Point& b = line.points[n];
      // From where on, and up to where, the segment lies between the two.
      double from = 0;
      double to = 1;
      for (const auto& [side, sign] : {std::pair(left, 1.0), std::pair(right, -1.0)}) {
        const double a_within = sign * (a[0] - side);
        const double b_within = sign * (b[0] - side);
        if (a_within < 0 && b_within < 0) to = -1;
        if (a_within < 0 && b_within >= 0) from = std::max(from, a_within / (a_within - b_within));
        if (a_within >= 0 && b_within < 0) to = std::min(to, a_within / (a_within - b_within));
      }
      if (from >= to) {
        is_inside = false;
        continue;
      }
      const auto at = [&](double t) {
        return Point{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
      };
      if (!is_inside || from > 0) kept.push_back({.points = {from > 0 ? at(from) : a}});
      kept.back().points.push_back(to < 1 ? at(to) : b);
      is_inside = to == 1;
    }
  }
  return kept;
}

double area_above_zero(std::span<const Polyline> lines) {
  // Lines have the gas to their left, so that voids count against it, and what closes them along a
  // side adds nothing.
  double area = 0;
  for (const Polyline& line : lines) {
    for (std::size_t n = 1; n < line.points.size(); ++n) {
      const auto& [x0, z0] = line.points[n - 1];
      const auto& [x1, z1] = line.points[n];
      area += 0.5 * (z0 + z1) * (x1 - x0);
    }
  }
  return area;
}

std::vector<double> material_volumes(const Layers& layers) {
  std::vector<TriMesh> surfaces;
  for (std::size_t n = 0; n < layers.stack.size(); ++n)
    surfaces.push_back(extract_surface(layers, n));
  return material_volumes(surfaces, layers.frame);
}

std::vector<double> material_volumes(std::span<const TriMesh> surfaces, const Frame& frame) {
  std::vector<double> volumes;
  double below = 0;
  for (const TriMesh& surface : surfaces) {
    const double all = surface.triangles.empty() ? below : volume_above_zero(surface, frame);
    volumes.push_back(all - below);
    below = all;
  }
  return volumes;
}

}  // namespace scarp
