#include "levelset/operations/clearance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "levelset/grid/exposure.h"

namespace scarp {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double diagonal = 1.41421356237309515;  // of a cell

// Discs that are too large by this fit.
constexpr double tolerance = 0.01;
// Discs are known further inwards by this than the opening is wide.
constexpr double layer = 2;
// Beyond the disc this far: what its rim misses between centres that lie apart.
constexpr double slack = 0.15;
// How far around discs it is told how far away they are.
constexpr double margin = 1.5;

// So that sums with whole numbers are exact, and those of mirror images the same to the bit.
double rounded(double part) {
  constexpr double steps = 1 << 20;
  return std::round(part * steps) / steps;
}
constexpr double smallest_cut = 1e-6;

struct Point {
  double x = 0;
  double y = 0;
};

Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y}; }
double dot(Point a, Point b) { return a.x * b.x + a.y * b.y; }
double length(Point a) { return std::sqrt(dot(a, a)); }

double squared_distance(Point r, Point a, Point b) {
  const Point along = b - a;
  const Point from = r - a;
  const double square = dot(along, along);
  const double part = square > 0 ? std::clamp(dot(from, along) / square, 0.0, 1.0) : 0;
  const Point across{from.x - part * along.x, from.y - part * along.y};
  return dot(across, across);
}

using Place = std::array<int, 2>;  // of a node in the plane

/// Which nodes of a plane are gas, and where walls cut the edges between its nodes.
class Section {
 public:
  Section(const Band& band, int k)
      : band_(band), k_(k), solid_(band), cuts_{LevelPlane<float>(band), LevelPlane<float>(band)} {
    for (int i = 0; i < count(0); ++i)
      for (int j = 0; j < count(1); ++j) solid_.at(i, j) = is_solid_at({i, j}, k) ? 1 : 0;
    for (int axis = 0; axis < axes(); ++axis)
      for (int i = 0; i < count(0); ++i)
        for (int j = 0; j < count(1); ++j)
          if (const Place here{i, j}; is_cut(axis, here))
            cuts_[static_cast<std::size_t>(axis)].at(i, j) = cut_between(here, next(axis, here));
  }

  int axes() const { return band_.frame().lateral_axes(); }
  int count(int axis) const { return solid_.count(axis); }
  bool is_solid(const Place& at) const { return solid_.folded(at[0], at[1]) != 0; }
  /// Whether a wall cuts the edge from a node to the next one along an axis.
  bool is_cut(int axis, const Place& at) const { return is_solid(at) != is_solid(next(axis, at)); }
  /// And where, from its end in the gas. In (0, 1].
  double cut(int axis, const Place& at) const {
    Place stored{band_.fold(0, at[0]), band_.fold(1, at[1])};
    auto& along = stored[static_cast<std::size_t>(axis)];
    if (band_.frame().boundary[static_cast<std::size_t>(axis)] == Boundary::reflective)
      along = std::min(along, band_.fold(axis, at[static_cast<std::size_t>(axis)] + 1));
    return static_cast<double>(cuts_[static_cast<std::size_t>(axis)].at(stored[0], stored[1]));
  }
  float phi(const Place& at) const { return band_.node(at[0], at[1], k_); }
  const Band& band() const { return band_; }

  static Place next(int axis, Place at, int step = 1) {
    at[static_cast<std::size_t>(axis)] += step;
    return at;
  }

 private:
  bool is_solid_at(const Place& at, int k) const { return band_.node(at[0], at[1], k) < 0; }

  /// Whether what is beyond the plane on one side of it is of the other phase, there and at the
  /// nodes of the same phase beside it.
  bool ends_at(const Place& at, int k) const {
    const bool is_solid_here = is_solid_at(at, k_);
    const auto ends = [&](const Place& place) {
      return is_solid_at(place, k_) != is_solid_here || is_solid_at(place, k) != is_solid_here;
    };
    bool all = ends(at);
    for (int axis = 0; axis < axes() && all; ++axis)
      all = ends(next(axis, at)) && ends(next(axis, at, -1));
    return all;
  }

  float cut_between(const Place& one, const Place& other) const {
    const Place& gas = is_solid_at(one, k_) ? other : one;
    const Place& solid = is_solid_at(one, k_) ? one : other;
    const auto is_wall = [&](int k) { return !is_solid_at(gas, k) && is_solid_at(solid, k); };
    int k = k_;
    if (ends_at(gas, k_ - 1) && is_wall(k_ + 1)) {
      k = k_ + 1;
    } else if (ends_at(solid, k_ + 1) && is_wall(k_ - 1)) {
      k = k_ - 1;
    }
    const float part = crossing(band_.node(gas[0], gas[1], k), band_.node(solid[0], solid[1], k));
    return static_cast<float>(rounded(std::max(static_cast<double>(part), smallest_cut)));
  }

