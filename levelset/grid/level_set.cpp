#include "levelset/grid/level_set.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/grid/band.h"

namespace scarp {

namespace {

constexpr float half_width = LevelSet::half_width;

/// Nodes from one on, as many along each axis.
struct Cube {
  std::array<int, 3> origin;
  int edge;
};

struct Sampler {
  const Frame& frame;
  const std::function<double(Vec3d)>& distance;
  double overestimate;

  Vec3d position(double i, double j, double k) const {
    return frame.in_section(
        {frame.node_position(0, i), frame.node_position(1, j), frame.node_position(2, k)});
  }

  /// In the middle of a cube of nodes, in spacings.
  double middle(const Cube& cube) const {
    const double half = 0.5 * (cube.edge - 1);
    const auto& [i, j, k] = cube.origin;
    return distance(position(i + half, j + half, k + half)) / frame.spacing;
  }

  /// Whether nodes of a cube may be in the band, by the distance in its middle.
  bool near_band(const Cube& cube, double middle) const {
    const double radius = 0.5 * (cube.edge - 1) * std::numbers::sqrt3;
    return !(std::abs(middle) > overestimate * (half_width + radius));
  }

  float phi(int i, int j, int k) const {
    const auto value = static_cast<float>(distance(position(i, j, k)) / frame.spacing);
    return off_surface(std::clamp(value, -half_width, half_width));
  }
};

std::vector<NewLeaf> leaves_near(const Band& band, const Sampler& sampler, int lowest,
                                 int highest) {
  const auto columns = static_cast<std::size_t>(band.column_count(0)) *
                       static_cast<std::size_t>(band.column_count(1));
  std::vector<std::vector<NewLeaf>> found(columns);
  parallel_for(columns, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const int x = static_cast<int>(c) / band.column_count(1);
      const int y = static_cast<int>(c) % band.column_count(1);
      for (int z = lowest; z <= highest; ++z) {
        const Cube leaf{.origin = {x * leaf_edge, y * leaf_edge, z * leaf_edge}, .edge = leaf_edge};
        if (sampler.near_band(leaf, sampler.middle(leaf)))
          found[c].push_back({.origin = leaf.origin});
      }
    }
  });
  std::vector<NewLeaf> all;
  for (const auto& column : found) {
    all.insert(all.end(), column.begin(), column.end());
  }
  return all;
}

void sample_cube(const Band& band, Leaf& leaf, const Sampler& sampler, const Cube& cube) {
  // Most of a leaf is far from a surface that runs through it or past it.
  const double middle = sampler.middle(cube);
  const bool is_far = !sampler.near_band(cube, middle);
  const auto [i0, j0, k0] = cube.origin;
  for (int i = i0; i < std::min(i0 + cube.edge, band.node_count(0)); ++i) {
    for (int j = j0; j < std::min(j0 + cube.edge, band.node_count(1)); ++j) {
      for (int k = k0; k < k0 + cube.edge; ++k) {
        leaf.phi[leaf_offset(i, j, k)] =
            is_far ? static_cast<float>(std::copysign(half_width, middle)) : sampler.phi(i, j, k);
      }
    }
  }
}

void sample(Band& band, const Sampler& sampler) {
  constexpr int edge = 4;
  parallel_for(band.leaves().size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Leaf& leaf = band.leaves()[n];
      for (int part = 0; part < 8; ++part) {
        Cube cube{.origin = leaf.origin, .edge = edge};
        for (int axis = 0; axis < 3; ++axis) cube.origin[axis] += (part >> axis & 1) * edge;
        sample_cube(band, leaf, sampler, cube);
      }
    }
  });
}

/// The values of the leaf that has all nodes of a cell, by two opposite ones: most cells have one.
const float* leaf_of_cell(const Band& band, const std::array<std::array<int, 3>, 2>& corner) {
  std::array<int, 3> place{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [first, last] = std::minmax(corner[0][axis], corner[1][axis]);
    const bool is_folded =
        axis != 2 && (first < 0 || last >= band.node_count(static_cast<int>(axis)));
    if (first >> 3 != last >> 3 || is_folded) return nullptr;
    place[axis] = first >> 3;
  }
  const int leaf = band.find(place[0], place[1], place[2]);
  return leaf >= 0 ? band.leaves()[static_cast<std::size_t>(leaf)].phi : missing_values(leaf);
}

}  // namespace

