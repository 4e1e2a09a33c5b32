#include "levelset/start/polygon_walls.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/parallel.h"

namespace scarp {

namespace {

/// Further than the band and the diagonal of a leaf, in spacings.
constexpr double reach = 12;

/// Width of the cells by which insides far from walls are looked up, in spacings.
constexpr double cell_spacings = 8;

constexpr std::uint32_t leaf_size = 4;  // panels

/// Width of the squares that know the walls near them, in spacings.
constexpr double bucket_spacings = 2;

double squared_to_box(Vec3d r, const Vec3d& lower, const Vec3d& upper) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double away = std::max({lower[axis] - r[axis], r[axis] - upper[axis], 0.0});
    sum += away * away;
  }
  return sum;
}

Vec3d outward_normal(const Point2& a, const Point2& b) {
  return normalized(Vec3d{b[1] - a[1], a[0] - b[0], 0});
}

/// How a corner moves when its edges move outwards by 1.
Vec3d mitre(Vec3d before, Vec3d after) { return (before + after) / (1 + dot(before, after)); }

}  // namespace

std::vector<Loop> moved_outwards(const std::vector<Loop>& loops, double distance) {
  std::vector<Loop> moved = loops;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    const Loop& loop = loops[l];
    const std::size_t count = loop.size();
    for (std::size_t p = 0; p < count; ++p) {
      const Vec3d shift = mitre(outward_normal(loop[(p + count - 1) % count], loop[p]),
                                outward_normal(loop[p], loop[(p + 1) % count]));
      moved[l][p] = {loop[p][0] + distance * shift.x, loop[p][1] + distance * shift.y};
    }
  }
  return moved;
}

PolygonWalls::PolygonWalls(const Frame& frame, const std::vector<Loop>& loops,
                           const WallHeights& heights)
    : reach_(reach * frame.spacing), cell_width_(cell_spacings * frame.spacing) {
  for (const Loop& loop : loops) add_walls(loop, heights);
  find_boxes();
  const Sides sides = frame.sides();
  for (int axis = 0; axis < 2; ++axis) {
    // Leaves reach beyond the domain.
    origin_[axis] = sides.lower[axis] - cell_width_;
    cells_[axis] = static_cast<std::size_t>(sides.width(axis) / cell_width_) + 3;
  }
  build_tree();
  // Upright, they are all as high: nearest in the plane is nearest at any height.
  if (heights.slope == 0 && heights.lowest == heights.foot) fill_buckets(frame);
  mark_insides(loops);
  find_overhead();
}

void PolygonWalls::add_walls(const Loop& loop, const WallHeights& heights) {
  const std::size_t count = loop.size();
  const double rise = heights.top - heights.foot;
  const double sine = std::sin(heights.slope);
  const double cosine = std::cos(heights.slope);
  for (std::size_t p = 0; p < count; ++p) {
    const std::array<Point2, 4> points{loop[(p + count - 1) % count], loop[p],
                                       loop[(p + 1) % count], loop[(p + 2) % count]};
    std::array<Vec3d, 3> flat;  // normals of the walls before, here, after
    for (std::size_t k = 0; k < 3; ++k) flat[k] = outward_normal(points[k], points[k + 1]);
    std::array<Vec3d, 3> tilted;
    for (std::size_t k = 0; k < 3; ++k) tilted[k] = cosine * flat[k] - Vec3d{0, 0, sine};
    const double growth = rise * sine / cosine;
    const Vec3d left{points[1][0], points[1][1], heights.foot};
    const Vec3d right{points[2][0], points[2][1], heights.foot};
    const Vec3d top_left = left + growth * mitre(flat[0], flat[1]) + Vec3d{0, 0, rise};
    const Vec3d top_right = right + growth * mitre(flat[1], flat[2]) + Vec3d{0, 0, rise};
    const bool straight_on = heights.lowest < heights.foot;
    Panel upper{.corners = {left, right, top_right, top_left}, .normal = tilted[1]};
    upper.side_normals = {flat[1], tilted[1] + tilted[2], flat[1], tilted[0] + tilted[1]};
    upper.corner_normals = {flat[0] + flat[1], flat[1] + flat[2], flat[1] + flat[2],
                            flat[0] + flat[1]};
    if (straight_on) {
      const Vec3d down{0, 0, heights.lowest - heights.foot};
      Panel below{.corners = {left + down, right + down, right, left}, .normal = flat[1]};
      upper.side_normals[0] = flat[1] + tilted[1];
      below.side_normals = {flat[1], flat[1] + flat[2], flat[1] + tilted[1], flat[0] + flat[1]};
      below.corner_normals = {flat[0] + flat[1], flat[1] + flat[2], flat[1] + flat[2],
                              flat[0] + flat[1]};
      panels_.push_back(below);
    }
    panels_.push_back(upper);
  }
}

