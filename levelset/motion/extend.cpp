#include "levelset/motion/extend.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/smooth_edge.h"
#include "core/triangle_tree.h"
#include "core/vector_kernel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/images.h"
#include "levelset/grid/stencil.h"
#include "levelset/grid/symmetry.h"
#include "levelset/motion/contact_line.h"
#include "levelset/motion/overgrowth.h"
#include "levelset/motion/standstill.h"
#include "levelset/surface/facet_shares.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 8;

/// Below this slope the gradient of phi does not tell which side a node belongs to.
constexpr double least_gradient = 0.5;

/// Of an edge of the surface both sides tell a node their speed, if they are as near but for this.
/// Masks are often drawn along the nodes: there shapes lie .001 beside them. Spacings.
constexpr double edge_room = 0.002;

/// A node next to the surface.
struct NearNode {
  std::size_t leaf;
  int node;                  ///< offset in the leaf
  std::array<int, 3> index;  ///< of the grid
  const float* phi;          ///< in a Block
};

/// What a node asks the facets: for the closest one within the limit.
struct Question {
  Vec3d r;
  Vec3d gradient;  ///< which way the facet has to face
  double limit;
  Images images;

  /// On a ridge of phi, midway between two surfaces, the gradient says nothing.
  bool has_direction() const { return length(gradient) > least_gradient; }
};

class Extension {
 public:
  /// values_at(node, facets, values) is asked at nodes next to the surface.
  using ValuesAt = std::function<void(const NearNode&, std::span<const FacetShare> facets,
                                      std::span<float> values)>;

  /// distance: of facets from the surface. A surface further from a node than phi says by more than
  /// that is not its own.
  Extension(const Layers& layers, const OpenGas& gas, FacetTree& facets, double distance,
            ValuesAt values_at)
      : layers_(layers),
        frame_(layers.frame),
        band_(layers.top().band()),
        gas_(gas),
        facets_(facets.facets),
        tree_(*facets.tree),
        is_creased_(facets.is_creased),
        kept_(facets.kept),
        distance_(distance),
        values_at_(std::move(values_at)) {}

  /// Shape: 512 per leaf, of each of the given number of values; stands_still one per layer, or
  ///        empty. With still_within nodes in solid that stands still have values of 0.
  std::vector<std::vector<float>> run(std::size_t value_count,
                                      const std::vector<bool>& stands_still = {},
                                      bool still_within = false) const;

 private:
  void query_leaf(std::size_t n, Block& block, std::vector<std::vector<float>>& fields) const;
  TriangleTree::Neighbourhood neighbourhood(const Leaf& leaf, const LeafMask& nodes) const;
  double limit(float phi) const {
    // A node next to the surface has a vertex on one of its edges, whatever corners facets cut off.
    return std::max(std::abs(phi), 0.5F) * frame_.spacing + distance_;
  }
  Question question(const NearNode& at) const;
  ClosestPoint kept_answer(const Question& asked, std::uint32_t kept) const;
  ClosestPoint search(const Question& asked, const TriangleTree::Neighbourhood& near,
                      std::uint32_t guess, TriangleTree::Others& others) const;
  ClosestPoint search_all_around(const Question& asked,
                                 const TriangleTree::Neighbourhood& near) const;
  /// What is further away than that does not count beside it.
  double reach_of(const ClosestPoint& point) const {
    return 1.000001 * point.distance + edge_room * frame_.spacing;
  }
  bool is_void(const NearNode& at) const;

  const Layers& layers_;
  const Frame& frame_;
  const Band& band_;
  const OpenGas& gas_;
  const TriMesh& facets_;
  const TriangleTree& tree_;
  const std::vector<bool>& is_creased_;
  KeptFacets& kept_;
  double distance_;
  ValuesAt values_at_;
};

Vec3d central_gradient(const float* p) {
  return {0.5 * (static_cast<double>(p[Block::x_stride]) - p[-Block::x_stride]),
          0.5 * (static_cast<double>(p[Block::y_stride]) - p[-Block::y_stride]),
          0.5 * (static_cast<double>(p[1]) - p[-1])};
}

void take_closer(const ClosestPoint& candidate, ClosestPoint& best) {
  if (candidate.found() &&
      (candidate.distance < best.distance ||
       (candidate.distance == best.distance && candidate.triangle < best.triangle))) {
    best = candidate;
  }
}

