#include "flux/rays/embree_tree.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/system/huge_pages.h"
#include "core/tri_mesh.h"
#include "flux/rays/facet_pack.h"

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
struct ReleaseHierarchy {
  void operator()(RTCBVH hierarchy) const { rtcReleaseBVH(hierarchy); }
};
using Hierarchy = std::unique_ptr<RTCBVHTy, ReleaseHierarchy>;
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
  LargeVector<FacetPack> packs;
};

void add(const SceneFacet& facet, Box& box) {
  for (const Vec3f& corner : facet.corners) box.add(Vec3d(corner));
}

// The leaves of a hierarchy of Embree's: neighbours with little air between them.
class Leaves {
 public:
  Leaves(RTCDevice device, std::span<const SceneFacet> facets) : leaves_(facets.size()) {
    if (facets.empty()) return;
    std::vector<RTCBuildPrimitive> boxes(facets.size());
    for (std::size_t f = 0; f < facets.size(); ++f) boxes[f] = box_of(facets[f], f);
    const Hierarchy hierarchy(rtcNewBVH(device));
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.bvh = hierarchy.get();
    arguments.primitives = boxes.data();
    arguments.primitiveCount = boxes.size();
    arguments.primitiveArrayCapacity = boxes.size();
    arguments.maxDepth = most_levels;
    arguments.sahBlockSize = FacetPack::most;
    arguments.maxLeafSize = FacetPack::most;
    arguments.createNode = [](RTCThreadLocalAllocator, unsigned, void* self) { return self; };
    arguments.setNodeChildren = [](void*, void**, unsigned, void*) {};
    arguments.setNodeBounds = [](void*, const RTCBounds**, unsigned, void*) {};
    arguments.createLeaf = keep_leaf;
    arguments.userPtr = this;
    rtcBuildBVH(&arguments);
  }

  LargeVector<FacetPack> packs(std::span<const SceneFacet> facets, double room) const {
    LargeVector<FacetPack> packs;
    packs.reserve(count_);
    for (const Leaf& leaf : std::span(leaves_).first(count_))
      packs.emplace_back(facets, std::span(leaf.facets).first(leaf.count), room);
    return packs;
  }

 private:
  struct Leaf {
    std::array<std::uint32_t, FacetPack::most> facets;
    std::size_t count;
  };

  // Deeper than facets of any mesh are nested: beyond it Embree fails.
  static constexpr unsigned most_levels = 256;

  static RTCBuildPrimitive box_of(const SceneFacet& facet, std::size_t index) {
    Box box;
    add(facet, box);
    const Vec3f lower(box.lower);
    const Vec3f upper(box.upper);
    return {lower.x, lower.y, lower.z, 0, upper.x, upper.y, upper.z, static_cast<unsigned>(index)};
  }

  // On any thread.
  static void* keep_leaf(RTCThreadLocalAllocator, const RTCBuildPrimitive* boxes, std::size_t count,
                         void* self) {
    auto& leaves = *static_cast<Leaves*>(self);
    Leaf& leaf = leaves.leaves_[leaves.count_++];
    leaf.count = count;
    for (std::size_t k = 0; k < count; ++k) leaf.facets[k] = boxes[k].primID;
    return self;
  }

  std::vector<Leaf> leaves_;
  std::atomic<std::size_t> count_ = 0;
};

void find_box(const RTCBoundsFunctionArguments* arguments) {
  const auto& all = *static_cast<const Facets*>(arguments->geometryUserPtr);
  const FacetPack& pack = all.packs[arguments->primID];
  Box box;
  for (std::size_t k = 0; k < FacetPack::most; ++k) add(all.facets[pack.facets[k]], box);
  const Vec3f lower(box.lower);
  const Vec3f upper(box.upper);
  RTCBounds& padded = *arguments->bounds_o;
  padded.lower_x = lower.x - all.padding;
  padded.lower_y = lower.y - all.padding;
  padded.lower_z = lower.z - all.padding;
  padded.upper_x = upper.x + all.padding;
  padded.upper_y = upper.y + all.padding;
  padded.upper_z = upper.z + all.padding;
}

