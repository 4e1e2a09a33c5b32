#include "flux/rays/ray_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/recipe/quantity.h"
#include "flux/rays/nearest_facet.h"

namespace scarp {

namespace {

constexpr int max_side_crossings = 1'000'000;

// In spacings: a vertex this close to a side belongs on it.
constexpr float side_tolerance = 1e-4F;

float snapped(float x, float upper) {
  if (std::abs(x) < side_tolerance) return 0;
  if (std::abs(x - upper) < side_tolerance) return upper;
  return x;
}

// The normal of the facet as it is traced, so that nothing is emitted below its plane; but that of
// a sliver may turn anywhere by rounding.
Vec3d placed_normal(const std::array<Vec3f, 3>& corners, Vec3d exact) {
  const auto& [a, b, c] = corners;
  const Vec3d placed = cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a));
  const bool is_turned = !(dot(placed, exact) > 0.99 * length(placed) * length(exact));
  return normalized(is_turned ? exact : placed);
}

// Of numbers that Embree takes for coordinates.
constexpr float largest_coordinate = 1e18F;

bool is_finite(Vec3f r) {
  return std::abs(r.x) < largest_coordinate && std::abs(r.y) < largest_coordinate &&
         std::abs(r.z) < largest_coordinate;
}

constexpr double infinity = std::numeric_limits<double>::infinity();

using Pair = RayView::Pair;

// From r at speed u to the lower end or the upper one. Without branches: directions cannot be
// foreseen.
inline Pair times(const Pair& r, const Pair& u, const Pair& lower_end, const Pair& upper_end) {
  const Pair end = u > 0 ? upper_end : lower_end;
  const Pair t = (end - r) / u;
  const Pair at_least_0 = t > 0 ? t : Pair{};
  return u == 0 ? Pair{infinity, infinity} : at_least_0;
}

}  // namespace

// A straight part of a flight, from one side to the next.
struct RayScene::Part {
  int side;  // that it ends at: an axis, or the diagonal
  double t_side;
  double t_end;  // of the domain
};

RayScene::RayScene(const TriMesh& mesh, const Sides& sides, double spacing,
                   const std::string& embree) {
  place(mesh, sides, spacing);
  tree_.emplace(facets_, upper_.x + upper_.y + (source_height_ - lowest_), embree);
}

// The mesh has to end exactly on the sides: vertices that should lie there are put there.
void RayScene::place(const TriMesh& mesh, const Sides& sides, double spacing) {
  if (mesh.triangles.empty()) throw InputError("flux: the mesh has no triangles");
  if (mesh.triangles.size() >= Ray::no_facet) {
    throw InputError("flux: the mesh has " + std::to_string(mesh.triangles.size()) +
                     " triangles, more than 32 bits count; simplify it first");
  }
  const Box box = bounding_box(mesh);
  const Vec3d origin{static_cast<float>(sides.lower[0]), static_cast<float>(sides.lower[1]),
                     0.5 * (box.lower.z + box.upper.z)};
  const auto placed = [&](Vec3f r) { return Vec3f((Vec3d(r) - origin) / spacing); };
  const Vec3f upper =
      placed({static_cast<float>(sides.upper[0]), static_cast<float>(sides.upper[1]), 0});
  upper_ = Vec3d(upper);
  boundary_ = sides.boundary;
  has_diagonal_ = sides.diagonal;

  facets_.resize(mesh.triangles.size());
  areas_.resize(facets_.size());
  Box extent;
  std::optional<Vec3f> beyond;
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      Vec3f r = placed(mesh.vertices[mesh.triangles[f][corner]]);
      r.x = snapped(r.x, upper.x);
      r.y = snapped(r.y, upper.y);
      if (has_diagonal_ && std::abs(r.x - r.y) < side_tolerance) r.y = r.x;
      if (!is_finite(r)) {
        throw InputError("flux: a corner of facet " + std::to_string(f) + ", " +
                         rounded_place(Vec3d(mesh.vertices[mesh.triangles[f][corner]])) +
                         ", is not a finite place within 1e18 spacings");
      }
      facets_[f].corners[corner] = r;
      extent.add(Vec3d(r));
      const bool is_within = r.x >= 0 && r.y >= 0 && r.x <= upper.x && r.y <= upper.y &&
                             (!has_diagonal_ || r.y <= r.x);
      if (!is_within && !beyond) beyond = mesh.vertices[mesh.triangles[f][corner]];
    }
    const Vec3d exact = area_vector(mesh, f) / (spacing * spacing);
    areas_[f] = length(exact);
    if (!(areas_[f] > 0) || !std::isfinite(areas_[f])) {
      throw InputError("flux: facet " + std::to_string(f) + " at " +
                       rounded_place(Vec3d(mesh.vertices[mesh.triangles[f][0]])) +
                       " has no area; remove such triangles first");
    }
    facets_[f].normal = placed_normal(facets_[f].corners, exact);
  }
  if (beyond) {
    const auto side = [&](int axis) {
      return rounded_number(sides.lower[axis]) + " to " + rounded_number(sides.upper[axis]);
    };
    throw InputError("flux: the mesh reaches over the lateral sides of the domain at " +
                     rounded_place(Vec3d(*beyond)) + "; x goes from " + side(0) + " and y from " +
                     side(1) + (has_diagonal_ ? ", up to x" : "") +
                     ": cut the mesh there or widen the domain");
  }
  source_height_ = extent.upper.z + 1;
  lowest_ = extent.lower.z;
}

