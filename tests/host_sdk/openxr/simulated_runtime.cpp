// An OpenXR runtime for Debian's loader, of which Debian has none: one headset, headless sessions, three spaces. The
// head is turned left by a quarter, so that what lies to the right in the world lies behind it.
//
// SIMULATED_XR_LACKS=headless,timespec,headset,stage,session leaves parts out, as real runtimes do.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <string>
#include <string_view>
#include <time.h>
#include <vector>
#define XR_USE_TIMESPEC 1
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

namespace {

// What loader and runtime say to each other first: OpenXR loader design, "Loader/Runtime interface", version 1.
struct LoaderInfo {
  std::uint32_t type, version;
  std::size_t size;
  std::uint32_t min_interface, max_interface;
  XrVersion min_api, max_api;
};
struct RuntimeRequest {
  std::uint32_t type, version;
  std::size_t size;
  std::uint32_t interface_version;
  XrVersion api;
  PFN_xrGetInstanceProcAddr get_proc;
};
constexpr std::uint32_t kLoaderInfo = 1, kRuntimeRequest = 3, kInterface = 1;

/// Far from the machine's clocks, so that a missing conversion is detected.
constexpr XrTime kEpoch = 5'000'000'000'000'000'000;

struct State {
  bool instance = false, session = false, begun = false;
  std::deque<XrSessionState> events;
  std::vector<XrReferenceSpaceType> spaces;
};
State& state() {
  static State all;
  return all;
}

bool lacks(std::string_view part) {
  const char* text = std::getenv("SIMULATED_XR_LACKS");
  return text != nullptr && std::string_view(text).find(part) != std::string_view::npos;
}

template <class Handle>
Handle handle(std::uint64_t number) {
  return reinterpret_cast<Handle>(number);
}

template <std::size_t N>
void put(char (&field)[N], const char* text) {
  std::strncpy(field, text, N - 1);
  field[N - 1] = '\0';
}

XRAPI_ATTR XrResult XRAPI_CALL extensions(const char*, std::uint32_t capacity, std::uint32_t* count,
                                          XrExtensionProperties* out) {
  std::vector<const char*> names;
  if (!lacks("headless")) names.push_back(XR_MND_HEADLESS_EXTENSION_NAME);
  if (!lacks("timespec")) names.push_back(XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME);
  *count = static_cast<std::uint32_t>(names.size());
  if (capacity == 0) return XR_SUCCESS;
  if (capacity < names.size()) return XR_ERROR_SIZE_INSUFFICIENT;
  for (std::size_t i = 0; i < names.size(); ++i) {
    put(out[i].extensionName, names[i]);
    out[i].extensionVersion = 1;
  }
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL create_instance(const XrInstanceCreateInfo*, XrInstance* out) {
  state() = {};
  state().instance = true;
  *out = handle<XrInstance>(1);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_instance(XrInstance) {
  // A runtime may not be left by a session that still lives.
  const bool in_order = state().instance && !state().session;
  state() = {};
  return in_order ? XR_SUCCESS : XR_ERROR_CALL_ORDER_INVALID;
}

XRAPI_ATTR XrResult XRAPI_CALL instance_properties(XrInstance, XrInstanceProperties* out) {
  put(out->runtimeName, "simulated");
  out->runtimeVersion = XR_MAKE_VERSION(4, 2, 0);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL result_to_string(XrInstance, XrResult value, char out[XR_MAX_RESULT_STRING_SIZE]) {
  const char* name = value == XR_ERROR_FORM_FACTOR_UNAVAILABLE ? "XR_ERROR_FORM_FACTOR_UNAVAILABLE"
                     : value == XR_ERROR_RUNTIME_FAILURE       ? "XR_ERROR_RUNTIME_FAILURE"
                                                               : "XR_UNKNOWN";
  std::strncpy(out, name, XR_MAX_RESULT_STRING_SIZE - 1);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL poll_event(XrInstance, XrEventDataBuffer* out) {
  if (state().events.empty()) return XR_EVENT_UNAVAILABLE;
  XrEventDataSessionStateChanged event{};
  event.type = XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED;
  event.state = state().events.front();
  state().events.pop_front();
  std::memcpy(out, &event, sizeof(event));
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL get_system(XrInstance, const XrSystemGetInfo*, XrSystemId* out) {
  if (lacks("headset")) return XR_ERROR_FORM_FACTOR_UNAVAILABLE;
  *out = 1;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL create_session(XrInstance, const XrSessionCreateInfo*, XrSession* out) {
  if (lacks("session")) return XR_ERROR_RUNTIME_FAILURE;
  state().session = true;
  state().events = {XR_SESSION_STATE_IDLE, XR_SESSION_STATE_READY};
  *out = handle<XrSession>(2);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_session(XrSession) {
  state().session = false;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL begin_session(XrSession, const XrSessionBeginInfo*) {
  state().begun = true;
  for (const XrSessionState next : {XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED})
    state().events.push_back(next);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL end_session(XrSession) { return XR_SUCCESS; }

XRAPI_ATTR XrResult XRAPI_CALL create_space(XrSession, const XrReferenceSpaceCreateInfo* info, XrSpace* out) {
  if (info->referenceSpaceType == XR_REFERENCE_SPACE_TYPE_STAGE && lacks("stage"))
    return XR_ERROR_REFERENCE_SPACE_UNSUPPORTED;
  state().spaces.push_back(info->referenceSpaceType);
  *out = handle<XrSpace>(10 + state().spaces.size());
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_space(XrSpace) { return XR_SUCCESS; }

XRAPI_ATTR XrResult XRAPI_CALL locate_space(XrSpace space, XrSpace, XrTime time, XrSpaceLocation* out) {
  // Before its session has begun a runtime tracks nothing, and it knows no other clock than its own.
  if (time < kEpoch) return XR_ERROR_TIME_INVALID;
  const auto index = reinterpret_cast<std::uint64_t>(space) - 11;
  out->locationFlags = 0;
  if (!state().begun || index >= state().spaces.size() || state().spaces[index] != XR_REFERENCE_SPACE_TYPE_VIEW)
    return XR_SUCCESS;
  out->locationFlags = XR_SPACE_LOCATION_ORIENTATION_VALID_BIT | XR_SPACE_LOCATION_POSITION_VALID_BIT;
  out->pose = {{0, 0.70710678F, 0, 0.70710678F}, {1, 1.6F, -2}};
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL to_xr_time(XrInstance, const timespec* moment, XrTime* out) {
  *out = kEpoch + static_cast<XrTime>(moment->tv_sec) * 1'000'000'000 + moment->tv_nsec;
  return XR_SUCCESS;
}

struct Entry {
  std::string_view name;
  PFN_xrVoidFunction function;
};

template <class F>
PFN_xrVoidFunction any(F* function) {
  return reinterpret_cast<PFN_xrVoidFunction>(function);
}

XRAPI_ATTR XrResult XRAPI_CALL get_proc(XrInstance, const char* name, PFN_xrVoidFunction* out) {
  static const Entry table[] = {{"xrEnumerateInstanceExtensionProperties", any(extensions)},
                                {"xrCreateInstance", any(create_instance)},
                                {"xrDestroyInstance", any(destroy_instance)},
                                {"xrGetInstanceProperties", any(instance_properties)},
                                {"xrResultToString", any(result_to_string)},
                                {"xrPollEvent", any(poll_event)},
                                {"xrGetSystem", any(get_system)},
                                {"xrCreateSession", any(create_session)},
                                {"xrDestroySession", any(destroy_session)},
                                {"xrBeginSession", any(begin_session)},
                                {"xrEndSession", any(end_session)},
                                {"xrCreateReferenceSpace", any(create_space)},
                                {"xrDestroySpace", any(destroy_space)},
                                {"xrLocateSpace", any(locate_space)},
                                {"xrConvertTimespecTimeToTimeKHR", any(to_xr_time)},
                                {"xrGetInstanceProcAddr", any(get_proc)}};
  for (const Entry& entry : table)
    if (entry.name == name) {
      *out = entry.function;
      return XR_SUCCESS;
    }
  *out = nullptr;
  return XR_ERROR_FUNCTION_UNSUPPORTED;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) XrResult xrNegotiateLoaderRuntimeInterface(const LoaderInfo* loader,
                                                                                             RuntimeRequest* runtime) {
  if (loader == nullptr || runtime == nullptr || loader->type != kLoaderInfo || runtime->type != kRuntimeRequest ||
      loader->min_interface > kInterface || loader->max_interface < kInterface)
    return XR_ERROR_INITIALIZATION_FAILED;
  runtime->interface_version = kInterface;
  runtime->api = XR_CURRENT_API_VERSION;
  runtime->get_proc = get_proc;
  return XR_SUCCESS;
}
