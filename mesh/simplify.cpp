#include "mesh/simplify.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "mesh/collapse.h"
#include "mesh/curvature.h"
#include "mesh/placement.h"
#include "mesh/regions.h"
#include "mesh/zero_area.h"

namespace scarp {

namespace {

/// Part of the mean edge length by which a border between materials may be cut short, where there
/// is no max_error.
constexpr double default_border_error = 0.1;

/// Defaults of `paper`, in mean edge lengths of the features (.78 spacings in marching cubes).
constexpr double default_l0 = 0.75;
constexpr double default_step_length = 2.5;

/// How much a target that is out of reach raises l0 at a time.
constexpr double raise_factor = 1.25;

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// Edges by what their collapse costs, or the shortest first.
template <bool ByCost>
struct PlainOrder {
  static constexpr bool by_cost = ByCost;
  double size = unlimited;
  std::vector<float> size_limit;

  bool wanted(const CollapseMesh& mesh, std::uint32_t h, double squared_length) const {
    double limit = size;
    if (!size_limit.empty()) {
      const float u = size_limit[mesh.topology.origin(h)];
      const float v = size_limit[mesh.topology.target(h)];
      limit = std::min({limit, double{u}, double{v}});
    }
    return squared_length < limit * limit;
  }
  double key(double cost, double squared_length) const { return ByCost ? cost : squared_length; }
  void merged(std::uint32_t u, std::uint32_t v) {
    if (!size_limit.empty()) size_limit[u] = std::min(size_limit[u], size_limit[v]);
  }
};

void check_length(const char* name, std::optional<double> value) {
  if (value && !(std::isfinite(*value) && *value >= 0)) {
    throw InputError(std::string("simplify: ") + name + ": " + std::to_string(*value) +
                     " is not a length; it has to be finite and not negative");
  }
}

void check(const TriMesh& mesh, const SimplifyOptions& options) {
  if (mesh.triangles.empty()) throw InputError("simplify: the mesh has no triangles");
  check_length("l0", options.l0);
  check_length("step_length", options.step_length);
  check_length("l_max", options.l_max);
  check_length("max_error", options.max_error);
  check_length("curvature_threshold", options.curvature_threshold);
  if (options.remove && !(*options.remove >= 0 && *options.remove < 1)) {
    throw InputError("simplify: remove: " + std::to_string(*options.remove) + " is outside [0, 1)");
  }
  const bool sized = options.method == SimplifyMethod::paper || options.l_max > 0 ||
                     (options.method == SimplifyMethod::length && options.l0);
  if (!sized && !options.remove && !options.vertices && !options.max_error) {
    throw InputError("simplify: nothing says where to stop; give remove, vertices or max_error");
  }
  if (!options.size_limit.empty()) {
    SCARP_ASSERT(options.size_limit.size(), ==, mesh.vertices.size());
  }
  if (!options.curvature.empty()) {
    SCARP_ASSERT(options.curvature.size(), ==, mesh.vertices.size());
  }
}

/// An array over the vertices of the input, for those of the half edges.
template <class T>
std::vector<T> with_copies(std::span<const float> values, const HalfEdges& topology) {
  std::vector<T> result(values.begin(), values.end());
  if (values.empty()) return result;
  for (const std::uint32_t v : topology.copies()) result.push_back(values[v]);
  return result;
}

std::uint32_t target_of(const SimplifyOptions& options, std::uint32_t live_vertices) {
  double target = 0;
  if (options.remove) target = std::ceil((1 - *options.remove) * live_vertices);
  if (options.vertices) target = std::max(target, static_cast<double>(*options.vertices));
  return static_cast<std::uint32_t>(std::min<double>(target, live_vertices));
}

std::vector<bool> features_of(const TriMesh& mesh, const CollapseMesh& work,
                              const SimplifyOptions& options, std::uint32_t target) {
  std::vector<double> curvature = with_copies<double>(options.curvature, work.topology);
  if (curvature.empty()) {
    curvature = smoothed(mean_curvature(mesh, work.topology, options.sides), work.topology);
  }
  const double threshold = options.curvature_threshold > 0
                               ? options.curvature_threshold
                               : feature_threshold(curvature, mesh, work.topology);
  return find_features(curvature, threshold, target > 0 ? target / 2 : curvature.size());
}

template <class Engine>
void run_paper(const TriMesh& mesh, const SimplifyOptions& options, CollapseMesh& work,
               Engine& engine, std::uint32_t target) {
  const std::vector<bool> is_feature = features_of(mesh, work, options, target);
  const double typical = mean_feature_edge(work, is_feature);
  const double l0 = options.l0.value_or(default_l0 * typical);
  const double l_max = options.l_max > 0 ? std::max(options.l_max, l0) : 0;
  RegionOrder order(is_feature, with_copies<float>(options.size_limit, work.topology),
                    {l0, options.step_length.value_or(default_step_length * typical), l_max});

  // Slivers everywhere, features down to l0.
  engine.run(order, target);

  // Ring after ring around the features, coarser with each.
  while (work.live_vertices > target && order.coarsen()) {
    engine.run(order, target);
    if (order.enclose_ring(work)) continue;
    order.release_rest();
    engine.run(order, target);
    break;
  }

  // A number of vertices that the sizes do not allow. Edges of any length are wanted in the end.
  const Box box = bounding_box(mesh);
  const double diameter = length(box.upper - box.lower);
  double size = l0 > 0 ? l0 : typical;
  while (target > 0 && work.live_vertices > target && size < diameter) {
    size *= raise_factor;
    order.raise(size);
    engine.run(order, target);
  }
}

template <class Placement>
void run(const TriMesh& mesh, const SimplifyOptions& options, CollapseMesh& work,
         CollapseChecks& checks, std::uint32_t target) {
  CollapseEngine<Placement> engine(work, checks);
  const std::vector<float> size_limit = with_copies<float>(options.size_limit, work.topology);
  const double l_max = options.l_max > 0 ? options.l_max : unlimited;
  if (options.method == SimplifyMethod::paper) {
    run_paper(mesh, options, work, engine, target);
  } else if (options.method == SimplifyMethod::lindstrom_turk) {
    PlainOrder<true> order{l_max, size_limit};
    engine.run(order, target);
  } else {
    // Asked for a number of vertices, the shortest edge left follows from it.
    const bool by_count = options.remove || options.vertices;
    PlainOrder<false> order{by_count ? l_max : std::max(options.l0.value_or(l_max), 0.0),
                            size_limit};
    engine.run(order, target);
  }
}

/// The greatest distance of places[0..count) to the mesh of a tree.
template <class Place>
double greatest_distance(const TriangleTree& tree, std::size_t count, const Place& place) {
  constexpr std::size_t grain = 1024;
  std::vector<double> greatest((count + grain - 1) / grain, 0);
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    double& here = greatest[begin / grain];
    for (std::size_t i = begin; i < end; ++i) {
      here = std::max(here, tree.closest(place(i)).distance);
    }
  });
  return greatest.empty() ? 0 : *std::max_element(greatest.begin(), greatest.end());
}

