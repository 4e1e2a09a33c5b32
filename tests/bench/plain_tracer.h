#pragma once

// Forward Monte Carlo as it is commonly written, for comparison: one particle after the other from
// the source to its end, rtcIntersect1 on Embree's triangles, pseudo-random numbers, sums in double
// precision. On one thread. It is kept as it is: later measurements compare with the same.

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"

namespace scarp::bench {

/// The start of a flight up to a facet, a side or the end of the domain.
struct PlainRay {
  Vec3f r;
  Vec3f u;
  float longest = 0;
};

class PlainTracer {
 public:
  /// Sides are mirrors. Lengths are in spacings of the grid.
  PlainTracer(const TriMesh& mesh, const Sides& sides, double sticking)
      : mesh_(mesh), normals_(facet_normals(mesh)), sides_(sides), sticking_(sticking) {
    const Box box = bounding_box(mesh);
    top_ = static_cast<float>(box.upper.z) + 1;
    bottom_ = static_cast<float>(box.lower.z) - 1;
    flux_.resize(mesh.triangles.size());
    device_ = rtcNewDevice("");
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree allocates, because it reads beyond the last vertex.
    auto* vertices = static_cast<Vec3f*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                sizeof(Vec3f), mesh.vertices.size()));
    auto* triangles = static_cast<Triangle*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                sizeof(Triangle), mesh.triangles.size()));
    std::copy(mesh.vertices.begin(), mesh.vertices.end(), vertices);
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }

  ~PlainTracer() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }

  PlainTracer(const PlainTracer&) = delete;
  PlainTracer& operator=(const PlainTracer&) = delete;

  /// Follows particles of a cosine source until they stick or leave; those of little weight play
  /// roulette. Returns the number of flights between facets; side crossings are not counted, but
  /// they split a flight in the record.
  std::uint64_t trace(std::uint64_t rays, std::uint64_t seed,
                      std::vector<PlainRay>* record = nullptr) {
    state_ = seed;
    record_ = record;
    std::uint64_t flights = 0;
    for (std::uint64_t ray = 0; ray < rays; ++ray) flights += follow_particle();
    return flights;
  }

  /// Flies recorded rays again, in the same order, and does nothing with what they meet. Returns
  /// how many met a facet.
  std::uint64_t fly_again(const std::vector<PlainRay>& rays) const {
    std::uint64_t hits = 0;
    for (const PlainRay& ray : rays)
      if (intersect(ray).hit.geomID != RTC_INVALID_GEOMETRY_ID) ++hits;
    return hits;
  }

  /// The weight that arrived on each facet.
  const std::vector<double>& arrived() const { return flux_; }

 private:
  static constexpr float off_facet = 1e-3F;
  static constexpr double roulette_below = 0.1;
  static constexpr double roulette_weight = 0.3;

  double uniform() {  // SplitMix64
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }

  Vec3f sample_cosine(Vec3f n) {
    const double square = uniform();
    const double azimuth = 2 * std::numbers::pi * uniform();
    const auto x = static_cast<float>(std::sqrt(square) * std::cos(azimuth));
    const auto y = static_cast<float>(std::sqrt(square) * std::sin(azimuth));
    const auto z = static_cast<float>(std::sqrt(1 - square)) + 1e-6F;
    const Vec3f across = std::abs(n.x) > 0.5F ? Vec3f{0, 1, 0} : Vec3f{1, 0, 0};
    const Vec3f tangent = normalized(cross(across, n));
    return normalized(x * tangent + y * cross(n, tangent) + z * n);
  }

  RTCRayHit intersect(const PlainRay& ray) const {
    RTCRayHit query;
    query.ray.org_x = ray.r.x;
    query.ray.org_y = ray.r.y;
    query.ray.org_z = ray.r.z;
    query.ray.dir_x = ray.u.x;
    query.ray.dir_y = ray.u.y;
    query.ray.dir_z = ray.u.z;
    query.ray.tnear = 0;
    query.ray.tfar = ray.longest;
    query.ray.time = 0;
    query.ray.mask = 0xFFFFFFFFU;
    query.ray.id = 0;
    query.ray.flags = 0;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &query);
    return query;
  }

  // The facet at the end of a flight, or no_facet above and below the domain.
  std::uint32_t fly(Vec3f& r, Vec3f& u) {
    for (;;) {
      float longest = ((u.z > 0 ? top_ : bottom_) - r.z) / u.z;
      int side = -1;
      for (int axis = 0; axis < 2; ++axis) {
        if (u[axis] == 0) continue;
        const auto end = static_cast<float>(u[axis] > 0 ? sides_.upper[axis] : sides_.lower[axis]);
        const float t = std::max((end - r[axis]) / u[axis], 0.0F);
        if (t >= longest) continue;
        longest = t;
        side = axis;
      }
      const PlainRay ray{r, u, longest};
      if (record_ != nullptr) record_->push_back(ray);
      const RTCRayHit query = intersect(ray);
      r += query.ray.tfar * u;
      if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) return query.hit.primID;
      if (side < 0) return no_facet;
      u[side] = -u[side];
    }
  }

  std::uint64_t follow_particle() {
    Vec3f r{static_cast<float>(sides_.lower[0] + uniform() * sides_.width(0)),
            static_cast<float>(sides_.lower[1] + uniform() * sides_.width(1)), top_};
    Vec3f u = sample_cosine({0, 0, -1});
    double weight = 1;
    for (std::uint64_t flights = 1;; ++flights) {
      const std::uint32_t f = fly(r, u);
      if (f == no_facet) return flights;
      flux_[f] += weight;
      weight *= 1 - sticking_;
      if (weight < roulette_below) {
        if (uniform() * roulette_weight >= weight) return flights;
        weight = roulette_weight;
      }
      const Vec3f n(normals_[f]);
      r += off_facet * n;
      u = sample_cosine(n);
    }
  }

  static constexpr std::uint32_t no_facet = std::numeric_limits<std::uint32_t>::max();

  const TriMesh& mesh_;
  std::vector<Vec3f> normals_;
  Sides sides_;
  double sticking_;
  float top_ = 0;
  float bottom_ = 0;
  std::vector<double> flux_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  std::uint64_t state_ = 0;
  std::vector<PlainRay>* record_ = nullptr;
};

}  // namespace scarp::bench
