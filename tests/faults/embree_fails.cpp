// Loaded before Embree (LD_PRELOAD): the scene number EMBREE_FAILS_AT is not built, and the device
// is told that there was no memory, as Embree would tell it.
#include <dlfcn.h>
#include <embree3/rtcore.h>

#include <atomic>
#include <cstdlib>
#include <map>
#include <mutex>
#include <utility>

namespace {

std::mutex mutex;
std::map<RTCDevice, std::pair<RTCErrorFunction, void*>> listeners;
std::atomic<int> scenes = 0;

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" void rtcSetDeviceErrorFunction(RTCDevice device, RTCErrorFunction error, void* user) {
  const std::lock_guard lock(mutex);
  listeners[device] = {error, user};
  next<decltype(&rtcSetDeviceErrorFunction)>("rtcSetDeviceErrorFunction")(device, error, user);
}

extern "C" void rtcCommitScene(RTCScene scene) {
  const char* const at = std::getenv("EMBREE_FAILS_AT");
  if (at == nullptr || ++scenes != std::atoi(at)) {
    next<decltype(&rtcCommitScene)>("rtcCommitScene")(scene);
    return;
  }
  const RTCDevice device = next<decltype(&rtcGetSceneDevice)>("rtcGetSceneDevice")(scene);
  const std::lock_guard lock(mutex);
  const auto& [error, user] = listeners.at(device);
  error(user, RTC_ERROR_OUT_OF_MEMORY, "std::bad_alloc");
  next<decltype(&rtcReleaseDevice)>("rtcReleaseDevice")(device);
}