void PolygonWalls::find_boxes() {
  for (Panel& panel : panels_) {
    panel.lower = panel.upper = panel.corners[0];
    for (const Vec3d& corner : panel.corners) {
      for (int axis = 0; axis < 3; ++axis) {
        panel.lower[axis] = std::min(panel.lower[axis], corner[axis]);
        panel.upper[axis] = std::max(panel.upper[axis], corner[axis]);
      }
    }
  }
}

std::size_t PolygonWalls::cell(int axis, double position) const {
  const double index = std::floor((position - origin_[axis]) / cell_width_);
  return static_cast<std::size_t>(std::clamp(index, 0.0, static_cast<double>(cells_[axis] - 1)));
}

void PolygonWalls::build_tree() {
  order_.resize(panels_.size());
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.push_back({.first = 0, .count = static_cast<std::uint32_t>(panels_.size())});
  // Children are added behind.
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) split(n);
}

/// Halves a node along the longer side of the middles of its panels.
void PolygonWalls::split(std::uint32_t node) {
  const std::uint32_t first = nodes_[node].first;
  const std::uint32_t count = nodes_[node].count;
  if (count == 0) return;
  const auto begin = order_.begin() + first;
  Vec3d lower = panels_[*begin].lower;
  Vec3d upper = panels_[*begin].upper;
  const auto middle = [&](std::uint32_t n, int axis) {
    return panels_[n].lower[axis] + panels_[n].upper[axis];
  };
  std::array<double, 2> least{middle(*begin, 0), middle(*begin, 1)};
  std::array<double, 2> most = least;
  for (auto each = begin; each != begin + count; ++each) {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], panels_[*each].lower[axis]);
      upper[axis] = std::max(upper[axis], panels_[*each].upper[axis]);
    }
    for (int axis = 0; axis < 2; ++axis) {
      least[axis] = std::min(least[axis], middle(*each, axis));
      most[axis] = std::max(most[axis], middle(*each, axis));
    }
  }
  nodes_[node].lower = lower;
  nodes_[node].upper = upper;
  if (count <= leaf_size) return;
  const int axis = most[0] - least[0] < most[1] - least[1] ? 1 : 0;
  const std::uint32_t half = count / 2;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t n, std::uint32_t m) {
    return std::pair(middle(n, axis), n) < std::pair(middle(m, axis), m);
  });
  nodes_[node].first = static_cast<std::uint32_t>(nodes_.size());
  nodes_[node].count = 0;
  nodes_.push_back({.first = first, .count = half});
  nodes_.push_back({.first = first + half, .count = count - half});
}

double PolygonWalls::centre(int axis, std::size_t index) const {
  return origin_[axis] + (static_cast<double>(index) + 0.5) * cell_width_;
}

