#include "levelset/level_set.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/band.h"

namespace scarp {

namespace {

constexpr float half_width = LevelSet::half_width;

/// Distance from the centre of a leaf to its outermost nodes, in spacings.
const double leaf_radius = 3.5 * std::sqrt(3.0);

struct Sampler {
  const Frame& frame;
  const std::function<double(Vec3d)>& distance;
  double overestimate;

  // In two dimensions both rows of nodes ask at the same point.
  Vec3d position(double i, double j, double k) const {
    return {frame.node_position(0, i), frame.two_dimensional ? 0.0 : frame.node_position(1, j),
            frame.node_position(2, k)};
  }

  bool near_band(const std::array<int, 3>& origin) const {
    const double d = distance(position(origin[0] + 3.5, origin[1] + 3.5, origin[2] + 3.5));
    return !(std::abs(d) > overestimate * (half_width + leaf_radius) * frame.spacing);
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
        const NewLeaf leaf{.origin = {x * leaf_edge, y * leaf_edge, z * leaf_edge}};
        if (sampler.near_band(leaf.origin)) {
          found[c].push_back(leaf);
        }
      }
    }
  });
  std::vector<NewLeaf> all;
  for (const auto& column : found) {
    all.insert(all.end(), column.begin(), column.end());
  }
  return all;
}

void sample_leaf(const Leaf& leaf, const Sampler& sampler, int i_count, int j_count) {
  for (int i = 0; i < i_count; ++i) {
    for (int j = 0; j < j_count; ++j) {
      for (int k = 0; k < leaf_edge; ++k) {
        leaf.phi[leaf_offset(i, j, k)] =
            sampler.phi(leaf.origin[0] + i, leaf.origin[1] + j, leaf.origin[2] + k);
      }
    }
  }
}

void sample(const Band& band, const Sampler& sampler) {
  parallel_for(band.leaves().size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = band.leaves()[n];
      sample_leaf(leaf, sampler, std::min(leaf_edge, band.node_count(0) - leaf.origin[0]),
                  std::min(leaf_edge, band.node_count(1) - leaf.origin[1]));
    }
  });
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
    const double middle = frame.middle(axis);
    const double whole = std::floor(middle);
    const double index = std::abs(from_middle) + (middle - whole);
    const double below = std::floor(index);
    const auto nearer = static_cast<int>(whole + below);
    const auto mirrored = static_cast<int>(2 * middle);
    corner[0][axis] = from_middle < 0 ? mirrored - nearer : nearer;
    corner[1][axis] = from_middle < 0 ? mirrored - nearer - 1 : nearer + 1;
    part[1][axis] = index - below;
    part[0][axis] = 1 - part[1][axis];
  }
  const auto weighted = [&](int i, int j, int k) {
    const double weight = part[i][0] * part[j][1] * part[k][2];
    return weight > 0 ? weight * node(corner[i][0], corner[j][1], corner[k][2]) : 0.0;
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
