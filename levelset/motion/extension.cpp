#include "levelset/motion/extension.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "core/smooth_edge.h"
#include "core/vector_kernel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/images.h"
#include "levelset/grid/symmetry.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 8;

/// Below this slope the gradient of phi does not tell which side a node belongs to.
constexpr double least_gradient = 0.5;

/// Of an edge of the surface both sides tell a node their speed, if they are as near but for this.
/// Masks are often drawn along the nodes: there shapes lie .001 beside them. Spacings.
constexpr double edge_room = 0.002;
void take_closer(const ClosestPoint& candidate, ClosestPoint& best) {
  if (candidate.found() &&
      (candidate.distance < best.distance ||
       (candidate.distance == best.distance && candidate.triangle < best.triangle))) {
    best = candidate;
  }
}

/// The larger of two speeds in magnitude; of equal ones the one that etches.
float faster(float a, float b) {
  if (a == no_value || std::abs(b) > std::abs(a)) return b;
  return std::abs(a) > std::abs(b) ? a : std::min(a, b);
}

/// Nodes in solid that does not move, and in solid that moves, where there is some of both.
///
/// What does not move tells solid that moves nothing: under the edge of a mask the surface that
/// arrives is that beside the mask, even if the mask's own is nearer or as near.
class SolidNodes {
 public:
  SolidNodes(const Layers& layers, const std::vector<bool>& is_inert) {
    const bool both = std::find(is_inert.begin(), is_inert.end(), true) != is_inert.end() &&
                      std::find(is_inert.begin(), is_inert.end(), false) != is_inert.end();
    if (!both) return;
    const std::span<const Leaf> leaves = layers.top().band().leaves();
    standing_.resize(leaves.size());
    moving_.resize(leaves.size());
    parallel_for(leaves.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        for (int node = 0; node < leaf_size; ++node) {
          if (!(leaves[n].phi[node] < 0)) continue;
          const auto layer = layer_at(layers, node_at(leaves[n], node));
          LeafMask& nodes = is_inert[layer] ? standing_[n] : moving_[n];
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

}  // namespace

/// What a node asks the facets: for the closest one within the limit.
struct Extension::Question {
  Vec3d r;
  Vec3d gradient;  ///< which way the facet has to face
  double limit;
  Images images;

  /// On a ridge of phi, midway between two surfaces, the gradient says nothing.
  bool has_direction() const { return length(gradient) > least_gradient; }
};

Vec3d central_gradient(const float* p) {
  return {0.5 * (static_cast<double>(p[Block::x_stride]) - p[-Block::x_stride]),
          0.5 * (static_cast<double>(p[Block::y_stride]) - p[-Block::y_stride]),
          0.5 * (static_cast<double>(p[1]) - p[-1])};
}

double Extension::reach_of(const ClosestPoint& point) const {
  return 1.000001 * point.distance + edge_room * frame_.spacing;
}

Extension::Question Extension::question(const NearNode& at) const {
  const Vec3d r = frame_.in_section(frame_.node_position(at.index));
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
    if (is_open_gas(band_, gas_, other)) return false;
  }
  return any_gas;
}

void Extension::query_leaf(std::size_t n, Block& block, std::vector<std::vector<float>>& fields) {
  const Leaf& leaf = band_.leaves()[n];
  gather<1>(
      band_, n, [&](std::size_t m) -> const float* { return band_.leaves()[m].phi; }, block);
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
    // Both rows of a section have the same, however ties fall.
    if (at.index[1] >= frame_.own_nodes(1)) {
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
    box.add(frame_.in_section(frame_.node_position(node_at(leaf, node))));
    largest = std::max(largest, std::abs(leaf.phi[node]));
  });
  return tree_.neighbourhood(box, limit(largest));
}

std::vector<std::vector<float>> Extension::run(std::size_t value_count,
                                               const std::vector<bool>& is_inert,
                                               bool still_within) {
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
  const SolidNodes solid(layers_, is_inert);
  for (std::vector<float>& field : fields) {
    if (solid.any_standing()) {
      room_.resize(band_.leaves().size());
      const std::span<float> past_standing(room_[0], field.size());
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

}  // namespace scarp