/// Corners, middles of the edges and the middle of a facet, in turn.
Vec3d sample(const TriMesh& mesh, std::size_t i) {
  const auto [a, b, c] = corners(mesh, i / 7);
  switch (i % 7) {
    case 0:
      return a;
    case 1:
      return b;
    case 2:
      return c;
    case 3:
      return 0.5 * (a + b);
    case 4:
      return 0.5 * (b + c);
    case 5:
      return 0.5 * (c + a);
    default:
      return (a + b + c) / 3.0;
  }
}

void measure(const TriMesh& input, SimplifyResult& result) {
  // Vertices without a facet are no part of the surface.
  std::vector<bool> used(input.vertices.size(), false);
  for (const Triangle& t : input.triangles) {
    for (const std::uint32_t v : t) used[v] = true;
  }
  std::vector<Vec3f> places;
  places.reserve(used.size());
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v]) places.push_back(input.vertices[v]);
  }
  const TriangleTree output_tree(result.mesh);
  result.max_distance = greatest_distance(output_tree, places.size(),
                                          [&](std::size_t i) { return Vec3d(places[i]); });
  const TriangleTree input_tree(input);
  result.reverse_max_distance =
      greatest_distance(input_tree, 7 * result.mesh.triangles.size(),
                        [&](std::size_t i) { return sample(result.mesh, i); });
}

std::string reason(const SimplifyOptions& options, const CollapseMesh& work,
                   const CollapseChecks& checks, std::uint32_t target) {
  if (target > 0 && work.live_vertices <= target) return "vertices";
  if (checks.bound_was_met()) return "max_error";
  const bool sized = options.l_max > 0 || !options.size_limit.empty() ||
                     options.method == SimplifyMethod::paper ||
                     (options.method == SimplifyMethod::length && options.l0);
  return target == 0 && sized ? "sizes" : "nothing_left";
}

}  // namespace

SimplifyResult simplify(const TriMesh& mesh, const SimplifyOptions& options) {
  check(mesh, options);
  CollapseMesh work(mesh, options.sides);
  const std::uint32_t target = target_of(options, work.live_vertices);
  remove_zero_area(work);

  double border_error = options.max_error.value_or(0);
  if (!options.max_error && !mesh.materials.empty()) {
    border_error = default_border_error * mean_feature_edge(work, std::vector<bool>(work.r.size()));
  }
  CollapseChecks checks(work, options.max_error, border_error);
  if (options.placement == PlacementMethod::garland_heckbert) {
    run<GarlandHeckbertPlacement>(mesh, options, work, checks, target);
  } else {
    run<LindstromTurkPlacement>(mesh, options, work, checks, target);
  }

  SimplifyResult result;
  result.mesh = work.extract();
  result.proven_distance = checks.proven_error(work.topology);
  result.stopped_by = reason(options, work, checks, target);
  if (options.measure) {
    measure(mesh, result);
  } else {
    result.max_distance = result.reverse_max_distance = result.proven_distance;
  }
  return result;
}

}  // namespace scarp
