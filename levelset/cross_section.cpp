#include "levelset/cross_section.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "levelset/extract_surface.h"

namespace scarp {

namespace {

/// One triangle's part of a cross-section: from one cut edge to another, by the vertices of the
/// edges.
struct Segment {
  std::uint64_t from = 0;
  std::uint64_t to = 0;
};

using Point = std::array<double, 2>;

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

class Slicer {
 public:
  Slicer(const TriMesh& mesh, const CutPlane& plane) : mesh_(mesh), plane_(plane) {}

  std::vector<Polyline> run() {
    collect();
    std::vector<Polyline> lines;
    // Open lines start where nothing leads to; what is left are closed ones.
    for (std::size_t n = 0; n < segments_.size(); ++n) {
      if (!arrives_.contains(segments_[n].from)) {
        lines.push_back(follow(n));
      }
    }
    for (std::size_t n = 0; n < segments_.size(); ++n) {
      if (!used_[n]) {
        lines.push_back(follow(n));
      }
    }
    return lines;
  }

 private:
  /// From the plane to the left of its direction.
  double distance(const Vec3f& r) const {
    return plane_.along[0] * (r.y - plane_.origin[1]) - plane_.along[1] * (r.x - plane_.origin[0]);
  }

  void collect() {
    // A vertex in the plane counts as left of it: lines pass beside vertices, never through them.
    std::vector<char> is_left(mesh_.vertices.size());
    for (std::size_t v = 0; v < is_left.size(); ++v)
      is_left[v] = distance(mesh_.vertices[v]) >= 0 ? 1 : 0;
    for (const Triangle& triangle : mesh_.triangles) {
      const int left = is_left[triangle[0]] + is_left[triangle[1]] + is_left[triangle[2]];
      if (left == 0 || left == 3) continue;
      Segment segment;
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t a = triangle[c];
        const std::uint32_t b = triangle[(c + 1) % 3];
        if (is_left[a] > is_left[b]) {
          segment.from = edge_key(a, b);
        } else if (is_left[a] < is_left[b]) {
          segment.to = edge_key(a, b);
        }
      }
      leaves_[segment.from] = segments_.size();
      arrives_[segment.to] = segments_.size();
      segments_.push_back(segment);
    }
    used_.assign(segments_.size(), false);
  }

  Point point(std::uint64_t edge) const {
    const Vec3f& from = mesh_.vertices[edge >> 32];
    const Vec3f& to = mesh_.vertices[edge & 0xffffffffU];
    const double t = distance(from) / (distance(from) - distance(to));
    const Vec3d a(from);
    const Vec3d r = a + t * (Vec3d(to) - a);
    return {plane_.along[0] * (r.x - plane_.origin[0]) + plane_.along[1] * (r.y - plane_.origin[1]),
            r.z};
  }

  Polyline follow(std::size_t n) {
    Polyline line;
    line.points.push_back(point(segments_[n].from));
    while (!used_[n]) {
      used_[n] = true;
      // Edges that meet in a vertex of the plane are cut at the same point.
      const Point next_point = point(segments_[n].to);
      if (next_point != line.points.back()) {
        line.points.push_back(next_point);
      }
      const auto next = leaves_.find(segments_[n].to);
      if (next == leaves_.end()) {
        break;
      }
      n = next->second;
    }
    return line;
  }

  const TriMesh& mesh_;
  CutPlane plane_;
  std::vector<Segment> segments_;
  std::vector<bool> used_;
  std::unordered_map<std::uint64_t, std::size_t> leaves_;
  std::unordered_map<std::uint64_t, std::size_t> arrives_;
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

std::vector<Polyline> cross_section(const TriMesh& mesh, const CutPlane& plane) {
  return Slicer(mesh, plane).run();
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
    if (adds_material(layers, n)) surfaces[n] = extract_surface(layers.stack[n].phi);
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

std::vector<std::vector<Polyline>> cross_section(const Layers& layers, int axis, double position) {
  std::vector<std::vector<Polyline>> lines;
  for (const TriMesh& surface : layer_surfaces(layers)) {
    lines.emplace_back();
    if (!surface.triangles.empty()) lines.back() = cross_section(surface, axis, position);
  }
  return lines;
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
  for (const Layer& layer : layers.stack) surfaces.push_back(extract_surface(layer.phi));
  return material_volumes(surfaces, layers.frame);
}

std::vector<double> material_volumes(std::span<const TriMesh> surfaces, const Frame& frame) {
  std::vector<double> volumes;
  double below = 0;
  for (const TriMesh& surface : surfaces) {
    const double all = volume_above_zero(surface, frame);
    volumes.push_back(all - below);
    below = all;
  }
  return volumes;
}

}  // namespace scarp