  const Band& band_;
  int k_;
  LevelPlane<unsigned char> solid_;
  std::array<LevelPlane<float>, 2> cuts_;
};

/// How far it is from every node of gas to the first wall along an axis; infinite beyond reach.
LevelPlane<double> distances_along(const Section& section, int axis, int step, int reach) {
  LevelPlane<double> result(section.band(), infinite);
  const int last = section.count(axis) - 1;
  for (int other = 0; other < section.count(1 - axis); ++other) {
    double distance = infinite;
    const int begin = step > 0 ? last + reach : -reach;
    for (int place = begin; step > 0 ? place >= 0 : place <= last; place -= step) {
      const Place at = axis == 0 ? Place{place, other} : Place{other, place};
      if (section.is_solid(at)) {
        distance = infinite;
        continue;
      }
      const Place edge = step > 0 ? at : Section::next(axis, at, -1);
      distance = section.is_cut(axis, edge) ? section.cut(axis, edge) : distance + 1;
      if (place >= 0 && place <= last)
        result.at(at[0], at[1]) = distance <= reach ? distance : infinite;
    }
  }
  return result;
}

/// What repeats along the sides is not looked at again.
int within_sides(const Band& band, double reach) {
  const int most = 2 * std::max(band.frame().cells[0], band.frame().cells[1]) + 1;
  return reach < most ? static_cast<int>(std::ceil(reach)) : most;
}

/// Openings along a line are as wide as it is from wall to wall.
Clearance clearance_along(const Section& section, double radius) {
  const int reach = within_sides(section.band(), 2 * (radius + layer));
  const LevelPlane<double> up = distances_along(section, 0, 1, reach);
  const LevelPlane<double> down = distances_along(section, 0, -1, reach);
  constexpr auto far = static_cast<float>(margin);
  Clearance result{LevelPlane<float>(section.band(), far), LevelPlane<float>(section.band())};
  for (int i = 0; i < section.count(0); ++i)
    for (int j = 0; j < section.count(1); ++j) {
      const double spare = 0.5 * (up.at(i, j) + down.at(i, j)) - radius;
      if (spare < -tolerance) result.covered.at(i, j) = -far;
      result.spare.at(i, j) = spare > -1 ? static_cast<float>(std::min(spare, layer))
                                         : -std::numeric_limits<float>::infinity();
    }
  return result;
}

/// The widest discs of a plane.
class Discs {
 public:
  Discs(const Section& section, double radius)
      : section_(section),
        radius_(radius),
        reach_(within_sides(section.band(), radius + layer + 1)),
        walls_{distances_along(section, 0, -1, reach_), distances_along(section, 0, 1, reach_),
               distances_along(section, 1, -1, reach_), distances_along(section, 1, 1, reach_)},
        distance_(section.band()),
        result_{LevelPlane<float>(section.band(), static_cast<float>(-margin)),
                LevelPlane<float>(section.band(), -std::numeric_limits<float>::infinity())} {}

  Clearance run() {
    for_nodes([&](const Place& at) {
      if (!section_.is_solid(at)) distance_.at(at[0], at[1]) = distance_at(at);
    });
    for_nodes([&](const Place& at) {
      const double here = distance_.at(at[0], at[1]);
      if (here >= radius_ && here < radius_ + layer) cover(at, {}, here);
    });
    for_nodes([&](const Place& at) {
      if (may_have_a_peak(at)) find_peak(at);
    });
    for_nodes([&](const Place& at) {
      if (distance_.at(at[0], at[1]) < radius_ + layer) return;
      result_.covered.at(at[0], at[1]) = static_cast<float>(margin);
      result_.spare.at(at[0], at[1]) = static_cast<float>(layer);
    });
    forget_rims_at_walls();
    return std::move(result_);
  }

 private:
  struct Segment {
    Point begin{};
    Point end{};
  };
  struct Square {
    Point middle{};
    double half = 0;
    double distance = 0;  // of its middle to the nearest wall
  };

  template <class Visit>
  void for_nodes(const Visit& visit) const {
    for (int i = 0; i < section_.count(0); ++i)
      for (int j = 0; j < section_.count(1); ++j) visit(Place{i, j});
  }

