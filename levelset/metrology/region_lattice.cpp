#include "levelset/metrology/region_lattice.h"

#include <algorithm>
#include <cmath>

#include "levelset/metrology/region_surface.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

constexpr int below_grid = -1000000000;
constexpr int above_grid = 1000000000;

/// Heights from one to another, each further from the last.
std::vector<double> graded(double from, double to, double step) {
  constexpr double growth = 1.25;
  std::vector<double> z;
  for (double next = from + step; std::abs(to - next) > 0.7 * std::abs(step); next += step) {
    if ((to - next) * step < 0) break;
    z.push_back(next);
    step *= growth;
  }
  z.push_back(to);
  return z;
}

}  // namespace

MeshedStack meshed_stack(const Layers& layers) {
  MeshedStack stack;
  Box box;
  for (std::size_t k = 0; k < layers.stack.size(); ++k) {
    if (k > 0 && !adds_material(layers, k)) continue;
    stack.layers.push_back(&layers.stack[k]);
    const Box own = bounding_box(extract_surface(layers, k));
    box.add(own.lower);
    box.add(own.upper);
  }
  stack.lower = box.lower.z;
  stack.upper = box.upper.z;
  return stack;
}

RegionLattice::RegionLattice(const Layers& layers, double bottom, std::optional<double> lid)
    : frame_(layers.frame),
      stack_(meshed_stack(layers)),
      first_(frame_.axisymmetric ? frame_.cells[0] / 2 : 0) {
  constexpr double room = 4;  // spacings of gas that is not kept
  add_planes(bottom, lid.value_or(stack_.upper + room * frame_.spacing));
  nodes_ = {frame_.cells[0] + 1 - first_, frame_.cells[1] + 1, static_cast<int>(z_.size())};
}

void RegionLattice::add_planes(double bottom, double top) {
  constexpr double room = 3;  // spacings around the surfaces
  const double h = frame_.spacing;
  const int lowest =
      static_cast<int>(std::ceil(std::max(stack_.lower / h - room, bottom / h + 0.5)));
  const int highest =
      static_cast<int>(std::floor(std::min(stack_.upper / h + room, top / h - 0.5)));
  for (double z : graded(lowest * h, bottom, -h)) {
    z_.insert(z_.begin(), z);
    grid_planes_.insert(grid_planes_.begin(), below_grid);
  }
  for (int k = lowest; k <= highest; ++k) {
    z_.push_back(k * h);
    grid_planes_.push_back(k);
  }
  for (double z : graded(highest * h, top, h)) {
    z_.push_back(z);
    grid_planes_.push_back(above_grid);
  }
}

bool RegionLattice::has(const Node& n) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (n[axis] < 0 || n[axis] >= nodes_[axis]) return false;
  return true;
}

Vec3d RegionLattice::position(const Node& n) const {
  return {frame_.node_position(0, n[0] + first_), frame_.node_position(1, n[1]),
          z_[static_cast<std::size_t>(n[2])]};
}

std::uint8_t RegionLattice::sides(const Node& n) const {
  unsigned sides = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (n[axis] == 0) sides |= 1U << (2 * axis);
    if (n[axis] == nodes_[axis] - 1) sides |= 2U << (2 * axis);
  }
  return static_cast<std::uint8_t>(sides);
}

void RegionLattice::read_values(const Node& n, std::vector<double>& values) const {
  constexpr double far = LevelSet::half_width;
  const int plane = grid_planes_[static_cast<std::size_t>(n[2])];
  for (std::size_t m = 0; m < stack_.layers.size(); ++m) {
    double value =
        plane == below_grid ? -far
        : plane == above_grid
            ? far
            : static_cast<double>(stack_.layers[m]->phi.node(n[0] + first_, n[1], plane));
    if (m > 0 && values[m - 1] - value < thinnest_meshed_film) value = values[m - 1];
    values[m] = value;
  }
}

int RegionLattice::label_of(const std::vector<double>& values) const {
  int label = 0;
  while (label < stack_.count() && !(values[static_cast<std::size_t>(label)] < 0)) ++label;
  return label;
}

std::vector<RegionLattice::SideFace> RegionLattice::side_faces(const Node& cell) const {
  std::vector<SideFace> faces;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const std::size_t b = (a + 1) % 3;
    const std::size_t c = (a + 2) % 3;
    for (int upper = 0; upper < 2; ++upper) {
      if (cell[a] != (upper == 0 ? 0 : nodes_[a] - 2)) continue;
      SideFace face{.side = 2 * axis + upper, .corners = {cell, cell, cell, cell}};
      for (Node& n : face.corners) n[a] += upper;
      ++face.corners[upper == 1 ? 1 : 3][b];
      ++face.corners[upper == 1 ? 3 : 1][c];
      ++face.corners[2][b];
      ++face.corners[2][c];
      faces.push_back(face);
    }
  }
  return faces;
}

}  // namespace scarp
