#include "levelset/cross_section.h"

#include <algorithm>
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

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

class Slicer {
 public:
  Slicer(const TriMesh& mesh, int axis, double position)
      : mesh_(mesh), axis_(axis), position_(position) {}

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
  /// A vertex in the plane counts as above it: lines pass beside vertices, never through them.
  bool is_above(std::uint32_t v) const { return mesh_.vertices[v][axis_] >= position_; }

  void collect() {
    for (const Triangle& triangle : mesh_.triangles) {
      Segment segment;
      bool cut = false;
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t a = triangle[c];
        const std::uint32_t b = triangle[(c + 1) % 3];
        if (is_above(a) && !is_above(b)) {
          segment.from = edge_key(a, b);
          cut = true;
        } else if (!is_above(a) && is_above(b)) {
          segment.to = edge_key(a, b);
        }
      }
      if (cut) {
        // Seen with the lateral axis to the right, the two cutting planes are of opposite hand.
        if (axis_ == 0) {
          std::swap(segment.from, segment.to);
        }
        leaves_[segment.from] = segments_.size();
        arrives_[segment.to] = segments_.size();
        segments_.push_back(segment);
      }
    }
    used_.assign(segments_.size(), false);
  }

  std::array<double, 2> point(std::uint64_t edge) const {
    const Vec3d a(mesh_.vertices[edge >> 32]);
    const Vec3d b(mesh_.vertices[edge & 0xffffffffU]);
    const double t = (position_ - a[axis_]) / (b[axis_] - a[axis_]);
    const Vec3d r = a + t * (b - a);
    return {r[1 - axis_], r.z};
  }

  Polyline follow(std::size_t n) {
    Polyline line;
    line.points.push_back(point(segments_[n].from));
    while (!used_[n]) {
      used_[n] = true;
      // Edges that meet in a vertex of the plane are cut at the same point.
      const std::array<double, 2> next_point = point(segments_[n].to);
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
  int axis_;
  double position_;
  std::vector<Segment> segments_;
  std::vector<bool> used_;
  std::unordered_map<std::uint64_t, std::size_t> leaves_;
  std::unordered_map<std::uint64_t, std::size_t> arrives_;
};

/// Volume of the solid under a surface above z = 0, less that of the gas below: the integral of z
/// over the surface's shadow. Side walls add nothing.
double volume_above_zero(const TriMesh& mesh) {
  double volume = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    volume += (a.z + b.z + c.z) / 3 * area_vector(mesh, f).z;
  }
  return volume;
}

}  // namespace

std::vector<Polyline> cross_section(const TriMesh& mesh, int axis, double position) {
  const Box box = bounding_box(mesh);
  const double inside = 1e-6 * (box.upper[axis] - box.lower[axis]);
  return Slicer(mesh, axis,
                std::clamp(position, box.lower[axis] + inside, box.upper[axis] - inside))
      .run();
}

std::vector<std::vector<Polyline>> cross_section(const Layers& layers, int axis, double position) {
  std::vector<std::vector<Polyline>> lines;
  for (std::size_t n = 0; n < layers.stack.size(); ++n) {
    lines.emplace_back();
    if (!adds_material(layers, n)) continue;
    lines.back() = cross_section(extract_surface(layers.stack[n].phi), axis, position);
  }
  return lines;
}

std::vector<double> material_volumes(const Layers& layers) {
  std::vector<double> volumes;
  double below = 0;
  for (const Layer& layer : layers.stack) {
    const double all = volume_above_zero(extract_surface(layer.phi));
    volumes.push_back(all - below);
    below = all;
  }
  return volumes;
}

}  // namespace scarp
