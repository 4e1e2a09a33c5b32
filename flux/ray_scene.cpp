#include "flux/ray_scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace scarp {

namespace {

// Distances below this are rounding: 1e-16 times the extent of the largest domain, with room.
constexpr double tiny_distance = 1e-9;

// In spacings: the two sides of a ridge, seen edge on, may change places by rounding.
constexpr double ridge_thickness = 1e-5;

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

}  // namespace

struct RayScene::Device {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~Device() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

namespace {

struct Hit {
  double t = 0;
  std::uint32_t facet = Ray::no_facet;

  void take(double distance, std::uint32_t candidate) {
    if (distance > t || (distance == t && candidate >= facet)) return;
    t = distance;
    facet = candidate;
  }
};

}  // namespace

// What one query carries through Embree to the callback and back. Embree wants its own context
// first.
//
// A facet is met if the ray's foot lies in it, seen along the ray. Vertices are sheared to that
// view, where the ray is the origin, and rounded to single precision: then products of coordinates
// are exact in double precision and the signs of the edges are those of one flat picture, the same
// for all facets. So nothing slips through an edge or a vertex.
// Source: Woop, Benthin and Wald 2013, with the rounding that makes its signs exact.
struct RayScene::Nearest {
  RTCIntersectContext context;
  const RayScene* scene;
  Vec3d r;
  Vec3d u;
  std::uint32_t from;
  double t_min;
  Hit front;  // nearest so far
  Hit back;
  int axis_x;
  int axis_y;
  int axis_z;  // the longest of u
  double shear_x;
  double shear_y;

  struct Corner {
    double x;
    double y;
    double depth;
  };

  void start(const Ray& ray, double shortest, double longest) {
    r = ray.r;
    u = ray.u;
    from = ray.from;
    t_min = shortest;
    front = back = {.t = longest};
    const Vec3d size{std::abs(u.x), std::abs(u.y), std::abs(u.z)};
    axis_z = size.z >= size.x && size.z >= size.y ? 2 : size.x >= size.y ? 0 : 1;
    axis_x = (axis_z + 1) % 3;
    axis_y = (axis_z + 2) % 3;
    shear_x = u[axis_x] / u[axis_z];
    shear_y = u[axis_y] / u[axis_z];
  }

  Corner seen(Vec3f corner) const {
    const Vec3d v = Vec3d(corner) - r;
    const auto rounded = [](double x) { return static_cast<double>(static_cast<float>(x)); };
    return {rounded(v[axis_x] - shear_x * v[axis_z]), rounded(v[axis_y] - shear_y * v[axis_z]),
            dot(v, u)};
  }

  void test(std::uint32_t candidate) {
    if (candidate == from) return;
    const auto& [corner_a, corner_b, corner_c] = scene->facets_[candidate];
    const Corner a = seen(corner_a);
    const Corner b = seen(corner_b);
    const Corner c = seen(corner_c);
    const double weight_a = b.x * c.y - b.y * c.x;
    const double weight_b = c.x * a.y - c.y * a.x;
    const double weight_c = a.x * b.y - a.y * b.x;
    const bool is_left = weight_a >= 0 && weight_b >= 0 && weight_c >= 0;
    const bool is_right = weight_a <= 0 && weight_b <= 0 && weight_c <= 0;
    if (is_left == is_right) return;  // outside, or seen edge on
    // On the facet's plane, within its reach where the plane is seen edge on.
    const Vec3d n = scene->normals_[candidate];
    const auto [nearest, farthest] = std::minmax({a.depth, b.depth, c.depth});
    const double on_plane = dot(n, Vec3d(corner_a) - r) / dot(n, u);
    const double distance =
        on_plane >= nearest ? (on_plane <= farthest ? on_plane : farthest) : nearest;
    const bool is_front = is_left == (u[axis_z] < 0);
    if (is_front && distance >= t_min) front.take(distance, candidate);
    if (!is_front && distance >= tiny_distance) back.take(distance, candidate);
  }