Question Extension::question(const NearNode& at) const {
  // In two dimensions both rows of nodes ask at the same point.
  const Vec3d r{frame_.node_position(0, at.index[0]),
                frame_.two_dimensional ? 0.0 : frame_.node_position(1, at.index[1]),
                frame_.node_position(2, at.index[2])};
  const double within = limit(*at.phi);
  return {.r = r,
          .gradient = central_gradient(at.phi),
          .limit = within,
          .images = images_of(frame_, r, within)};
}

/// What a search would find, if that is known without one.
ClosestPoint Extension::kept_answer(const Question& asked, std::uint32_t kept) const {
  if (kept == ClosestPoint::none || !asked.has_direction()) return {};
  const std::array<Vec3d, 3> triangle = corners(facets_, kept);
  if (!(dot(cross(triangle[1] - triangle[0], triangle[2] - triangle[0]), asked.gradient) > 0))
    return {};
  ClosestPoint point = closest_on_triangle(asked.r, triangle);
  if (!(point.distance <= asked.limit)) return {};
  point.triangle = kept;
  return point;
}

/// Asks at the node and, near periodic sides, at its images. Others matter at creases alone, and
/// where an image may find them.
ClosestPoint Extension::search(const Question& asked, const TriangleTree::Neighbourhood& near,
                               std::uint32_t guess, TriangleTree::Others& others) const {
  if (!asked.has_direction()) return search_all_around(asked, near);
  ClosestPoint best = tree_.closest_facing(asked.r, asked.gradient, asked.limit, near, guess);
  const bool has_images = asked.images.reach(std::min(asked.limit, reach_of(best)));
  if (has_images || (best.found() && is_creased_[best.triangle])) {
    best = tree_.closest_facing(asked.r, asked.gradient, asked.limit, near, best.triangle, &others);
  }
  for (const Image& image : asked.images) {
    const double within = std::min(asked.limit, reach_of(best));
    if (image.beyond > within) continue;
    const ClosestPoint found = tree_.closest_facing(image.r, asked.gradient, within, others);
    const ClosestPoint before = best;
    take_closer(found, best);
    const ClosestPoint& other = best.triangle == before.triangle ? found : before;
    if (other.found()) others.points.push_back(other);
  }
  best.is_alone = best.is_alone && !has_images;
  return best;
}

/// Of whichever way a facet faces.
ClosestPoint Extension::search_all_around(const Question& asked,
                                          const TriangleTree::Neighbourhood& near) const {
  ClosestPoint best = tree_.closest(asked.r, asked.limit, near);
  for (const Image& image : asked.images)
    take_closer(tree_.closest(image.r, std::min(asked.limit, reach_of(best))), best);
  return best;
}

/// Gas of a void; or solid all of whose gas neighbours belong to voids.
bool Extension::is_void(const NearNode& at) const {
  if (!(*at.phi < 0)) {
    return !gas_.is_open(at.leaf, at.node);
  }
  bool any_gas = false;
  for (int face = 0; face < 6; ++face) {
    std::array<int, 3> other = at.index;
    other[face / 2] += face % 2 == 0 ? -1 : 1;
    const std::ptrdiff_t stride = axis_strides[face / 2];
    if (at.phi[face % 2 == 0 ? -stride : stride] < 0) {
      continue;
    }
    any_gas = true;
    const auto [leaf, offset] = band_.place(other);
    if (gas_.is_open(static_cast<std::size_t>(leaf), offset)) {
      return false;
    }
  }
  return any_gas;
}