void PolygonWalls::mark_insides(const std::vector<Loop>& loops) {
  std::vector<std::vector<double>> crossings(cells_[1]);
  for (const Loop& loop : loops) {
    for (std::size_t p = 0; p < loop.size(); ++p) {
      const Point2& a = loop[p];
      const Point2& b = loop[(p + 1) % loop.size()];
      const std::size_t last = cell(1, std::max(a[1], b[1]));
      for (std::size_t j = cell(1, std::min(a[1], b[1])); j <= last; ++j) {
        const double y = centre(1, j);
        if ((a[1] > y) == (b[1] > y)) continue;
        crossings[j].push_back(a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
      }
    }
  }
  inside_.resize(cells_[0] * cells_[1]);
  for (std::size_t j = 0; j < cells_[1]; ++j) {
    for (std::size_t i = 0; i < cells_[0]; ++i) {
      // A wall right on the line counts as left of it, as in find_overhead.
      const auto left = std::count_if(crossings[j].begin(), crossings[j].end(),
                                      [&](double x) { return x <= centre(0, i); });
      inside_[i * cells_[1] + j] = left % 2 != 0;
    }
  }
}

void PolygonWalls::find_overhead() {
  overhead_.resize(inside_.size());
  for (const Panel& panel : panels_) {
    if (panel.normal.z == 0) continue;
    // Seen from above; a side that two panels share is taken the same way round in both.
    const auto covers = [&](double x, double y) {
      bool odd = false;
      for (std::size_t k = 0; k < 4; ++k) {
        Vec3d a = panel.corners[k];
        Vec3d b = panel.corners[(k + 1) % 4];
        if (a.y > b.y) std::swap(a, b);
        if ((a.y > y) == (b.y > y)) continue;
        odd = odd != (x < a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
      }
      return odd;
    };
    for (std::size_t i = cell(0, panel.lower.x); i <= cell(0, panel.upper.x); ++i) {
      for (std::size_t j = cell(1, panel.lower.y); j <= cell(1, panel.upper.y); ++j) {
        const Vec3d from{centre(0, i), centre(1, j), panel.corners[0].z};
        if (!covers(from.x, from.y)) continue;
        const double rise = dot(panel.corners[0] - from, panel.normal) / panel.normal.z;
        overhead_[i * cells_[1] + j].push_back(from.z + rise);
      }
    }
  }
}

/// Where no wall is near: the way to the middle of the cell, at the same height, crosses none.
double PolygonWalls::far_sign(Vec3d r) const {
  const std::size_t c = cell(0, r.x) * cells_[1] + cell(1, r.y);
  bool inside = inside_[c];
  for (const double z : overhead_[c]) inside = inside != (z < r.z);
  return inside ? -1 : 1;
}

void PolygonWalls::visit(std::uint32_t n, Vec3d r, Nearest& nearest) const {
  const Panel& panel = panels_[n];
  if (squared_to_box(r, panel.lower, panel.upper) > nearest.square) return;
  const auto offer = [&](Vec3d point, Vec3d outside, bool on_face) {
    const Vec3d away = r - point;
    const double square = dot(away, away);
    if (square < nearest.square || (square == nearest.square && n < nearest.panel))
      nearest = {square, n, point, outside, on_face};
  };
  bool above_face = true;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec3d from = panel.corners[k];
    const Vec3d edge = panel.corners[(k + 1) % 4] - from;
    // A point off the face beyond this side is nearest to a side or a corner.
    if (dot(cross(edge, r - from), panel.normal) >= 0) continue;
    above_face = false;
    const double square = dot(edge, edge);
    const double s = square > 0 ? dot(r - from, edge) / square : 0;
    if (s <= 0) {
      offer(from, panel.corner_normals[k], false);
    } else if (s >= 1) {
      offer(panel.corners[(k + 1) % 4], panel.corner_normals[(k + 1) % 4], false);
    } else {
      offer(from + s * edge, panel.side_normals[k], false);
    }
  }
  if (above_face) {
    offer(r - dot(r - panel.corners[0], panel.normal) * panel.normal, panel.normal, true);
  }
}

/// Calls visit with the panels whose boxes' leaves are within square, which visit may make smaller.
template <class Visit>
void PolygonWalls::visit_near(Vec3d r, const double& square, const Visit& visit) const {
  // The nearer one of two children first; a tree of 2^32 panels is no deeper.
  struct Entry {
    double square;
    std::uint32_t node;
  };
  std::array<Entry, 64> stack;
  std::size_t depth = 0;
  const auto enter = [&](std::uint32_t n) {
    return Entry{squared_to_box(r, nodes_[n].lower, nodes_[n].upper), n};
  };
  if (!panels_.empty()) stack[depth++] = enter(0);
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.square > square) continue;
    const Node& node = nodes_[entry.node];
    if (node.count > 0) {
      for (std::uint32_t k = 0; k < node.count; ++k) visit(order_[node.first + k]);
      continue;
    }
    Entry near = enter(node.first);
    Entry far = enter(node.first + 1);
    if (far.square < near.square) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
}