  /// Where a cut lies, from a node.
  Point cut_point(int axis, const Place& edge, const Place& from) const {
    const auto a = static_cast<std::size_t>(axis);
    const bool is_gas_first = !section_.is_solid(edge);
    const double part = section_.cut(axis, edge);
    std::array<double, 2> r{static_cast<double>(edge[0] - from[0]),
                            static_cast<double>(edge[1] - from[1])};
    r[a] = is_gas_first ? r[a] + part : r[a] + 1 - part;
    return {r[0], r[1]};
  }

  /// Calls visit for the pieces of wall from a cut through the two cells at its edge.
  template <class Visit>
  void for_walls_at(int axis, const Place& edge, const Place& from, const Visit& visit) const {
    const Point here = cut_point(axis, edge, from);
    for (const int step : {-1, 0}) {
      const Place low = Section::next(1 - axis, edge, step);
      const std::array<std::pair<int, Place>, 4> edges{std::pair{0, low}, std::pair{1, low},
                                                       std::pair{0, Section::next(1, low)},
                                                       std::pair{1, Section::next(0, low)}};
      for (const auto& [other_axis, other] : edges) {
        if (other_axis == axis && other == edge) continue;
        if (section_.is_cut(other_axis, other))
          visit(Segment{here, cut_point(other_axis, other, from)});
      }
    }
  }

  /// Calls visit for pieces of all walls that are seen from a node or a cell, along rows and then
  /// columns of nodes that are no further than most(). size: 0 for the node, 1 for the cell.
  template <class Most, class Visit>
  void for_walls_around(const Place& low, int size, const Most& most, const Visit& visit) const {
    for (int n = 0; n <= reach_; ++n)
      for (int axis = 0; axis < 2 && n <= most() + diagonal; ++axis)
        for (const int line : {low[static_cast<std::size_t>(1 - axis)] - n,
                               low[static_cast<std::size_t>(1 - axis)] + size + n}) {
          look_along(axis, line, low, size, most, visit);
          if (n == 0 && size == 0) break;
        }
  }

  template <class Most, class Visit>
  void look_along(int axis, int line, const Place& low, int size, const Most& most,
                  const Visit& visit) const {
    const int first = low[static_cast<std::size_t>(axis)];
    for (const int step : {-1, 1}) {
      Place at = axis == 0 ? Place{first, line} : Place{line, first};
      // From the end of the cell on that side, or the other one where that lies in the solid.
      if (step > 0) at = Section::next(axis, at, size);
      if (size > 0 && section_.is_solid(at)) at = Section::next(axis, at, -step);
      if (section_.is_solid(at)) continue;
      const auto& walls = walls_[2 * static_cast<std::size_t>(axis) + (step > 0 ? 1 : 0)];
      const double distance = walls.folded(at[0], at[1]);
      if (std::isinf(distance) || distance > most() + diagonal + size) continue;
      const int nodes = static_cast<int>(std::ceil(distance)) - 1;
      const Place gas = Section::next(axis, at, step * nodes);
      for_walls_at(axis, step > 0 ? gas : Section::next(axis, gas, -1), low, visit);
    }
  }

  // Rims of discs that touch walls bound nothing that is left.
  void forget_rims_at_walls() {
    const LevelPlane<float> covered = result_.covered;
    for_nodes([&](const Place& at) {
      float least = covered.at(at[0], at[1]);
      for (int n = 0; n < 9; ++n)
        if (const Place beside{at[0] + n % 3 - 1, at[1] + n / 3 - 1}; !section_.is_solid(beside))
          least = std::min(least, covered.folded(beside[0], beside[1]));
      if (least > 0) result_.covered.at(at[0], at[1]) = LevelSet::half_width;
    });
  }

  double distance_at(const Place& node) const {
    double square = infinite;
    for_walls_around(
        node, 0, [&] { return std::sqrt(square); },
        [&](const Segment& wall) {
          square = std::min(square, squared_distance({}, wall.begin, wall.end));
        });
    return std::sqrt(square);
  }

  /// The nodes at the corners of a cell.
  static std::array<Place, 4> corners(const Place& low) {
    return {low, Place{low[0] + 1, low[1]}, Place{low[0], low[1] + 1},
            Place{low[0] + 1, low[1] + 1}};
  }

  /// Whether the distance to walls may be largest within a cell, and large enough.
  bool may_have_a_peak(const Place& low) const {
    std::array<double, 4> at{};
    bool is_all_gas = true;
    std::ranges::transform(corners(low), at.begin(), [&](const Place& node) {
      is_all_gas = is_all_gas && !section_.is_solid(node);
      return distance_.folded(node[0], node[1]);
    });
    const auto [least, most] = std::ranges::minmax(at);
    if (least >= radius_ + 1 || most + 0.5 * diagonal < radius_ - 1 || most == 0) return false;
    if (!is_all_gas) return true;
    // Where all of it sees the same wall, the distance grows as fast as it can.
    const double x = 0.5 * ((at[1] - at[0]) + (at[3] - at[2]));
    const double y = 0.5 * ((at[2] - at[0]) + (at[3] - at[1]));
    return x * x + y * y < 0.97;
  }