void Extension::query_leaf(std::size_t n, Block& block,
                           std::vector<std::vector<float>>& fields) const {
  const Leaf& leaf = band_.leaves()[n];
  gather<1>(
      band_, n, [&](std::size_t m) { return band_.leaves()[m].phi; }, block);
  const LeafMask nodes = next_to_surface(leaf, block);
  if (nodes == LeafMask{}) {
    return;
  }
  const std::span<std::uint32_t> kept = kept_.of_leaf(n);
  std::optional<TriangleTree::Neighbourhood> near;
  std::uint32_t last = ClosestPoint::none;
  std::vector<float> values(fields.size());
  TriangleTree::Others others{.room = edge_room * frame_.spacing, .cosine = smooth_cosine};
  std::vector<FacetShare> shares;
  for_each_node(nodes, [&](int node) {
    const int i = node >> 6;
    const int j = (node >> 3) & 7;
    const int k = node & 7;
    const NearNode at{.leaf = n,
                      .node = node,
                      .index = {leaf.origin[0] + i, leaf.origin[1] + j, leaf.origin[2] + k},
                      .phi = block.row(i, j) + k};
    // Of what lies beyond the diagonal there are no facets.
    if (frame_.diagonal && at.index[1] > at.index[0]) return;
    // In two dimensions both rows have the same, however ties fall.
    if (frame_.two_dimensional && j == 1) {
      const std::size_t to = n * leaf_size + static_cast<std::size_t>(node);
      for (std::vector<float>& field : fields) field[to] = field[to - leaf_edge];
      return;
    }
    std::fill(values.begin(), values.end(), 0.0F);
    if (!is_void(at)) {
      const Question asked = question(at);
      std::uint32_t& known = kept[static_cast<std::size_t>(node)];
      others.points.clear();
      ClosestPoint point = kept_answer(asked, known);
      if (!point.found()) {
        if (!near) near = neighbourhood(leaf, nodes);
        point = search(asked, *near, last, others);
        known = point.is_alone ? point.triangle : ClosestPoint::none;
      }
      if (point.found()) {
        last = point.triangle;
        shares.assign(1, {.point = point});
        for (const ClosestPoint& each : others.points) shares.push_back({.point = each});
        if (shares.size() > 1) share_out(facets_, asked.gradient, others.room, shares);
        values_at_(at, shares, values);
      }
    }
    for (std::size_t v = 0; v < values.size(); ++v) {
      fields[v][n * leaf_size + static_cast<std::size_t>(node)] = values[v];
    }
  });
}

/// Of some nodes of a leaf.
TriangleTree::Neighbourhood Extension::neighbourhood(const Leaf& leaf,
                                                     const LeafMask& nodes) const {
  Box box;
  float largest = 0;
  for_each_node(nodes, [&](int node) {
    const Vec3d r = frame_.node_position(node_at(leaf, node));
    box.add({r.x, frame_.two_dimensional ? 0.0 : r.y, r.z});
    largest = std::max(largest, std::abs(leaf.phi[node]));
  });
  return tree_.neighbourhood(box, limit(largest));
}

/// The larger of two speeds in magnitude; of equal ones the one that etches.
float faster(float a, float b) {
  if (a == no_value || std::abs(b) > std::abs(a)) return b;
  return std::abs(a) > std::abs(b) ? a : std::min(a, b);
}

/// Nodes in solid that stands still, and in solid that moves, where there is some of both.
///
/// What stands still tells solid that moves nothing: under the edge of a mask the surface that
/// arrives is that beside the mask, even if the mask's own is nearer or as near.
class SolidNodes {
 public:
  SolidNodes(const Layers& layers, const std::vector<bool>& stands_still) {
    const bool both =
        std::find(stands_still.begin(), stands_still.end(), true) != stands_still.end() &&
        std::find(stands_still.begin(), stands_still.end(), false) != stands_still.end();
    if (!both) return;
    const std::vector<Leaf>& leaves = layers.top().band().leaves();
    standing_.resize(leaves.size());
    moving_.resize(leaves.size());
    parallel_for(leaves.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        for (int node = 0; node < leaf_size; ++node) {
          if (!(leaves[n].phi[node] < 0)) continue;
          const auto layer = layer_at(layers, node_at(leaves[n], node));
          LeafMask& nodes = stands_still[layer] ? standing_[n] : moving_[n];
          nodes[node >> 6] |= std::uint64_t{1} << (node & 63);
        }
      }
    });
  }

  bool any_standing() const { return !standing_.empty(); }

  void set_standing(std::span<float> field, float value) const {
    for_each_of(standing_, [&](std::size_t at) { field[at] = value; });
  }

  void take_moving(std::span<const float> from, std::span<float> field) const {
    for_each_of(moving_, [&](std::size_t at) { field[at] = from[at]; });
  }

 private:
  template <class Visit>
  static void for_each_of(const std::vector<LeafMask>& nodes, const Visit& visit) {
    parallel_for(nodes.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        for_each_node(nodes[n],
                      [&](int node) { visit(n * leaf_size + static_cast<std::size_t>(node)); });
      }
    });
  }

  std::vector<LeafMask> standing_;
  std::vector<LeafMask> moving_;
};

