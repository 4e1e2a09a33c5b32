#include "levelset/operations/layer_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "levelset/grid/band.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/images.h"
#include "levelset/grid/redistance.h"
#include "levelset/operations/closed_voids.h"
#include "levelset/operations/layer_sets.h"
#include "levelset/operations/necks.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Node nearest_node(const Frame& frame, Vec3d r) {
  Node node{};
  for (int axis = 0; axis < 3; ++axis) {
    node[axis] = static_cast<int>(std::lround(r[axis] / frame.spacing + frame.middle(axis)));
  }
  return node;
}

/// Distance from the surface that open gas sees, > 0 in that gas; closed voids count as solid.
class OpenDistance {
 public:
  /// Asked for at most for a film of the given thickness.
  OpenDistance(const Layers& layers, const OpenGas& gas, double thickness)
      : layers_(layers),
        gas_(gas),
        limit_(thickness + reach * layers.frame.spacing),
        tree_(extract_surface(layers, gas)) {}

  double operator()(Vec3d r) const {
    const Frame& frame = layers_.frame;
    // Triangles are no mirror images: what lies beyond the diagonal asks where its image lies.
    if (frame.diagonal && r.y > r.x) std::swap(r.x, r.y);
    const bool open = is_open_gas(layers_.top().band(), gas_, nearest_node(frame, r));
    return (open ? 1 : -1) * nearest(r);
  }

 private:
  /// What is further away than this from the film, in spacings, is not asked for: the band, half
  /// the diagonal of a leaf, and the way from a point to the node nearest to it.
  static constexpr double reach = LevelSet::half_width + 8;

  /// At most the limit.
  double nearest(Vec3d r) const {
    r = layers_.frame.in_section(r);
    double distance = tree_.closest(r, limit_).distance;
    for (const Image& image : images_of(layers_.frame, r, limit_))
      distance = std::min(distance, tree_.closest(image.r, limit_).distance);
    return distance;
  }

  const Layers& layers_;
  const OpenGas& gas_;
  double limit_;
  TriangleTree tree_;
};

/// Lets a film grow that is not thicker than a spacing. In the band phi itself tells the distance,
/// and unlike an extracted surface it knows arcs of such a radius from edges: films may be laid one
/// upon another.
void coat_thinly(Band& band, const OpenGas& gas, float thickness) {
  std::vector<float*> held;
  std::vector<float> held_phi;
  for (Leaf& leaf : band.leaves()) {
    for (int node = 0; !gas.voids.empty() && node < leaf_size; ++node) {
      if (holds_void(band, gas, node_at(leaf, node))) {
        held.push_back(leaf.phi + node);
        held_phi.push_back(leaf.phi[node]);
      }
    }
  }
  for (Leaf& leaf : band.leaves()) {
    for (int node = 0; node < leaf_size; ++node) {
      float& phi = leaf.phi[node];
      if (std::abs(phi) < LevelSet::half_width) phi = off_surface(phi - thickness);
    }
  }
  for (std::size_t n = 0; n < held.size(); ++n) *held[n] = held_phi[n];
  band.trim();
  for (int pass = 0; pass < 2; ++pass) redistance(band);
}

void coat_freely(Layers& layers, const OpenGas& gas, const OpenDistance& distance,
                 double thickness) {
  const double margin = LevelSet::half_width * layers.frame.spacing;
  LevelSet film(
      layers.frame, [&](Vec3d r) { return distance(r) - thickness; }, layers.top().lower() - margin,
      layers.top().upper() + thickness + margin);
  if (!gas.voids.empty()) take_over_voids(layers.top().band(), gas, film.band());
  layers.top() = std::move(film);
  cut_lower_layers(layers);
}

/// The lowest node of open gas, and the highest with solid above it; nothing where gas has no
/// solid above it. Then it is nowhere wider than above, and no film shuts it.
std::optional<std::array<int, 2>> overhung_heights(const Band& band, const OpenGas& gas) {
  std::array<int, 2> heights{std::numeric_limits<int>::max(), std::numeric_limits<int>::min()};
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    const Leaf& leaf = band.leaves()[n];
    for (int offset = 0; offset < leaf_size; ++offset) {
      if (!gas.is_open(n, offset)) continue;
      const Node node = node_at(leaf, offset);
      heights[0] = std::min(heights[0], node[2]);
      if (band.node(node[0], node[1], node[2] + 1) < 0) heights[1] = std::max(heights[1], node[2]);
    }
  }
  if (heights[0] > heights[1]) return std::nullopt;
  return heights;
}