void RayScene::cross_side(int side, Ray& ray) const {
  ray.from = Ray::no_facet;
  if (side == diagonal) {
    ray.r.x = ray.r.y = 0.5 * (ray.r.x + ray.r.y);
    std::swap(ray.u.x, ray.u.y);
    return;
  }
  const bool up = ray.u[side] > 0;
  if (boundary_[static_cast<std::size_t>(side)] == Boundary::periodic) {
    ray.r[side] = up ? 0 : upper_[side];
  } else {
    ray.r[side] = up ? upper_[side] : 0;
    ray.u[side] = -ray.u[side];
  }
}

RayScene::Part RayScene::part_from(const Ray& ray) const {
  const Pair across =
      times(Pair{ray.r.x, ray.r.y}, Pair{ray.u.x, ray.u.y}, Pair{}, Pair{upper_.x, upper_.y});
  const double diagonal_on = has_diagonal_ ? 1 : 0;
  const Pair others = times(Pair{ray.r.z, diagonal_on * (ray.r.x - ray.r.y)},
                            Pair{ray.u.z, diagonal_on * (ray.u.x - ray.u.y)}, Pair{lowest_ - 1, 0},
                            Pair{source_height_, infinity});
  const int axis = across[1] < across[0] ? 1 : 0;
  const double t_axis = across[1] < across[0] ? across[1] : across[0];
  const bool is_diagonal = others[1] < t_axis;
  return {.side = is_diagonal ? diagonal : axis,
          .t_side = is_diagonal ? others[1] : t_axis,
          .t_end = others[0]};
}

Flight RayScene::follow(Ray ray) const {
  for (int crossings = 0; crossings < max_side_crossings; ++crossings) {
    const Part part = part_from(ray);
    // A little is searched on both sides of a crossing: rounding there may put the place behind
    // the surface.
    const double longest = std::min(part.t_side, part.t_end) + NearestFacet::tiny_distance;
    const NearestFacet nearest = tree_->nearest(ray, longest);
    const auto landed = [&](Flight::End end, const NearestFacet::Hit& hit) -> Flight {
      return {end, hit.facet, ray.r + hit.t * ray.u, ray.u};
    };
    if (nearest.is_at_front()) return landed(Flight::End::front, nearest.front());
    if (nearest.back().facet != Ray::no_facet) return landed(Flight::End::back, nearest.back());
    if (part.t_end <= part.t_side) {
      return landed(ray.u.z > 0 ? Flight::End::sky : Flight::End::below, {.t = part.t_end});
    }
    ray.r += part.t_side * ray.u;
    cross_side(part.side, ray);
  }
  return {Flight::End::side_limit, Ray::no_facet, ray.r, ray.u};
}

// A flight that begins on an edge, but for rounding, and nearly along the plane of its facet may
// begin behind the facet beyond. It is known by its end, within the solid, and begins again far
// enough from all edges.
Flight RayScene::fly(const Ray& ray) const {
  constexpr double towards_middle = 0.5;
  const Flight flight = follow(ray);
  const bool is_in_solid = flight.end == Flight::End::back || flight.end == Flight::End::below;
  if (!is_in_solid || ray.from == Ray::no_facet) return flight;
  const auto& [a, b, c] = facets_[ray.from].corners;
  const Vec3d middle = (Vec3d(a) + Vec3d(b) + Vec3d(c)) / 3;
  Ray inside = ray;
  inside.r += towards_middle * (middle - ray.r);
  return follow(inside);
}

void RayScene::fly(std::span<const Ray> rays, std::span<Flight> flights) const {
  for (std::size_t k = 0; k < rays.size(); ++k) flights[k] = fly(rays[k]);
}

}  // namespace scarp