/// The fastest speed of the neighbours that are as near to the surface as a node.
float speed_as_near(const float* phi, const float* speed) {
  float as_near = no_value;
  for (const std::ptrdiff_t stride : axis_strides) {
    for (const std::ptrdiff_t to : {-stride, stride}) {
      if (phi[to] == *phi && speed[to] != no_value) as_near = faster(as_near, speed[to]);
    }
  }
  return as_near;
}

/// Adds a neighbour's speed on an axis to a mean: that of the nearer one to the surface, if any is
/// nearer, and the mean of two that are as near.
SCARP_KERNEL_PART void add_upwind(const float* phi, const float* speed, std::ptrdiff_t stride,
                                  double& weights, double& sum) {
  // Without branches: which neighbours count is as good as random.
  const float before = std::abs(phi[-stride]);
  const float behind = std::abs(phi[stride]);
  const float nearer = larger(std::abs(*phi) - smaller(before, behind), 0);
  const bool takes_before = (before <= behind) & (speed[-stride] != no_value);
  const bool takes_behind = (behind <= before) & (speed[stride] != no_value);
  const double taken = static_cast<double>(select(takes_before, speed[-stride], 0.0F)) +
                       static_cast<double>(select(takes_behind, speed[stride], 0.0F));
  const double weight = select(takes_before | takes_behind, nearer, 0.0F);
  weights += weight;
  sum += weight * (select(takes_before & takes_behind, 0.5F, 1.0F) * taken);
}

/// The speeds of a row of nodes from their neighbours nearer to the surface: grad V . grad phi = 0,
/// upwind. Of two on an axis that are as near it takes the mean, the same for its mirror image;
/// no_value where none is nearer.
SCARP_VECTOR_KERNEL void carry_row(const float* phi, const float* speed, float* carried) {
  for (int k = 0; k < leaf_edge; ++k) {
    double weights = 0;
    double sum = 0;
    add_upwind(phi + k, speed + k, axis_strides[0], weights, sum);
    add_upwind(phi + k, speed + k, axis_strides[1], weights, sum);
    add_upwind(phi + k, speed + k, axis_strides[2], weights, sum);
    carried[k] = select(weights > 0, static_cast<float>(sum / weights), no_value);
  }
}

/// Where no neighbour is nearer to the surface, at an edge of it, the fastest of those that are as
/// near.
void carried_speeds(const float* phi, const float* speed, unsigned asked, float* carried) {
  carry_row(phi, speed, carried);
  for_each_of_row(asked, [&](int k) {
    if (carried[k] == no_value) carried[k] = speed_as_near(phi + k, speed + k);
  });
}

std::vector<std::vector<float>> Extension::run(std::size_t value_count,
                                               const std::vector<bool>& stands_still,
                                               bool still_within) const {
  std::vector<std::vector<float>> fields(value_count);
  for (std::vector<float>& field : fields) {
    field.assign(band_.leaves().size() * leaf_size, no_value);
  }
  kept_.prepare(band_);
  parallel_for(band_.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    Block block;
    for (std::size_t n = begin; n < end; ++n) {
      query_leaf(n, block, fields);
    }
  });
  if (frame_.diagonal)
    for (std::vector<float>& field : fields) mirror_across_diagonal(band_, field);
  const SolidNodes solid(layers_, stands_still);
  for (std::vector<float>& field : fields) {
    if (solid.any_standing()) {
      const std::span<float> past_standing(band_.scratch(0)[0], field.size());
      std::copy(field.begin(), field.end(), past_standing.begin());
      solid.set_standing(past_standing, no_value);
      carry_outward(band_, past_standing, carried_speeds);
      carry_outward(band_, field, carried_speeds);
      solid.take_moving(past_standing, field);
    } else {
      carry_outward(band_, field, carried_speeds);
    }
    // What no surface reaches does not move.
    std::replace(field.begin(), field.end(), no_value, 0.0F);
    if (still_within) solid.set_standing(field, 0.0F);
  }
  return fields;
}

}  // namespace