  /// phi in a cell, from its nodes.
  double phi_in(const std::array<double, 4>& phi, Point r) const {
    return (phi[0] * (1 - r.x) * (1 - r.y) + phi[1] * r.x * (1 - r.y)) +
           (phi[2] * (1 - r.x) * r.y + phi[3] * r.x * r.y);
  }

  // Squares that may hold the peak are cut into four until they are small. Every level is looked
  // at as a whole, so that the order of squares does not count.
  void find_peak(const Place& low) {
    std::array<double, 4> phi{};
    double most = 0;
    for (std::size_t n = 0; n < phi.size(); ++n) {
      const Place node = corners(low)[n];
      phi[n] = static_cast<double>(section_.phi(node));
      most = std::max(most, distance_.folded(node[0], node[1]));
    }
    std::vector<Segment> walls;
    for_walls_around(
        low, 1, [&] { return most + diagonal; },
        [&](const Segment& wall) { walls.push_back(wall); });
    const auto distance = [&](Point r) {
      if (phi_in(phi, r) < 0) return 0.0;
      double square = infinite;
      for (const Segment& wall : walls)
        square = std::min(square, squared_distance(r, wall.begin, wall.end));
      return std::sqrt(square);
    };
    constexpr double half = 0.5;
    std::vector<Square> squares{{.middle = {half, half}, .half = half}};
    double peak = 0;
    while (true) {
      for (Square& square : squares) {
        square.distance = distance(square.middle);
        peak = std::max(peak, square.distance);
      }
      const double reached = diagonal * squares.front().half;
      std::erase_if(squares, [&](const Square& square) {
        const double largest = square.distance + reached;
        return largest < peak || largest < radius_ - 1;
      });
      if (squares.empty()) return;
      if (reached < tolerance) break;
      squares = quarters(squares);
    }
    if (!std::isinf(peak)) cover(low, middle_of(squares), peak);
  }

  static Point middle_of(const std::vector<Square>& squares) {
    constexpr double half = 0.5;
    Point sum{};
    for (const Square& square : squares) {
      sum.x += square.middle.x - half;
      sum.y += square.middle.y - half;
    }
    const auto count = static_cast<double>(squares.size());
    return {half + rounded(sum.x / count), half + rounded(sum.y / count)};
  }

  static std::vector<Square> quarters(const std::vector<Square>& squares) {
    std::vector<Square> result;
    result.reserve(4 * squares.size());
    for (const Square& square : squares) {
      const double half = 0.5 * square.half;
      for (const double x : {-half, half})
        for (const double y : {-half, half})
          result.push_back({.middle = {square.middle.x + x, square.middle.y + y}, .half = half});
    }
    return result;
  }

  /// Tells the nodes around a disc of it. middle: from a node.
  void cover(const Place& node, Point middle, double radius) {
    const bool fits = radius >= radius_ - tolerance;
    const double farthest = radius + slack + margin;
    const int around = static_cast<int>(std::ceil(farthest)) + 1;
    for (int i = -around; i <= around; ++i)
      for (int j = -around; j <= around; ++j) {
        const Point r = Point{static_cast<double>(i), static_cast<double>(j)} - middle;
        if (dot(r, r) > farthest * farthest) continue;
        const int x = section_.band().fold(0, node[0] + i);
        const int y = section_.band().fold(1, node[1] + j);
        const double inside = radius + slack - length(r);
        if (fits)
          result_.covered.at(x, y) = std::max(result_.covered.at(x, y), static_cast<float>(inside));
        if (inside > 0)
          result_.spare.at(x, y) = std::max(result_.spare.at(x, y),
                                            static_cast<float>(std::min(radius - radius_, layer)));
      }
  }

  const Section& section_;
  double radius_;
  int reach_;
  std::array<LevelPlane<double>, 4> walls_;  // -x, +x, -y, +y
  LevelPlane<double> distance_;
  Clearance result_;
};

}  // namespace

Clearance clearance(const Band& band, int k, double radius) {
  const Section section(band, k);
  return section.axes() == 1 ? clearance_along(section, radius) : Discs(section, radius).run();
}

}  // namespace scarp
