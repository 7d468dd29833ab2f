// An OpenXR runtime for Debian's loader, of which Debian has none: one headset, headless sessions, three spaces. The
// head is turned left by a quarter, so that what lies to the right in the world lies behind it.
//
// SIMULATED_XR_LACKS=headless,timespec,headset,stage,session,tracking leaves parts out, as real runtimes do.
// SIMULATED_XR_TRACE=FILE lists the calls, except those of xrGetInstanceProcAddr.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <time.h>
#include <vector>
#define XR_USE_TIMESPEC 1
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include <lightwell/geometry.hpp>

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
constexpr XrSystemId kSystem = 1;

struct Session {
  XrInstance instance;
  bool begun = false;
  std::deque<XrSessionState> events;
};
struct Space {
  XrSession session;
  XrReferenceSpaceType type;
  XrPosef pose;  ///< In the reference space.
};

struct State {
  std::mutex mutex;
  std::uint64_t last_handle = 0;
  std::set<XrInstance> instances;
  std::map<XrSession, Session> sessions;
  std::map<XrSpace, Space> spaces;
};
State& state() {
  static State all;
  return all;
}

bool lacks(std::string_view part) {
  const char* text = std::getenv("SIMULATED_XR_LACKS");
  return text != nullptr && std::string_view(text).find(part) != std::string_view::npos;
}

/// Appends a call to the file that SIMULATED_XR_TRACE names, if it names one.
void trace(const std::string& call) {
  const char* path = std::getenv("SIMULATED_XR_TRACE");
  if (path == nullptr || *path == '\0') return;
  if (std::FILE* file = std::fopen(path, "a")) {
    std::fprintf(file, "%s\n", call.c_str());
    std::fclose(file);
  }
}

/// The types of a chain, as " -> 1000700006".
std::string chained(const void* next) {
  std::string out;
  for (auto* at = static_cast<const XrBaseInStructure*>(next); at != nullptr; at = at->next)
    out += " -> " + std::to_string(static_cast<int>(at->type));
  return out;
}