  // Where a flight meets a sharp ridge it meets both sides: that counts as the front.
  bool is_at_front() const {
    return front.facet != Ray::no_facet &&
           (back.facet == Ray::no_facet || front.t <= back.t + ridge_thickness);
  }

  static void intersect(const RTCIntersectFunctionNArguments* arguments) {
    if (arguments->valid[0] == 0) return;
    auto* nearest = reinterpret_cast<Nearest*>(arguments->context);
    nearest->test(arguments->primID);
    auto* ray_hit = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
    // Never shorter than the true distance, so that a tie is still visited.
    const double t = std::min(nearest->front.t, nearest->back.t);
    ray_hit->ray.tfar =
        std::min(ray_hit->ray.tfar, static_cast<float>(t) + nearest->scene->padding_);
  }

  static void bounds(const RTCBoundsFunctionArguments* arguments) {
    const auto* scene = static_cast<const RayScene*>(arguments->geometryUserPtr);
    const auto& [a, b, c] = scene->facets_[arguments->primID];
    RTCBounds& box = *arguments->bounds_o;
    box.lower_x = std::min({a.x, b.x, c.x}) - scene->padding_;
    box.lower_y = std::min({a.y, b.y, c.y}) - scene->padding_;
    box.lower_z = std::min({a.z, b.z, c.z}) - scene->padding_;
    box.upper_x = std::max({a.x, b.x, c.x}) + scene->padding_;
    box.upper_y = std::max({a.y, b.y, c.y}) + scene->padding_;
    box.upper_z = std::max({a.z, b.z, c.z}) + scene->padding_;
  }
};

RayScene::RayScene(const TriMesh& mesh, const Sides& sides, const Options& options)
    : device_(std::make_unique<Device>()) {
  place(mesh, sides, options.spacing);

  device_->device = rtcNewDevice(options.embree.c_str());
  if (device_->device == nullptr)
    throw NumericalError("Embree has no device for \"" + options.embree + "\"");
  device_->scene = rtcNewScene(device_->device);
  rtcSetSceneFlags(device_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(device_->scene, RTC_BUILD_QUALITY_LOW);
  RTCGeometry geometry = rtcNewGeometry(device_->device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_LOW);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(facets_.size()));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, &Nearest::bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, &Nearest::intersect);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(device_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(device_->scene);
  if (rtcGetDeviceError(device_->device) != RTC_ERROR_NONE)
    throw NumericalError("Embree could not build its tree over " + std::to_string(facets_.size()) +
                         " facets: out of memory?");
}

RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

// The mesh has to end exactly on the sides: vertices that should lie there are put there.
void RayScene::place(const TriMesh& mesh, const Sides& sides, double spacing) {
  if (mesh.triangles.empty()) throw InputError("flux: the mesh has no triangles");
  const Box box = bounding_box(mesh);
  const Vec3d origin{static_cast<float>(sides.lower[0]), static_cast<float>(sides.lower[1]),
                     0.5 * (box.lower.z + box.upper.z)};
  const auto placed = [&](Vec3f r) { return Vec3f((Vec3d(r) - origin) / spacing); };
  const Vec3f upper =
      placed({static_cast<float>(sides.upper[0]), static_cast<float>(sides.upper[1]), 0});
  upper_ = Vec3d(upper);
  boundary_ = sides.boundary;

  facets_.resize(mesh.triangles.size());
  normals_.resize(facets_.size());
  areas_.resize(facets_.size());
  Box extent;
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      Vec3f r = placed(mesh.vertices[mesh.triangles[f][corner]]);
      r.x = snapped(r.x, upper.x);
      r.y = snapped(r.y, upper.y);
      facets_[f][corner] = r;
      extent.add(Vec3d(r));
    }
    const Vec3d exact = area_vector(mesh, f) / (spacing * spacing);
    areas_[f] = length(exact);
    if (!(areas_[f] > 0) || !std::isfinite(areas_[f])) {
      const Vec3f r = mesh.vertices[mesh.triangles[f][0]];
      throw InputError("flux: facet " + std::to_string(f) + " at (" + std::to_string(r.x) + ", " +
                       std::to_string(r.y) + ", " + std::to_string(r.z) +
                       ") has no area; remove such triangles first");
    }
    normals_[f] = placed_normal(facets_[f], exact);
  }
  if (extent.lower.x < 0 || extent.lower.y < 0 || extent.upper.x > upper.x ||
      extent.upper.y > upper.y)
    throw InputError("flux: the mesh reaches over the lateral sides of the domain");
  source_height_ = extent.upper.z + 1;
  lowest_ = extent.lower.z;
  const double diameter = upper_.x + upper_.y + (source_height_ - lowest_);
  // Twenty times the rounding of single precision over the whole domain.
  padding_ = static_cast<float>(1.2e-6 * diameter);
}