LevelSet::LevelSet(const Frame& frame, const std::function<double(Vec3d)>& distance, double lower,
                   double upper, double overestimate)
    : band_(std::make_unique<Band>(frame)) {
  SCARP_ASSERT(lower, <=, upper);
  const Sampler sampler{frame, distance, overestimate};
  const double leaf_height = leaf_edge * frame.spacing;
  const int lowest = static_cast<int>(std::floor(lower / leaf_height)) - 1;
  const int highest = static_cast<int>(std::ceil(upper / leaf_height)) + 1;
  band_->change_leaves(leaves_near(*band_, sampler, lowest, highest), {});
  sample(*band_, sampler);
  band_->trim();
}

LevelSet::LevelSet(std::unique_ptr<Band> band) : band_(std::move(band)) {}
LevelSet::LevelSet(LevelSet&&) noexcept = default;
LevelSet& LevelSet::operator=(LevelSet&&) noexcept = default;
LevelSet::~LevelSet() = default;

LevelSet LevelSet::copy() const { return LevelSet(band_->copy()); }

const Frame& LevelSet::frame() const { return band_->frame(); }

float LevelSet::node(int i, int j, int k) const { return band_->node(i, j, k); }

// Cells are counted from the middle outward, and corners that change places across the diagonal are
// added first: mirror images of a point find the same to the last bit.
double LevelSet::distance(Vec3d r) const {
  const Frame& frame = band_->frame();
  std::array<std::array<int, 3>, 2> corner{};  // nearer to the middle and farther
  std::array<std::array<double, 3>, 2> part{};
  for (int axis = 0; axis < 3; ++axis) {
    const double from_middle = r[axis] / frame.spacing;
    const auto mirrored = static_cast<int>(2 * frame.middle(axis));
    const double index = std::abs(from_middle) + (mirrored % 2 == 0 ? 0 : 0.5);
    const auto below = static_cast<int>(index);
    const int nearer = mirrored / 2 + below;
    corner[0][axis] = from_middle < 0 ? mirrored - nearer : nearer;
    corner[1][axis] = from_middle < 0 ? mirrored - nearer - 1 : nearer + 1;
    part[1][axis] = index - below;
    part[0][axis] = 1 - part[1][axis];
  }
  const float* leaf = leaf_of_cell(*band_, corner);
  const auto weighted = [&](int i, int j, int k) {
    const double weight = part[i][0] * part[j][1] * part[k][2];
    const auto [x, y, z] = std::array{corner[i][0], corner[j][1], corner[k][2]};
    if (leaf != nullptr) return weight * leaf[leaf_offset(x, y, z)];
    return weight > 0 ? weight * node(x, y, z) : 0.0;
  };
  double phi = 0;
  for (const int k : {0, 1})
    phi += (weighted(0, 0, k) + weighted(1, 1, k)) + (weighted(0, 1, k) + weighted(1, 0, k));
  return phi * frame.spacing;
}

Vec3d LevelSet::normal(Vec3d r) const {
  const double step = 0.5 * frame().spacing;
  Vec3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d offset;
    offset[axis] = step;
    gradient[axis] = distance(r + offset) - distance(r - offset);
  }
  return normalized(gradient);
}

bool LevelSet::empty() const { return band_->leaves().empty(); }

std::size_t LevelSet::active_count() const {
  std::size_t count = 0;
  for (const Leaf& leaf : band_->leaves()) {
    for (int i = 0; i < leaf_edge; ++i) {
      count += static_cast<std::size_t>(std::popcount(leaf.active[i]));
    }
  }
  return count;
}

std::size_t LevelSet::memory_bytes() const { return band_->memory_bytes(); }

double LevelSet::lower() const {
  int lowest = 0;
  bool first = true;
  for (const Leaf& leaf : band_->leaves()) {
    lowest = first ? leaf.origin[2] : std::min(lowest, leaf.origin[2]);
    first = false;
  }
  return lowest * frame().spacing;
}

double LevelSet::upper() const {
  int highest = 0;
  bool first = true;
  for (const Leaf& leaf : band_->leaves()) {
    highest = first ? leaf.origin[2] : std::max(highest, leaf.origin[2]);
    first = false;
  }
  return (highest + leaf_edge - 1) * frame().spacing;
}

std::uint64_t LevelSet::hash() const {
  XXH64_hash_t hash = 0;
  for (const Leaf& leaf : band_->leaves()) {
    hash = XXH3_64bits_withSeed(leaf.origin.data(), sizeof leaf.origin, hash);
    hash = XXH3_64bits_withSeed(leaf.active, leaf_edge * sizeof *leaf.active, hash);
    hash = XXH3_64bits_withSeed(leaf.phi, leaf_size * sizeof *leaf.phi, hash);
  }
  return hash;
}

}  // namespace scarp