template <class Handle>
Handle new_handle() {
  return reinterpret_cast<Handle>(++state().last_handle);
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

XRAPI_ATTR XrResult XRAPI_CALL create_instance(const XrInstanceCreateInfo* info, XrInstance* out) {
  std::string names;
  for (std::uint32_t i = 0; i < info->enabledExtensionCount; ++i) {
    const std::string_view name = info->enabledExtensionNames[i];
    names += " " + std::string(name);
    // As real runtimes do, so that a layer has to remove what it adds. The loader passes on debug_utils.
    const bool present = (name == XR_MND_HEADLESS_EXTENSION_NAME && !lacks("headless")) ||
                         (name == XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME && !lacks("timespec")) ||
                         name == XR_EXT_DEBUG_UTILS_EXTENSION_NAME;
    if (!present) return XR_ERROR_EXTENSION_NOT_PRESENT;
  }
  trace("xrCreateInstance" + names + chained(info->next));
  const std::lock_guard lock(state().mutex);
  *out = new_handle<XrInstance>();
  state().instances.insert(*out);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_instance(XrInstance instance) {
  trace("xrDestroyInstance");
  const std::lock_guard lock(state().mutex);
  if (state().instances.erase(instance) == 0) return XR_ERROR_HANDLE_INVALID;
  // A runtime may not be left by a session that still lives.
  return std::erase_if(state().sessions, [&](const auto& s) { return s.second.instance == instance; }) == 0
             ? XR_SUCCESS
             : XR_ERROR_CALL_ORDER_INVALID;
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

XRAPI_ATTR XrResult XRAPI_CALL poll_event(XrInstance instance, XrEventDataBuffer* out) {
  const std::lock_guard lock(state().mutex);
  for (auto& [handle, session] : state().sessions) {
    if (session.instance != instance || session.events.empty()) continue;
    XrEventDataSessionStateChanged event{};
    event.type = XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED;
    event.session = handle;
    event.state = session.events.front();
    session.events.pop_front();
    std::memcpy(out, &event, sizeof(event));
    return XR_SUCCESS;
  }
  return XR_EVENT_UNAVAILABLE;
}

XRAPI_ATTR XrResult XRAPI_CALL get_system(XrInstance, const XrSystemGetInfo*, XrSystemId* out) {
  trace("xrGetSystem");
  if (lacks("headset")) return XR_ERROR_FORM_FACTOR_UNAVAILABLE;
  *out = kSystem;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL get_system_properties(XrInstance, XrSystemId system, XrSystemProperties* out) {
  if (system != kSystem) return XR_ERROR_SYSTEM_INVALID;
  trace("xrGetSystemProperties" + chained(out->next));
  put(out->systemName, "simulated headset");
  out->systemId = kSystem;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL create_session(XrInstance instance, const XrSessionCreateInfo* info, XrSession* out) {
  trace("xrCreateSession" + chained(info->next));
  if (lacks("session")) return XR_ERROR_RUNTIME_FAILURE;
  const std::lock_guard lock(state().mutex);
  *out = new_handle<XrSession>();
  state().sessions[*out] = {instance, false, {XR_SESSION_STATE_IDLE, XR_SESSION_STATE_READY}};
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_session(XrSession session) {
  trace("xrDestroySession");
  const std::lock_guard lock(state().mutex);
  std::erase_if(state().spaces, [&](const auto& s) { return s.second.session == session; });
  return state().sessions.erase(session) == 1 ? XR_SUCCESS : XR_ERROR_HANDLE_INVALID;
}

XRAPI_ATTR XrResult XRAPI_CALL begin_session(XrSession session, const XrSessionBeginInfo*) {
  trace("xrBeginSession");
  const std::lock_guard lock(state().mutex);
  Session& begun = state().sessions.at(session);
  begun.begun = true;
  for (const XrSessionState next : {XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED})
    begun.events.push_back(next);
  return XR_SUCCESS;
}

/// 90 frames a second, shown 16 ms later.
XRAPI_ATTR XrResult XRAPI_CALL wait_frame(XrSession, const XrFrameWaitInfo*, XrFrameState* out) {
  trace("xrWaitFrame");
  constexpr std::chrono::nanoseconds kFrame{11'111'111}, kLatency{16'000'000};
  std::this_thread::sleep_for(kFrame);
  out->predictedDisplayPeriod = kFrame.count();
  out->predictedDisplayTime =
      kEpoch + (std::chrono::steady_clock::now().time_since_epoch() + kLatency) / std::chrono::nanoseconds(1);
  out->shouldRender = XR_FALSE;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL end_session(XrSession) { return XR_SUCCESS; }

XRAPI_ATTR XrResult XRAPI_CALL create_space(XrSession session, const XrReferenceSpaceCreateInfo* info, XrSpace* out) {
  trace("xrCreateReferenceSpace " + std::to_string(static_cast<int>(info->referenceSpaceType)));
  if (info->referenceSpaceType == XR_REFERENCE_SPACE_TYPE_STAGE && lacks("stage"))
    return XR_ERROR_REFERENCE_SPACE_UNSUPPORTED;
  const std::lock_guard lock(state().mutex);
  if (!state().sessions.contains(session)) return XR_ERROR_HANDLE_INVALID;
  *out = new_handle<XrSpace>();
  state().spaces[*out] = {session, info->referenceSpaceType, info->poseInReferenceSpace};
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_space(XrSpace space) {
  trace("xrDestroySpace");
  const std::lock_guard lock(state().mutex);
  return state().spaces.erase(space) == 1 ? XR_SUCCESS : XR_ERROR_HANDLE_INVALID;
}

lightwell::Pose pose_of(const XrPosef& pose) {
  const auto& [q, p] = pose;
  return {lightwell::Quat{q.x, q.y, q.z, q.w}.normalized(), {p.x, p.y, p.z}};
}

/// Pose in the world, in which LOCAL and STAGE are; no value while the head is not tracked.
std::optional<lightwell::Pose> in_world(const Space& space) {
  const lightwell::Pose head = pose_of({{0, 0.70710678F, 0, 0.70710678F}, {1, 1.6F, -2}});
  if (space.type != XR_REFERENCE_SPACE_TYPE_VIEW) return pose_of(space.pose);
  // Before its session has begun a runtime tracks nothing.
  if (!state().sessions.at(space.session).begun || lacks("tracking")) return std::nullopt;
  return compose(head, pose_of(space.pose));
}

XRAPI_ATTR XrResult XRAPI_CALL locate_space(XrSpace space, XrSpace base, XrTime time, XrSpaceLocation* out) {
  trace("xrLocateSpace");
  // It knows no other clock than its own.
  if (time < kEpoch) return XR_ERROR_TIME_INVALID;
  const std::lock_guard lock(state().mutex);
  const auto found = state().spaces.find(space), found_base = state().spaces.find(base);
  if (found == state().spaces.end() || found_base == state().spaces.end()) return XR_ERROR_HANDLE_INVALID;
  out->locationFlags = 0;
  const auto T_world_space = in_world(found->second), T_world_base = in_world(found_base->second);
  if (!T_world_space || !T_world_base) return XR_SUCCESS;
  out->locationFlags = XR_SPACE_LOCATION_ORIENTATION_VALID_BIT | XR_SPACE_LOCATION_POSITION_VALID_BIT;
  const auto [q, p] = compose(inverse(*T_world_base), *T_world_space);
  const auto f = [](double number) { return static_cast<float>(number); };
  out->pose = {{f(q.x), f(q.y), f(q.z), f(q.w)}, {f(p.x), f(p.y), f(p.z)}};
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL to_xr_time(XrInstance, const timespec* moment, XrTime* out) {
  *out = kEpoch + static_cast<XrTime>(moment->tv_sec) * 1'000'000'000 + moment->tv_nsec;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL to_timespec(XrInstance, XrTime time, timespec* out) {
  if (time < kEpoch) return XR_ERROR_TIME_INVALID;
  out->tv_sec = static_cast<time_t>((time - kEpoch) / 1'000'000'000);
  out->tv_nsec = static_cast<long>((time - kEpoch) % 1'000'000'000);
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
                                {"xrGetSystemProperties", any(get_system_properties)},
                                {"xrCreateSession", any(create_session)},
                                {"xrDestroySession", any(destroy_session)},
                                {"xrBeginSession", any(begin_session)},
                                {"xrEndSession", any(end_session)},
                                {"xrWaitFrame", any(wait_frame)},
                                {"xrCreateReferenceSpace", any(create_space)},
                                {"xrDestroySpace", any(destroy_space)},
                                {"xrLocateSpace", any(locate_space)},
                                {"xrConvertTimespecTimeToTimeKHR", any(to_xr_time)},
                                {"xrConvertTimeToTimespecTimeKHR", any(to_timespec)},
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
