#include "flux/embree_tree.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <mutex>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
struct ReleaseGeometry {
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using Device = std::unique_ptr<RTCDeviceTy, ReleaseDevice>;
using Scene = std::unique_ptr<RTCSceneTy, ReleaseScene>;
using Geometry = std::unique_ptr<RTCGeometryTy, ReleaseGeometry>;

NumericalError embree_error(RTCError code, const std::string& text) {
  if (!text.empty()) return NumericalError("flux: Embree: " + text);
  if (code == RTC_ERROR_OUT_OF_MEMORY) return NumericalError("flux: Embree: out of memory");
  return NumericalError("flux: Embree: error " + std::to_string(code));
}

// The first error of a device. Its functions do not throw: they tell from any thread.
class FirstError {
 public:
  static void note(void* self, RTCError code, const char* text) {
    auto& error = *static_cast<FirstError*>(self);
    const std::lock_guard lock(error.mutex_);
    if (error.code_ != RTC_ERROR_NONE) return;
    error.code_ = code;
    error.text_ = text == nullptr ? "" : text;
  }

  void require_none() {
    const std::lock_guard lock(mutex_);
    if (code_ != RTC_ERROR_NONE) throw embree_error(code_, text_);
  }

 private:
  std::mutex mutex_;
  RTCError code_ = RTC_ERROR_NONE;
  std::string text_;
};

// Embree builds with numbers below the least normal one taken for 0, and puts that back. A thread
// that uses TBB for the first time meanwhile would have it in all parallel loops that it starts
// later, as TBB keeps the arithmetic of the first: let that be one of ours.
void settle_arithmetic() {
  parallel_for(2, 1, [](std::size_t, std::size_t) {});
}

// AVX-512 takes a tenth longer for single rays.
const char* const default_configuration = "max_isa=avx2";

// In units of single precision, times the size of the domain.
constexpr double padding_units = 20;
static_assert(padding_units * 0x1p-24 / 2 > NearestFacet::least_room + 2 * 0x1p-24);

double padding_of(double domain_size) {
  return std::max(padding_units * 0x1p-24 * domain_size, 2 * NearestFacet::ridge_thickness);
}

// What all facets of a tree have in common.
struct Facets {
  std::span<const SceneFacet> facets;
  float padding;
};

void find_box(const RTCBoundsFunctionArguments* arguments) {
  const auto& all = *static_cast<const Facets*>(arguments->geometryUserPtr);
  const std::array<Vec3f, 3>& corners = all.facets[arguments->primID].corners;
  const auto lower = [&](float Vec3f::*axis) {
    return std::min({corners[0].*axis, corners[1].*axis, corners[2].*axis}) - all.padding;
  };
  const auto upper = [&](float Vec3f::*axis) {
    return std::max({corners[0].*axis, corners[1].*axis, corners[2].*axis}) + all.padding;
  };
  RTCBounds& box = *arguments->bounds_o;
  box.lower_x = lower(&Vec3f::x);
  box.lower_y = lower(&Vec3f::y);
  box.lower_z = lower(&Vec3f::z);
  box.upper_x = upper(&Vec3f::x);
  box.upper_y = upper(&Vec3f::y);
  box.upper_z = upper(&Vec3f::z);
}

// How far the tree is searched: what is as far away as t, but for rounding, counts as well.
float reach(double t, float padding) { return static_cast<float>(t) + padding; }

// Embree hands the context of a call on to the function that tests a facet.
struct Search {
  RTCIntersectContext context;
  NearestFacet& nearest;
};

// Flattened: a tenth of the time of a flight is in calls otherwise.
[[gnu::flatten]] void test_facet(const RTCIntersectFunctionNArguments* arguments) {
  const auto& [facets, padding] = *static_cast<const Facets*>(arguments->geometryUserPtr);
  NearestFacet& nearest = reinterpret_cast<Search*>(arguments->context)->nearest;
  if (!nearest.test(facets[arguments->primID], arguments->primID)) return;
  float& farthest = RTCRayN_tfar(reinterpret_cast<RTCRayN*>(arguments->rayhit), 1, 0);
  farthest = std::min(farthest, reach(nearest.t_nearest(), padding));
}

std::string unknown(const std::string& word, const std::string& allowed) {
  return "SCARP_EMBREE: " + in_quotes(word) + allowed;
}

void require_instructions(const std::string& word, const std::string& name) {
  const auto is_there = [&] {
    if (name == "sse2") return true;
    if (name == "sse4.2") return __builtin_cpu_supports("sse4.2") != 0;
    if (name == "avx") return __builtin_cpu_supports("avx") != 0;
    if (name == "avx2") return __builtin_cpu_supports("avx2") != 0;
    if (name == "avx512") {
      return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
             __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512bw") != 0;
    }
    throw InputError(unknown(word, ": isa is sse2, sse4.2, avx, avx2 or avx512"));
  };
  if (!is_there()) throw InputError(unknown(word, ": this processor has no such instructions"));
}

// Embree takes any text: what it does not know it passes over.
void require_known(const std::string& word) {
  const std::size_t equals = std::min(word.find('='), word.size());
  const std::string key = word.substr(0, equals);
  const std::string value = word.substr(std::min(equals + 1, word.size()));
  if (key == "isa" || key == "max_isa") return require_instructions(word, value);
  if (key != "hugepages") {
    throw InputError(unknown(word,
                             ": write key=value with isa, max_isa or hugepages, separated by "
                             "commas; threads are those of --threads"));
  }
  if (value != "0" && value != "1") throw InputError(unknown(word, ": hugepages is 0 or 1"));
}

}  // namespace

