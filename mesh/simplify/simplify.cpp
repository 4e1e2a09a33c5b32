#include "mesh/simplify/simplify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "mesh/distance.h"
#include "mesh/simplify/collapse_passes.h"
#include "mesh/simplify/crossings.h"
#include "mesh/simplify/curvature.h"
#include "mesh/simplify/edge_sizes.h"
#include "mesh/simplify/flip_edges.h"
#include "mesh/simplify/placement.h"
#include "mesh/simplify/regions.h"
#include "mesh/simplify/relocate.h"
#include "mesh/simplify/tracked_points.h"
#include "mesh/simplify/zero_area.h"

namespace scarp {

namespace {

// Defaults, in grid spacings.
constexpr double default_max_error = 0.1;
/// Where a number of vertices or a size stops it, what is tried first: so much keeps walls that are
/// a cell apart from passing through each other.
constexpr double soft_max_error = 0.5;
constexpr double rough_error = 0.25;  ///< up to here it is proven roughly
constexpr double default_l0 = 0.6;
constexpr double default_step_length = 2;
// Of the spacing's square.
constexpr double shape_weight_to_number = 5e-6;
constexpr double shape_weight_within_bound = 4e-6;

/// Of moves, once the vertices are as few as asked for.
constexpr int sweeps = 3;

/// What a pass of `paper` leaves in a ring goes in later ones.
constexpr CollapsePasses::Approach ring_by_ring{.least = 0.1, .share_of_pass = 0.4};

/// Of the vertices asked for: from so many on `curvature` follows those of the input.
constexpr double vertices_to_follow = 1.4;
constexpr CollapsePasses::Approach up_to_following{
    .nearest = 0.15, .share_of_pass = 0.5, .tries = 2.5};

/// Of `curvature` where the bound alone stops it.
constexpr CollapsePasses::Approach up_to_bound{.share_of_pass = 0.33};

/// Mean length of an edge between features in marching cubes, in grid spacings.
constexpr double edge_per_spacing = 0.97;

/// How much a target that is out of reach raises l0 at a time.
constexpr double raise_factor = 1.25;

/// So often it is done again, from the input, where facets pass through each other.
constexpr int most_attempts = 8;

/// If more of the input than this would have to be kept there, a bound that is not the caller's is
/// halved instead, down to about lowest_max_error in grid spacings.
constexpr double most_kept = 0.05;
constexpr double lowest_max_error = 0.02;

/// Of the bound, or of its default: what the removal of facets without area may take.
constexpr double share_of_zero_area = 0.5;

constexpr double unlimited = std::numeric_limits<double>::infinity();

void check_length(const char* name, std::optional<double> value) {
  if (value && !(std::isfinite(*value) && *value >= 0)) {
    throw InputError(std::string("simplify: ") + name + ": " + std::to_string(*value) +
                     "; it has to be finite and not negative");
  }
}

void check(const TriMesh& mesh, const SimplifyOptions& options) {
  if (mesh.triangles.empty()) throw InputError("simplify: the mesh has no triangles");
  check_length("spacing", options.spacing);
  check_length("l0", options.l0);
  check_length("step_length", options.step_length);
  check_length("l_max", options.l_max);
  check_length("max_error", options.max_error);
  check_length("curvature_threshold", options.curvature_threshold);
  check_length("shape_weight", options.shape_weight);
  if (options.remove && !(*options.remove >= 0 && *options.remove < 1)) {
    throw InputError("simplify: remove: " + std::to_string(*options.remove) + " is outside [0, 1)");
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

/// The side of a square with the area of a mesh per vertex.
double mean_spacing(double area, std::size_t vertex_count) {
  return std::sqrt(area / static_cast<double>(vertex_count));
}

bool uses_features(SimplifyMethod method) {
  return method == SimplifyMethod::paper || method == SimplifyMethod::curvature;
}

/// The options with nothing left open but what is a feature.
SimplifyOptions resolved(SimplifyOptions options, const CollapseMesh& work,
                         const std::vector<bool>& is_feature) {
  if (!(options.spacing > 0)) {
    options.spacing = mean_feature_edge(work, is_feature) / edge_per_spacing;
  }
  const bool stops_itself = options.method == SimplifyMethod::length && options.l0;
  if (!options.remove && !options.vertices && !options.max_error && !stops_itself) {
    options.max_error = default_max_error * options.spacing;
  }
  if (uses_features(options.method)) {
    if (!options.l0) options.l0 = default_l0 * options.spacing;
    if (!options.step_length) options.step_length = default_step_length * options.spacing;
    if (options.l_max > 0) options.l_max = std::max(options.l_max, *options.l0);
  }
  return options;
}

/// What an attempt has to do otherwise than the one before it, because facets passed through each
/// other.
struct Restraint {
  double highest_bound = unlimited;  ///< on the distance, where the caller gives none
  std::vector<Box> kept;             ///< facets of the input near these stay as they are
};

/// highest: what no bound may exceed. moved: how far the surface is from the input already.
ErrorLimit error_limit(const SimplifyOptions& options, double highest, double moved) {
  if (options.max_error) return {std::max(std::min(*options.max_error, highest) - moved, 0.0)};
  const double limit = std::min(soft_max_error * options.spacing, highest);
  return {limit, std::min(rough_error * options.spacing, 0.5 * limit), highest};
}

std::vector<bool> features_of(const CollapseMesh& work, const SimplifyOptions& options,
                              std::uint32_t target) {
  std::vector<double> curvature = with_copies<double>(options.curvature, work.topology);
  if (curvature.empty()) {
    curvature = smoothed(mean_curvature(work), work.topology);
  }
  const double threshold = options.curvature_threshold > 0 ? options.curvature_threshold
                                                           : feature_threshold(curvature, work);
  return find_features(curvature, threshold, target > 0 ? target / 2 : curvature.size());
}

double diameter(const CollapseMesh& mesh) {
  Box box;
  for (const Vec3d r : mesh.r) box.add(r);
  return length(box.upper - box.lower);
}

EdgeSizes sizes_of(const SimplifyOptions& options, const std::vector<bool>& is_feature,
                   const CollapseMesh& work) {
  return {.field = graded_sizes(work.topology, is_feature, *options.l0, *options.step_length,
                                options.spacing),
          .limit = with_copies<float>(options.size_limit, work.topology),
          .l_max = options.l_max > 0 ? options.l_max : unlimited};
}

/// Moves what is left. Returns the distance that no vertex of the input is further from the result
/// than.
double finish_curvature(const EdgeSizes& sizes, double shape_weight, int sweeps, CollapseMesh& work,
                        CollapseChecks& checks, TrackedPoints& points) {
  const LargeVector<Vec3d> reference = work.normals;
  for (int pass = 0; pass < sweeps; ++pass) {
    relocate(work, checks, points, shape_weight, reference, pass);
    // After each of them it would hardly be better.
    if (sweeps > 1 && pass == sweeps / 2) {
      flip_edges(work, checks, points, sizes, shape_weight, reference, pass);
    }
  }
  return points.largest(work);
}

double shape_weight_of(const SimplifyOptions& options, bool to_number) {
  const double by_default = to_number ? shape_weight_to_number : shape_weight_within_bound;
  return options.shape_weight.value_or(by_default) * options.spacing * options.spacing;
}

/// Down to a number of vertices, with a bound as low as will do.
void run_to(std::uint32_t target, CollapsePasses& passes, CollapseMesh& work,
            CollapseChecks& checks) {
  passes.run_to(target);
  while (work.live_vertices > target && checks.raise_bound()) {
    passes.forget_refusals();
    passes.run_to(target);
  }
}

/// Returns as finish_curvature().
double run_curvature(const SimplifyOptions& options, const std::vector<bool>& is_feature,
                     CollapseMesh& work, CollapseChecks& checks, std::uint32_t target) {
  const bool to_number = target > 0;
  const double shape_weight = shape_weight_of(options, to_number);
  const std::uint32_t before = work.live_vertices;
  EdgeSizes sizes;
  LargeVector<Vec3d> places;
  std::optional<CollapsePasses> ready;
  const auto find_sizes = [&] { sizes = sizes_of(options, is_feature, work); };
  const auto get_ready = [&] {
    places = work.r;
    ready.emplace(work, checks, sizes,
                  PassOrder{.looks_twice = to_number, .shape_weight = shape_weight});
  };
  in_parallel(find_sizes, get_ready);
  CollapsePasses& passes = *ready;
  passes.approach(static_cast<std::uint32_t>(vertices_to_follow * target),
                  to_number ? up_to_following : up_to_bound);
  // Facets as long as the body lie in no block.
  if (!to_number && options.thin_facets == ThinFacets::exact) run_to(0, passes, work, checks);
  TrackedPoints points(work, std::move(places), passes.merged_into(), checks.bound());
  if (to_number) {
    passes.follow(points);
    run_to(target, passes, work, checks);
  }
  // Where nothing could be removed the surface stays as it is.
  if (work.live_vertices == before) return points.largest(work);
  // Within a bound of a tenth of a spacing more than one gains 1 % of the mean distance.
  return finish_curvature(sizes, shape_weight, to_number ? sweeps : 1, work, checks, points);
}

/// Of all methods but `curvature`.
PassOrder plain_order(const SimplifyOptions& options) {
  return {.measure = Measure::volume,
          .by_planes = options.placement == PlacementMethod::garland_heckbert,
          .shortest_first = options.method == SimplifyMethod::length};
}

void run_paper(const SimplifyOptions& options, const std::vector<bool>& is_feature,
               CollapseMesh& work, CollapseChecks& checks, std::uint32_t target) {
  Regions regions(is_feature, with_copies<float>(options.size_limit, work.topology),
                  {*options.l0, *options.step_length, options.l_max});
  EdgeSizes sizes;
  sizes.only_old = true;
  CollapsePasses passes(work, checks, sizes, plain_order(options));
  const auto run_ring = [&] {
    sizes.limit = regions.sizes();
    const bool is_near = passes.approach(target, ring_by_ring);
    regions.merge(passes.merged_into());
    return is_near;
  };

  // Slivers everywhere, features down to l0.
  bool done = run_ring();

  // Ring after ring around the features, coarser with each.
  while (!done && regions.coarsen()) {
    done = run_ring();
    if (done || regions.enclose_ring(work)) continue;
    regions.release_rest();
    run_ring();
    done = true;
  }
  run_to(target, passes, work, checks);

  // A number of vertices that the sizes do not allow. Edges of any length are wanted in the end.
  if (target == 0) return;
  const double greatest = diameter(work);
  double size = *options.l0 > 0 ? *options.l0 : options.spacing;
  while (work.live_vertices > target && size < greatest) {
    regions.merge(passes.merged_into());
    size *= raise_factor;
    regions.raise(size);
    sizes.limit = regions.sizes();
    run_to(target, passes, work, checks);
  }
}

void run_plain(const SimplifyOptions& options, CollapseMesh& work, CollapseChecks& checks,
               std::uint32_t target) {
  EdgeSizes sizes;
  sizes.only_old = true;
  sizes.limit = with_copies<float>(options.size_limit, work.topology);
  if (options.l_max > 0) sizes.l_max = options.l_max;
  // Asked for a number of vertices, the shortest edge left follows from it.
  const bool by_count = options.remove || options.vertices;
  if (options.method == SimplifyMethod::length && options.l0 && !by_count) {
    sizes.l_max = *options.l0;
  }
  CollapsePasses passes(work, checks, sizes, plain_order(options));
  run_to(target, passes, work, checks);
}

void measure(const TriMesh& input, SimplifyResult& result) {
  const auto greatest = [](std::span<const Vec3d> places, const TriMesh& to) {
    return statistics(distances(places, TriangleTree(to))).max;
  };
  result.max_distance = greatest(surface_vertices(input), result.mesh);
  // As dense as the vertices of the input, on large facets as well.
  const std::vector<double> areas = facet_areas(input);
  const double spacing =
      mean_spacing(std::accumulate(areas.begin(), areas.end(), 0.0), input.vertices.size());
  result.reverse_max_distance = greatest(surface_samples(result.mesh, spacing), input);
}

std::string reason(const SimplifyOptions& options, const CollapseMesh& work,
                   const CollapseChecks& checks, std::uint32_t target) {
  if (target > 0 && work.live_vertices <= target) return "vertices";
  if (checks.bound_was_met()) return options.max_error ? "max_error" : "self_intersections";
  const bool sized = options.l_max > 0 || !options.size_limit.empty() ||
                     options.method == SimplifyMethod::paper ||
                     (options.method == SimplifyMethod::length && options.l0);
  return target == 0 && sized ? "sizes" : "nothing_left";
}

/// The surface as it comes out of the collapses.
struct Attempt {
  SimplifyResult result;
  double spacing = 0;
  double bound = 0;             ///< on the distance, as it was in the end
  double tracked_distance = 0;  ///< `curvature` only
  std::vector<Box> crossings;   ///< of its facets
};

Attempt simplify_once(const TriMesh& mesh, const SpatialOrder& order, const SimplifyOptions& wanted,
                      const Restraint& restraint) {
  CollapseMesh work(reordered(mesh, order), wanted.sides, wanted.thin_facets);
  const std::uint32_t target = target_of(wanted, work.live_vertices);
  if (work.topology.facet_count() == 0) {
    throw InputError("simplify: no triangle of the mesh has three different corners");
  }
  const double spacing =
      wanted.spacing > 0 ? wanted.spacing : mean_spacing(work.area, mesh.vertices.size());
  const double moved = remove_zero_area(
      work, share_of_zero_area * wanted.max_error.value_or(default_max_error * spacing));

  std::vector<bool> is_feature(work.r.size(), false);
  if (wanted.method == SimplifyMethod::paper) is_feature = features_of(work, wanted, target);
  if (wanted.method == SimplifyMethod::curvature) is_feature = features_of(work, wanted, 0);
  const SimplifyOptions options = resolved(wanted, work, is_feature);

  CollapseChecks checks(work, error_limit(options, restraint.highest_bound, moved),
                        options.max_error.value_or(default_max_error * options.spacing));
  if (!restraint.kept.empty()) checks.keep(facets_near(work, restraint.kept));
  Attempt attempt;
  attempt.spacing = options.spacing;
  if (options.method == SimplifyMethod::curvature) {
    attempt.tracked_distance = moved + run_curvature(options, is_feature, work, checks, target);
  } else if (options.method == SimplifyMethod::paper) {
    run_paper(options, is_feature, work, checks, target);
  } else {
    run_plain(options, work, checks, target);
  }
  in_parallel([&] { attempt.crossings = crossings(work); },
              [&] { attempt.result.mesh = work.extract(order); });
  attempt.result.proven_distance = moved + checks.proven_error(work.topology);
  attempt.result.stopped_by = reason(options, work, checks, target);
  attempt.bound = checks.bound();
  return attempt;
}

/// By where they begin in x.
std::vector<Box> sorted(std::vector<Box> boxes) {
  std::sort(boxes.begin(), boxes.end(),
            [](const Box& a, const Box& b) { return a.lower.x < b.lower.x; });
  return boxes;
}

/// Leaves out what crosses in the input already, to within a distance. old: sorted.
void forget_old(const std::vector<Box>& old, double within, std::vector<Box>& crossings) {
  double widest = 0;
  for (const Box& each : old) widest = std::max(widest, each.upper.x - each.lower.x);
  const auto is_near = [within](const Box& a, const Box& b) {
    for (int axis = 0; axis < 3; ++axis) {
      if (a.lower[axis] > b.upper[axis] + within || b.lower[axis] > a.upper[axis] + within) {
        return false;
      }
    }
    return true;
  };
  const auto is_old = [&](const Box& box) {
    const auto first = std::lower_bound(old.begin(), old.end(), box.lower.x - within - widest,
                                        [](const Box& each, double x) { return each.lower.x < x; });
    for (auto each = first; each != old.end() && each->lower.x <= box.upper.x + within; ++each) {
      if (is_near(box, *each)) return true;
    }
    return false;
  };
  crossings.erase(std::remove_if(crossings.begin(), crossings.end(), is_old), crossings.end());
}

/// Simplifies, and again as long as facets pass through each other that did not in the input: in
/// few places by keeping the input there, in growing boxes, and in the last attempt everywhere; in
/// many with half the bound, if it is not the caller's. That is rare, and looking for it at the end
/// costs less than keeping sheets apart all the way.
Attempt simplify_without_crossings(const TriMesh& mesh, const SpatialOrder& order,
                                   const SimplifyOptions& wanted) {
  Restraint restraint;
  Attempt attempt = simplify_once(mesh, order, wanted, restraint);
  if (attempt.crossings.empty()) return attempt;
  const CollapseMesh input(reordered(mesh, order), wanted.sides, wanted.thin_facets);
  const std::vector<Box> old = sorted(crossings(input));
  forget_old(old, attempt.bound, attempt.crossings);
  const double few = most_kept * static_cast<double>(mesh.triangles.size());
  double reach = attempt.bound;
  for (int i = 1; i < most_attempts && !attempt.crossings.empty(); ++i, reach *= 2) {
    if (i == most_attempts - 1) reach = diameter(input);
    const Vec3d around{reach, reach, reach};
    for (const Box& box : attempt.crossings) {
      restraint.kept.push_back({box.lower - around, box.upper + around});
    }
    const bool may_halve = !wanted.max_error && attempt.bound > lowest_max_error * attempt.spacing;
    if (may_halve && static_cast<double>(facets_near(input, restraint.kept).size()) > few) {
      restraint = {.highest_bound = 0.5 * attempt.bound, .kept = {}};
      reach = 0.5 * restraint.highest_bound;
      i = 0;
    }
    attempt = simplify_once(mesh, order, wanted, restraint);
    forget_old(old, attempt.bound, attempt.crossings);
  }
  return attempt;
}

/// Numbers of the bound grow with each collapse beyond the true distance, most on long facets. What
/// they have used up in vain is used again: from the result on, as long as that helps.
Attempt simplify_drawn(const TriMesh& mesh, Attempt attempt, SimplifyOptions wanted) {
  constexpr double slack = 0.02;      // of the bound
  constexpr double most_used = 0.95;  // of the bound
  if (wanted.remove) {
    const auto count = static_cast<double>(mesh.vertices.size());
    wanted.vertices = static_cast<std::size_t>(std::ceil((1 - *wanted.remove) * count));
    wanted.remove.reset();
  }
  wanted.spacing = attempt.spacing;
  const double limit = wanted.max_error.value_or(default_max_error * attempt.spacing);
  while (attempt.result.stopped_by == "max_error") {
    const double used = std::max(proven_distance(attempt.result.mesh, mesh, slack * limit),
                                 proven_distance(mesh, attempt.result.mesh, slack * limit));
    if (used > most_used * limit) break;
    attempt.result.proven_distance = std::min(attempt.result.proven_distance, used);
    wanted.max_error = limit - used;
    const TriMesh& before = attempt.result.mesh;
    Attempt next = simplify_without_crossings(before, spatial_order(before), wanted);
    if (next.result.mesh.vertices.size() >= before.vertices.size()) break;
    next.result.proven_distance += used;
    next.tracked_distance += used;
    attempt = std::move(next);
  }
  return attempt;
}

}  // namespace

SimplifyResult simplify(const TriMesh& mesh, const SimplifyOptions& asked) {
  check(mesh, asked);
  const SpatialOrder order = spatial_order(mesh);
  const std::vector<float> curvature = reordered(asked.curvature, order);
  const std::vector<float> size_limit = reordered(asked.size_limit, order);
  SimplifyOptions wanted = asked;
  wanted.curvature = curvature;
  wanted.size_limit = size_limit;

  Attempt attempt = simplify_without_crossings(mesh, order, wanted);
  if (asked.thin_facets == ThinFacets::exact && curvature.empty() && size_limit.empty())
    attempt = simplify_drawn(mesh, std::move(attempt), wanted);
  SimplifyResult result = std::move(attempt.result);
  if (asked.measure) {
    measure(mesh, result);
  } else {
    result.max_distance = result.reverse_max_distance = result.proven_distance;
    if (asked.method == SimplifyMethod::curvature) {
      result.max_distance = std::min(attempt.tracked_distance, result.proven_distance);
    }
  }
  return result;
}

}  // namespace scarp