namespace {

float speed_on(std::span<const std::array<float, 3>> speeds, std::span<const FacetShare> facets) {
  double speed = 0;
  for (const FacetShare& each : facets) {
    const std::array<float, 3>& corners = speeds[each.point.triangle];
    double on_facet = 0;
    for (std::size_t c = 0; c < 3; ++c) on_facet += each.point.barycentric[c] * corners[c];
    speed += each.share * on_facet;
  }
  return static_cast<float>(speed);
}

/// The side of an edge that the surface follows there, as a share of all.
std::optional<FacetShare> leading_share(const TriMesh& facets, std::span<const FacetShare> sides,
                                        std::span<const std::array<float, 3>> speeds) {
  if (sides.size() == 1) return std::nullopt;
  std::vector<float> of_sides;
  for (const FacetShare& side : sides) {
    const FacetShare alone{.point = side.point};
    of_sides.push_back(speed_on(speeds, {&alone, 1}));
  }
  const auto leading = leading_side(facets, sides, of_sides);
  if (!leading) return std::nullopt;
  return FacetShare{.point = sides[*leading].point};
}

/// The speed that a layer has at a node next to the surface: with factors of the normal at that of
/// phi, which does not hang on how facets lie there.
class SpeedAt {
 public:
  SpeedAt(const NearNode& at, std::span<const FacetShare> facets,
          std::span<const AngularFactor> factors)
      : facets_(facets), factors_(factors) {
    if (factors.empty()) return;
    const Vec3d gradient = central_gradient(at.phi);
    normal_ = Vec3f(length(gradient) > 0 ? normalized(gradient) : Vec3d{0, 0, 1});
  }

  float of(const LayerSpeeds& layer) const { return of(layer, normal_); }

  float of(const LayerSpeeds& layer, const Vec3f& normal) const {
    if (factors_.empty()) return speed_on(layer.speed, facets_);
    float speed = part(layer, 0, normal);
    for (std::size_t k = 1; k <= factors_.size(); ++k) speed += part(layer, k, normal);
    return speed;
  }

  /// Whether the parts of a speed that of() gave take each other away, but for a tenth.
  bool cancels(const LayerSpeeds& layer, float speed) const {
    float gross = 0;
    for (std::size_t k = 0; k <= factors_.size(); ++k) gross += std::abs(part(layer, k, normal_));
    return std::abs(speed) < 0.1F * gross;
  }

 private:
  // The isotropic one, and then that of each factor.
  float part(const LayerSpeeds& layer, std::size_t k, const Vec3f& normal) const {
    const float amplitude = speed_on(layer.parts[k], facets_);
    return k == 0 ? amplitude : factors_[k - 1].value(normal) * amplitude;
  }

  std::span<const FacetShare> facets_;
  std::span<const AngularFactor> factors_;
  Vec3f normal_;
};

/// The mean over dt of the speed at a node, from layer to layer.
float mean_speed(const Layers& layers, std::span<const LayerSpeeds> speeds_of_layers,
                 const NearNode& at, std::size_t seen, float speed, const SpeedAt& speed_at,
                 double dt) {
  if (speed >= 0 || seen == 0) return speed;
  std::vector<float> speeds;
  for (std::size_t layer = 0; layer <= seen; ++layer)
    speeds.push_back(speed_at.of(speeds_of_layers[layer]));
  std::vector<float> depth;
  find_depths(layers, surface_point(layers, at.leaf, at.node), depth);
  return speed_through_layers(speeds, depth, seen, static_cast<float>(dt));
}

/// Whether no part of a speed takes anything away.
bool only_grow(std::span<const LayerSpeeds> speeds_of_layers) {
  const auto grows = [](const CornerSpeeds& speeds) {
    return std::all_of(speeds.begin(), speeds.end(), [](const std::array<float, 3>& corners) {
      return *std::min_element(corners.begin(), corners.end()) >= 0;
    });
  };
  return std::all_of(speeds_of_layers.begin(), speeds_of_layers.end(), [&](const LayerSpeeds& of) {
    return std::all_of(of.parts.begin(), of.parts.end(), grows);
  });
}

/// A node belongs to what grows or to what stands still, by the last field, never to both.
void part_from_standing(std::vector<std::vector<float>>& fields) {
  constexpr float half = 0.5F;
  const std::vector<float>& grows = fields.back();
  parallel_for(grows.size(), grain * leaf_size, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at) {
      const float scale = grows[at] < half ? 0 : 1 / grows[at];
      for (std::size_t v = 0; v + 1 < fields.size(); ++v) fields[v][at] *= scale;
    }
  });
}

/// Lets what grows by its normal pass over what stands still: a speed without a normal, where it
/// has none of its own.
void pass_standing(const Layers& layers, const std::vector<bool>& stands_still, double dt,
                   const std::vector<float>& whole, std::vector<float>& speed) {
  std::vector<float> passing = whole;
  overgrow(layers, stands_still, dt, passing);
  for (std::size_t at = 0; at < passing.size(); ++at) {
    if (passing[at] != whole[at]) speed[at] = passing[at];
  }
}