// In order of creation: a scene is released before its device, and that before what it tells.
struct EmbreeTree::Embree {
  FirstError error;
  Facets facets;
  Device device;
  Scene scene;
};

EmbreeTree::EmbreeTree(std::span<const SceneFacet> facets, double domain_size,
                       const std::string& configuration)
    : embree_(std::make_unique<Embree>()), padding_(static_cast<float>(padding_of(domain_size))) {
  embree_->facets = {facets, padding_};
  settle_arithmetic();
  // A device of its own, .1 ms: trees share no state, and an error belongs to one of them.
  embree_->device.reset(
      rtcNewDevice(configuration.empty() ? default_configuration : configuration.c_str()));
  RTCDeviceTy* const device = embree_->device.get();
  if (device == nullptr) throw embree_error(rtcGetDeviceError(nullptr), "");
  rtcSetDeviceErrorFunction(device, FirstError::note, &embree_->error);
  embree_->scene.reset(rtcNewScene(device));
  RTCSceneTy* const scene = embree_->scene.get();
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  // Higher qualities build half as long again, and flights through many facets take longer.
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
  const Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
  rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(facets.size()));
  rtcSetGeometryUserData(geometry.get(), &embree_->facets);
  rtcSetGeometryBoundsFunction(geometry.get(), find_box, nullptr);
  rtcSetGeometryIntersectFunction(geometry.get(), test_facet);
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(scene, geometry.get());
  rtcCommitScene(scene);
  embree_->error.require_none();
}

EmbreeTree::~EmbreeTree() = default;
EmbreeTree::EmbreeTree(EmbreeTree&&) noexcept = default;
EmbreeTree& EmbreeTree::operator=(EmbreeTree&&) noexcept = default;

NearestFacet EmbreeTree::nearest(const Ray& ray, double t_end) const {
  NearestFacet nearest(ray, t_end, 0.5 * padding_);
  Search search{.context = {}, .nearest = nearest};
  rtcInitIntersectContext(&search.context);
  RTCRayHit sent;
  sent.ray.org_x = static_cast<float>(ray.r.x);
  sent.ray.org_y = static_cast<float>(ray.r.y);
  sent.ray.org_z = static_cast<float>(ray.r.z);
  sent.ray.dir_x = static_cast<float>(ray.u.x);
  sent.ray.dir_y = static_cast<float>(ray.u.y);
  sent.ray.dir_z = static_cast<float>(ray.u.z);
  sent.ray.tnear = 0;
  sent.ray.tfar = reach(t_end, padding_);
  sent.ray.time = 0;
  sent.ray.mask = ~0U;
  sent.ray.id = 0;
  sent.ray.flags = 0;
  sent.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  sent.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree_->scene.get(), &search.context, &sent);
  return nearest;
}

std::string embree_configuration() {
  const char* const set = std::getenv("SCARP_EMBREE");
  const std::string configuration = set == nullptr ? "" : set;
  for (std::size_t begin = 0; begin < configuration.size();) {
    const std::size_t end = std::min(configuration.find(',', begin), configuration.size());
    require_known(configuration.substr(begin, end - begin));
    begin = end + 1;
  }
  return configuration;
}

std::string embree_version() {
  const Device device(rtcNewDevice(""));
  const auto part = [&](RTCDeviceProperty which) {
    return std::to_string(rtcGetDeviceProperty(device.get(), which));
  };
  return part(RTC_DEVICE_PROPERTY_VERSION_MAJOR) + "." + part(RTC_DEVICE_PROPERTY_VERSION_MINOR) +
         "." + part(RTC_DEVICE_PROPERTY_VERSION_PATCH);
}

}  // namespace scarp
