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

constexpr int max_side_crossings = 1'000'000;

// In spacings: a vertex this close to a side belongs on it.
constexpr float side_tolerance = 1e-4F;

float snapped(float x, float upper) {
  if (std::abs(x) < side_tolerance) return 0;
  if (std::abs(x - upper) < side_tolerance) return upper;
  return x;
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

// What one query carries through Embree to the callback and back. Embree wants its own context
// first.
struct RayScene::Nearest {
  RTCIntersectContext context;
  const RayScene* scene;
  Vec3d r;
  Vec3d u;
  std::uint32_t from;
  double t_min;
  double t;  // of the nearest hit so far, or the end of the flight
  std::uint32_t facet;
  bool front;

  // The signed volumes of the ray with the three edges; all of one sign means a hit. The volume of
  // a common edge is the same number with the opposite sign in both facets, whatever the rounding,
  // so a ray through a closed fan meets at least one of its facets.
  void test(std::uint32_t candidate) {
    if (candidate == from) return;
    const auto& [corner_a, corner_b, corner_c] = scene->facets_[candidate];
    const Vec3d a = Vec3d(corner_a) - r;
    const Vec3d b = Vec3d(corner_b) - r;
    const Vec3d c = Vec3d(corner_c) - r;
    const double weight_a = dot(u, cross(b, c));
    const double weight_b = dot(u, cross(c, a));
    const double weight_c = dot(u, cross(a, b));
    const bool is_front = weight_a <= 0 && weight_b <= 0 && weight_c <= 0;
    const bool is_back = weight_a >= 0 && weight_b >= 0 && weight_c >= 0;
    const double sum = weight_a + weight_b + weight_c;
    if (!(is_front || is_back) || sum == 0) return;
    const double distance = dot(weight_a * a + weight_b * b + weight_c * c, u) / sum;
    if (distance < (is_front ? t_min : tiny_distance)) return;
    if (distance > t || (distance == t && candidate >= facet)) return;
    t = distance;
    facet = candidate;
    front = is_front;
  }

  static void intersect(const RTCIntersectFunctionNArguments* arguments) {
    if (arguments->valid[0] == 0) return;
    auto* nearest = reinterpret_cast<Nearest*>(arguments->context);
    nearest->test(arguments->primID);
    auto* ray_hit = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
    // Never shorter than the true distance, so that a tie is still visited.
    ray_hit->ray.tfar =
        std::min(ray_hit->ray.tfar, static_cast<float>(nearest->t) + nearest->scene->padding_);
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
    const auto& [a, b, c] = facets_[f];
    const Vec3d twice_area = cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a));
    areas_[f] = 0.5 * length(twice_area);
    normals_[f] = normalized(twice_area);
    if (!(areas_[f] > 0) || !std::isfinite(areas_[f])) {
      const Vec3f r = mesh.vertices[mesh.triangles[f][0]];
      throw InputError("flux: facet " + std::to_string(f) + " at (" + std::to_string(r.x) + ", " +
                       std::to_string(r.y) + ", " + std::to_string(r.z) +
                       ") has no area; remove such triangles first");
    }
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
    const double t_end = std::max((end_z - ray.r.z) / ray.u.z, 0.0);
    int axis = 0;
    double t_side = std::numeric_limits<double>::infinity();
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
    nearest.r = ray.r;
    nearest.u = ray.u;
    nearest.from = ray.from;
    nearest.t_min = -tiny_distance;
    nearest.t = std::min(t_side, t_end) + tiny_distance;
    nearest.facet = Ray::no_facet;
    find_nearest(nearest);
    if (nearest.facet != Ray::no_facet) {
      return {nearest.front ? Flight::End::front : Flight::End::back, nearest.facet,
              ray.r + nearest.t * ray.u, ray.u};
    }
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
  query.ray.tfar = static_cast<float>(nearest.t) + padding_;
  query.ray.time = 0;
  query.ray.mask = 0xFFFFFFFFU;
  query.ray.id = 0;
  query.ray.flags = 0;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(device_->scene, &nearest.context, &query);
}

}  // namespace scarp