/// No facet recedes faster, whatever its normal.
float fastest_etch_of(const LayerSpeeds& speeds, const LimitingSpeed& limiting_speed) {
  const bool has_factors = !speeds.parts.empty();
  const CornerSpeeds& isotropic = has_factors ? speeds.parts.front() : speeds.speed;
  return parallel_reduce(
      isotropic.size(), 1024, 0.0F,
      [&](std::size_t begin, std::size_t end) {
        float fastest = 0;
        for (std::size_t f = begin; f < end; ++f) {
          for (std::size_t c = 0; c < 3; ++c) {
            const auto amplitude = [&](std::size_t k) { return speeds.parts[1 + k][f][c]; };
            const float speed =
                has_factors ? -limiting_speed(isotropic[f][c], amplitude) : isotropic[f][c];
            fastest = std::max(fastest, fastest_etch(speed));
          }
        }
        return fastest;
      },
      [](float a, float b) { return std::max(a, b); });
}

bool is_zero(const CornerSpeeds& speeds) {
  return std::all_of(speeds.begin(), speeds.end(), [](const std::array<float, 3>& corners) {
    return corners == std::array<float, 3>{0, 0, 0};
  });
}

}  // namespace

SpeedField extend_speeds(const Layers& layers, const OpenGas& gas, const TriMesh& facets,
                         std::span<const std::array<float, 3>> corner_speeds) {
  SCARP_ASSERT(facets.triangles.size(), ==, corner_speeds.size());
  const auto speed_at = [&](const NearNode&, std::span<const FacetShare> shares,
                            std::span<float> values) {
    const std::optional<FacetShare> leading = leading_share(facets, shares, corner_speeds);
    values[0] = speed_on(corner_speeds, leading ? std::span(&*leading, 1) : shares);
  };
  SpeedField field;
  field.closed = closed_nodes(layers, gas);
  const double distance = close_facets * layers.frame.spacing;
  FacetTree tree(facets);
  field.speed = std::move(Extension(layers, gas, tree, distance, speed_at).run(1).front());
  update_max_speed(layers, field);
  return field;
}

SpeedField extend_speeds(const Layers& layers, const OpenGas& gas, const TriMesh& facets,
                         std::span<const CornerSpeeds> speeds_of_layers, double dt) {
  std::vector<LayerSpeeds> parts;
  for (const CornerSpeeds& speeds : speeds_of_layers) {
    parts.push_back({.speed = speeds});
  }
  FacetTree tree(facets);
  return extend_speeds(layers, gas, tree, parts, {}, dt, close_facets * layers.frame.spacing);
}