void RayScene::cross_side(int axis, Ray& ray) const {
  const bool up = ray.u[axis] > 0;
  if (boundary_[static_cast<std::size_t>(axis)] == Boundary::periodic) {
    ray.r[axis] = up ? 0 : upper_[axis];
  } else {
    ray.r[axis] = up ? upper_[axis] : 0;
    ray.u[axis] = -ray.u[axis];
  }
  ray.from = Ray::no_facet;
}

Flight RayScene::fly(const Ray& start) const {
  Ray ray = start;
  Nearest nearest;
  rtcInitIntersectContext(&nearest.context);
  nearest.scene = this;
  for (int crossings = 0; crossings < max_side_crossings; ++crossings) {
    const double end_z = ray.u.z > 0 ? source_height_ : lowest_ - 1;
    constexpr double never = std::numeric_limits<double>::infinity();
    const double t_end = ray.u.z == 0 ? never : std::max((end_z - ray.r.z) / ray.u.z, 0.0);
    int axis = 0;
    double t_side = never;
    for (int i = 0; i < 2; ++i) {
      if (ray.u[i] == 0) continue;
      const double t = std::max(((ray.u[i] > 0 ? upper_[i] : 0) - ray.r[i]) / ray.u[i], 0.0);
      if (t < t_side) {
        t_side = t;
        axis = i;
      }
    }

    // A little is searched on both sides of a crossing: rounding there may put the place behind
    // the surface.
    nearest.start(ray, -tiny_distance, std::min(t_side, t_end) + tiny_distance);
    find_nearest(nearest);
    if (nearest.is_at_front())
      return {Flight::End::front, nearest.front.facet, ray.r + nearest.front.t * ray.u, ray.u};
    if (nearest.back.facet != Ray::no_facet)
      return {Flight::End::back, nearest.back.facet, ray.r + nearest.back.t * ray.u, ray.u};
    if (t_end <= t_side) {
      return {ray.u.z > 0 ? Flight::End::sky : Flight::End::below, Ray::no_facet,
              ray.r + t_end * ray.u, ray.u};
    }
    ray.r += t_side * ray.u;
    cross_side(axis, ray);
  }
  return {Flight::End::side_limit, Ray::no_facet, ray.r, ray.u};
}

void RayScene::find_nearest(Nearest& nearest) const {
  RTCRayHit query;
  query.ray.org_x = static_cast<float>(nearest.r.x);
  query.ray.org_y = static_cast<float>(nearest.r.y);
  query.ray.org_z = static_cast<float>(nearest.r.z);
  query.ray.dir_x = static_cast<float>(nearest.u.x);
  query.ray.dir_y = static_cast<float>(nearest.u.y);
  query.ray.dir_z = static_cast<float>(nearest.u.z);
  query.ray.tnear = 0;
  query.ray.tfar = static_cast<float>(nearest.front.t) + padding_;
  query.ray.time = 0;
  query.ray.mask = 0xFFFFFFFFU;
  query.ray.id = 0;
  query.ray.flags = 0;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(device_->scene, &nearest.context, &query);
}

}  // namespace scarp