// How far the tree is searched: what is as far away as t, but for rounding, counts as well.
float reach(double t, float padding) { return static_cast<float>(t) + padding; }

// Embree hands the context of a call on to the function that tests a pack.
struct Search {
  RTCIntersectContext context;
  NearestFacet& nearest;
  PackView view;
};

bool is_empty(const PackView::Mask& mask) {
  const auto [low, high] = std::bit_cast<std::array<std::uint64_t, 2>>(mask);
  return (low | high) == 0;
}

// Seldom needed: apart, it leaves the look at a pack short.
[[gnu::noinline, gnu::flatten]] void test_facets(const RTCIntersectFunctionNArguments* arguments,
                                                 const PackView::Mask& may_meet) {
  const auto& all = *static_cast<const Facets*>(arguments->geometryUserPtr);
  const FacetPack& pack = all.packs[arguments->primID];
  NearestFacet& nearest = reinterpret_cast<Search*>(arguments->context)->nearest;
  bool is_taken = false;
  for (std::size_t k = 0; k < FacetPack::most; ++k) {
    if (may_meet[k] == 0) continue;
    is_taken |= nearest.test(all.facets[pack.facets[k]], pack.facets[k]);
  }
  if (!is_taken) return;
  float& farthest = RTCRayN_tfar(reinterpret_cast<RTCRayN*>(arguments->rayhit), 1, 0);
  farthest = std::min(farthest, reach(nearest.t_nearest(), all.padding));
}

[[gnu::flatten]] void test_pack(const RTCIntersectFunctionNArguments* arguments) {
  const auto& all = *static_cast<const Facets*>(arguments->geometryUserPtr);
  const PackView& view = reinterpret_cast<Search*>(arguments->context)->view;
  const PackView::Mask may_meet = view.may_meet(all.packs[arguments->primID]);
  if (!is_empty(may_meet)) test_facets(arguments, may_meet);
}

// A vector and the 0 behind it in one: Embree reads them at once, and would have to wait for
// numbers that were written one by one.
void write(const Vec3d& v, std::size_t offset, RTCRay& ray) {
  using Numbers [[gnu::vector_size(4 * sizeof(float))]] = float;
  const Numbers numbers{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z),
                        0};
  std::memcpy(reinterpret_cast<std::byte*>(&ray) + offset, &numbers, sizeof(numbers));
}
static_assert(offsetof(RTCRay, tnear) == offsetof(RTCRay, org_x) + 3 * sizeof(float));
static_assert(offsetof(RTCRay, time) == offsetof(RTCRay, dir_x) + 3 * sizeof(float));

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
  settle_arithmetic();
  // A device of its own, .1 ms: trees share no state, and an error belongs to one of them.
  embree_->device.reset(
      rtcNewDevice(configuration.empty() ? default_configuration : configuration.c_str()));
  RTCDeviceTy* const device = embree_->device.get();
  if (device == nullptr) throw embree_error(rtcGetDeviceError(nullptr), "");
  rtcSetDeviceErrorFunction(device, FirstError::note, &embree_->error);
  embree_->facets = {facets, padding_, Leaves(device, facets).packs(facets, 0.5 * padding_)};
  embree_->error.require_none();
  embree_->scene.reset(rtcNewScene(device));
  RTCSceneTy* const scene = embree_->scene.get();
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  // The lowest leaves several packs without a box of their own.
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  const Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
  rtcSetGeometryUserPrimitiveCount(geometry.get(),
                                   static_cast<unsigned>(embree_->facets.packs.size()));
  rtcSetGeometryUserData(geometry.get(), &embree_->facets);
  rtcSetGeometryBoundsFunction(geometry.get(), find_box, nullptr);
  rtcSetGeometryIntersectFunction(geometry.get(), test_pack);
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
  Search search{.context = {}, .nearest = nearest, .view = PackView(nearest.view(), ray.from)};
  rtcInitIntersectContext(&search.context);
  RTCRayHit sent;
  write(ray.r, offsetof(RTCRay, org_x), sent.ray);
  write(ray.u, offsetof(RTCRay, dir_x), sent.ray);
  sent.ray.tfar = reach(t_end, padding_);
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