SpeedField extend_speeds(const Layers& layers, const OpenGas& gas, FacetTree& facets,
                         std::span<const LayerSpeeds> speeds_of_layers,
                         std::span<const AngularFactor> factors, double dt, double distance) {
  SCARP_ASSERT(speeds_of_layers.size(), ==, layers.stack.size());
  SpeedField field;
  field.closed = closed_nodes(layers, gas);
  std::atomic<std::size_t> nodes = 0;
  std::atomic<std::size_t> newly_seen = 0;
  const auto values_at = [&](const NearNode& at, std::span<const FacetShare> shares,
                             std::span<float> values) {
    std::size_t seen = exposed_layer_next_to(layers, at.index, at.phi);
    // A film that meets a wall is seen from within, even if the wall is as near.
    if (field.grows_beside_standing && field.stands_still[seen] && *at.phi < 0) {
      seen = layer_at(layers, at.index);
    }
    nodes.fetch_add(1, std::memory_order_relaxed);
    const std::uint32_t facet = shares.front().point.triangle;
    if (!facets.facets.materials.empty() &&
        layers.stack[seen].material != facets.facets.materials[facet])
      newly_seen.fetch_add(1, std::memory_order_relaxed);
    const LayerSpeeds& of_seen = speeds_of_layers[seen];
    const std::optional<FacetShare> leading = leading_share(facets.facets, shares, of_seen.speed);
    if (leading) shares = {&*leading, 1};
    const SpeedAt speed_at(at, shares, factors);
    const float speed = speed_at.of(of_seen);
    const float mean = mean_speed(layers, speeds_of_layers, at, seen, speed, speed_at, dt);
    if (factors.empty()) {
      values[0] = mean;
      return;
    }
    if (!field.grows_beside_standing) {
      // The normal of phi at the node knows of the wall.
      const Vec3d normal = normalized(area_vector(facets.facets, facet));
      const auto at_line = speed_at_contact_line(
          layers, at.index, seen, normal, [&](std::size_t layer, const Vec3d& n) {
            return speed_at.of(speeds_of_layers[layer], Vec3f(n));
          });
      if (at_line) {
        values[0] = *at_line;
        return;
      }
    }
    // With parts that nearly cancel the least error of the normal would be scaled, too.
    const bool adds = mean != speed && speed_at.cancels(of_seen, speed);
    const float scale = adds || speed == 0 ? 1.0F : mean / speed;
    for (std::size_t v = 0; v <= factors.size(); ++v) {
      values[v] = scale * speed_on(of_seen.parts[v], shares);
    }
    if (adds) values[0] += mean - speed;
    if (field.grows_beside_standing) {
      values[1 + factors.size()] = mean;
      values[2 + factors.size()] = field.stands_still[seen] ? 0 : 1;
    }
  };
  const LimitingSpeed limiting_speed(factors);
  for (const LayerSpeeds& layer : speeds_of_layers) {
    SCARP_ASSERT(facets.facets.triangles.size(), ==, layer.speed.size());
    SCARP_ASSERT(layer.parts.size(), ==, factors.empty() ? 0 : 1 + factors.size());
    field.stands_still.push_back(is_zero(layer.speed) &&
                                 std::all_of(layer.parts.begin(), layer.parts.end(), is_zero));
    field.fastest_etch.push_back(fastest_etch_of(layer, limiting_speed));
  }
  field.grows_beside_standing =
      !factors.empty() && has_standing_layers(field) && only_grow(speeds_of_layers);
  // Then the last ones are the whole speed, and how much of it is that of what grows.
  const std::size_t count = 1 + factors.size() + (field.grows_beside_standing ? 2 : 0);
  auto fields = Extension(layers, gas, facets, distance, values_at)
                    .run(count, field.stands_still, field.grows_beside_standing);
  field.newly_seen = nodes == 0 ? 0 : static_cast<double>(newly_seen) / static_cast<double>(nodes);
  if (field.grows_beside_standing) {
    part_from_standing(fields);
    pass_standing(layers, field.stands_still, dt, fields[1 + factors.size()], fields[0]);
  }
  field.speed = std::move(fields[0]);
  const bool grows =
      std::any_of(field.speed.begin(), field.speed.end(), [](float speed) { return speed > 0; });
  if (factors.empty() && grows && has_standing_layers(field)) {
    overgrow(layers, field.stands_still, dt, field.speed);
  }
  for (std::size_t part = 0; part < factors.size(); ++part) {
    field.angular.push_back({factors[part], std::move(fields[1 + part])});
  }
  update_max_speed(layers, field);
  return field;
}

double stable_time_step(const Layers& layers, std::span<const CornerSpeeds> speeds_of_layers,
                        double cfl) {
  std::vector<LayerSpeeds> parts;
  for (const CornerSpeeds& speeds : speeds_of_layers) {
    parts.push_back({.speed = speeds});
  }
  return stable_time_step(layers, parts, {}, cfl);
}

double stable_time_step(const Layers& layers, std::span<const LayerSpeeds> speeds_of_layers,
                        std::span<const AngularFactor> factors, double cfl) {
  const std::vector<bool> in_reach = layers_within(layers, 2);
  const LimitingSpeed limiting_speed(factors);
  float fastest = 0;
  for (std::size_t layer = 0; layer < speeds_of_layers.size(); ++layer) {
    if (!in_reach[layer]) {
      continue;
    }
    const LayerSpeeds& speeds = speeds_of_layers[layer];
    const CornerSpeeds& isotropic = factors.empty() ? speeds.speed : speeds.parts.front();
    for (std::size_t f = 0; f < isotropic.size(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto amplitude = [&](std::size_t k) { return speeds.parts[1 + k][f][c]; };
        fastest = std::max(fastest, limiting_speed(isotropic[f][c], amplitude));
      }
    }
  }
  return fastest > 0 ? cfl * layers.frame.spacing / static_cast<double>(fastest)
                     : std::numeric_limits<double>::infinity();
}

}  // namespace scarp