/// What lies below overhangs.
std::optional<NodeBox> overhung_nodes(const Band& band, const OpenGas& gas) {
  const auto heights = overhung_heights(band, gas);
  if (!heights) return std::nullopt;
  return NodeBox{.count = {band.node_count(0), band.node_count(1)},
                 .lowest = (*heights)[0],
                 .highest = (*heights)[1] + 1};
}

/// See shutting_thicknesses(). distance: of a node from the surface that open gas sees, > 0 in that
/// gas.
template <class Distance>
std::vector<double> shutting_thicknesses(const Layers& layers, const NodeBox& box,
                                         const Distance& distance, double thickness) {
  const Band& band = layers.top().band();
  std::vector<float> clearance(box.size());
  const auto columns =
      static_cast<std::size_t>(box.count[0]) * static_cast<std::size_t>(box.count[1]);
  parallel_for(columns, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t column = begin; column < end; ++column) {
      const int i = static_cast<int>(column) / box.count[1];
      const int j = static_cast<int>(column) % box.count[1];
      for (int k = box.lowest; k <= box.highest; ++k)
        clearance[box.index(i, j, k)] = static_cast<float>(std::max(0.0, distance({i, j, k})));
    }
  });
  return shutting_thicknesses(
      box, std::move(clearance), [&](int axis, int index) { return band.fold(axis, index); },
      thickness, layers.frame.spacing);
}

}  // namespace

double highest_point(const Layers& layers) {
  return bounding_box(extract_surface(layers, open_gas(layers))).upper.z;
}

void planarise(Layers& layers, double height) {
  // The surface, which takes long, is not needed where no node near it is as high.
  if (height >= layers.top().upper() || height >= highest_point(layers)) return;
  const double margin = LevelSet::half_width * layers.frame.spacing;
  const LevelSet plane(
      layers.frame, [height](Vec3d r) { return r.z - height; }, height - margin, height + margin);
  for (Layer& layer : layers.stack) {
    cut(layer.phi, plane);
  }
  redistance_fully(layers.top().band());
  cut_lower_layers(layers);
}

NecksLeftOut coat(Layers& layers, double thickness, std::size_t most_nodes) {
  SCARP_ASSERT(thickness, >, 0.0);
  const OpenGas gas = open_gas(layers);
  const Band& band = layers.top().band();
  const double spacing = layers.frame.spacing;
  const bool is_thin = thickness <= spacing;
  std::optional<OpenDistance> distance;
  if (!is_thin) distance.emplace(layers, gas, thickness);
  const auto coat_by = [&](double part) {
    if (is_thin) return coat_thinly(layers.top().band(), gas, static_cast<float>(part / spacing));
    coat_freely(layers, gas, *distance, part);
  };

  NecksLeftOut left_out;
  std::vector<double> shut;
  const auto box = thickness > least_cut_off * spacing ? overhung_nodes(band, gas) : std::nullopt;
  if (box && box->size() > most_nodes) {
    left_out = {.node_count = box->size(),
                .lowest = layers.frame.node_position({0, 0, box->lowest}).z,
                .highest = layers.frame.node_position({0, 0, box->highest}).z};
  } else if (box && is_thin) {
    shut = shutting_thicknesses(
        layers, *box,
        [&](const Node& node) {
          const bool is_open = is_open_gas(band, gas, node);
          return is_open ? spacing * double{band.node(node[0], node[1], node[2])} : 0;
        },
        thickness);
  } else if (box) {
    shut = shutting_thicknesses(
        layers, *box,
        [&](const Node& node) { return (*distance)(layers.frame.node_position(node)); }, thickness);
  }
  if (shut.empty()) {
    coat_by(thickness);
    return left_out;
  }
  // What is cut off is a void from then on. Thicknesses next to each other are those of one neck.
  constexpr double one_neck = 0.5;       // spacings
  constexpr double beyond = 1.0 / 1024;  // so that no node of the neck is left on the surface
  const double last = *std::prev(std::ranges::upper_bound(shut, shut.front() + one_neck * spacing));
  const double first = std::min(last + beyond * spacing, 0.5 * (last + thickness));
  coat_by(first);
  return coat(layers, thickness - first, most_nodes);
}

double highest_point(const Layers& layers, MaterialId material) {
  double highest = -infinity;
  for (std::size_t k = 0; k < layers.stack.size(); ++k) {
    if (layers.stack[k].material != material) {
      continue;
    }
    for (const Vec3f& vertex : extract_surface(layers.stack[k].phi).vertices) {
      const Vec3d r(vertex);
      const bool is_there =
          k == 0 || layers.stack[k - 1].phi.distance(r) - layers.stack[k].phi.distance(r) >
                        same_phi * layers.frame.spacing;
      highest = is_there ? std::max(highest, r.z) : highest;
    }
  }
  return highest;
}

}  // namespace scarp