PolygonWalls::Nearest PolygonWalls::nearest(Vec3d r, double limit) const {
  Nearest nearest{.square = limit * limit};
  const auto offer = [&](std::uint32_t n) { visit(n, r, nearest); };
  if (const auto bucket = buckets_.find(r)) {
    for (std::uint32_t k = buckets_.first[*bucket]; k < buckets_.first[*bucket + 1]; ++k)
      offer(buckets_.panels[k]);
  } else {
    visit_near(r, nearest.square, offer);
  }
  return nearest;
}

std::optional<std::size_t> PolygonWalls::Buckets::find(Vec3d r) const {
  if (first.empty()) return std::nullopt;
  std::array<double, 2> index{};
  for (int axis = 0; axis < 2; ++axis) {
    index[axis] = std::floor((r[axis] - origin[axis]) / width);
    if (!(index[axis] >= 0 && index[axis] < static_cast<double>(count[axis]))) return std::nullopt;
  }
  return static_cast<std::size_t>(index[0]) * count[1] + static_cast<std::size_t>(index[1]);
}

void PolygonWalls::fill_buckets(const Frame& frame) {
  if (panels_.empty()) return;
  Buckets buckets{.width = bucket_spacings * frame.spacing};
  const Sides sides = frame.sides();
  for (int axis = 0; axis < 2; ++axis) {
    buckets.origin[axis] = sides.lower[axis] - 0.5 * buckets.width;
    buckets.count[axis] = static_cast<std::size_t>(sides.width(axis) / buckets.width) + 2;
  }
  // One end of a bucket to the other, with what rounding takes.
  const double across = (1 + 1e-9) * std::numbers::sqrt2 * buckets.width;
  std::vector<std::vector<std::uint32_t>> near(buckets.count[0] * buckets.count[1]);
  parallel_for(near.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto place = [&](int axis, std::size_t index) {
        return buckets.origin[axis] + (static_cast<double>(index) + 0.5) * buckets.width;
      };
      const Vec3d middle{place(0, n / buckets.count[1]), place(1, n % buckets.count[1]),
                         panels_.front().lower.z};
      // What is nearest to a point is at most so much further from the middle than what is nearest
      // to that: half of the way across there, and half of it back.
      const double most = std::sqrt(nearest(middle, reach_ + 0.5 * across).square) + across;
      visit_near(middle, most * most, [&](std::uint32_t p) {
        if (squared_to_box(middle, panels_[p].lower, panels_[p].upper) <= most * most)
          near[n].push_back(p);
      });
    }
  });
  buckets.first.push_back(0);
  for (const auto& some : near) {
    buckets.panels.insert(buckets.panels.end(), some.begin(), some.end());
    buckets.first.push_back(static_cast<std::uint32_t>(buckets.panels.size()));
  }
  buckets_ = std::move(buckets);
}

Distance PolygonWalls::operator()(Vec3d r) const {
  const Nearest nearest = this->nearest(r, reach_);
  // Upwards, so that a plane that it meets is met in no edge; without a direction it would be.
  if (nearest.panel == Nearest{}.panel) return {far_sign(r) * reach_, {0, 0, 1}};
  const Vec3d away = r - nearest.point;
  const double distance = std::sqrt(nearest.square);
  const double sign = dot(away, nearest.outside) < 0 ? -1 : 1;
  if (nearest.on_face || distance == 0) return {sign * distance, normalized(nearest.outside)};
  return {sign * distance, (sign / distance) * away};
}

}  // namespace scarp
