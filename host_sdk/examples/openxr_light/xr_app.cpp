#include "xr_app.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <utility>

#include <lightwell/time.hpp>

namespace openxr_light {
namespace {

constexpr const char* kHeadless = XR_MND_HEADLESS_EXTENSION_NAME;
constexpr const char* kTimespec = XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME;

std::string number(XrResult result) { return "XrResult " + std::to_string(static_cast<int>(result)); }

/// Extensions of the runtime; empty if the loader finds none.
std::vector<XrExtensionProperties> extensions(XrResult& result) {
  std::uint32_t count = 0;
  result = xrEnumerateInstanceExtensionProperties(nullptr, 0, &count, nullptr);
  if (XR_FAILED(result)) return {};
  std::vector<XrExtensionProperties> all(count, {XR_TYPE_EXTENSION_PROPERTIES, nullptr, {}, 0});
  result = xrEnumerateInstanceExtensionProperties(nullptr, count, &count, all.data());
  if (XR_FAILED(result)) return {};
  return all;
}

bool has(const std::vector<XrExtensionProperties>& all, std::string_view name) {
  return std::any_of(all.begin(), all.end(), [&](const auto& e) { return name == e.extensionName; });
}

template <std::size_t N>
void put(char (&field)[N], std::string_view text) {
  const std::size_t length = std::min(text.size(), N - 1);
  std::memcpy(field, text.data(), length);
  field[length] = '\0';
}

}  // namespace

XrApp::XrApp() { (void)(create_instance() && create_session() && create_spaces()); }

XrApp::~XrApp() {
  if (view_ != XR_NULL_HANDLE) xrDestroySpace(view_);
  if (world_ != XR_NULL_HANDLE) xrDestroySpace(world_);
  if (session_ != XR_NULL_HANDLE) xrDestroySession(session_);
  if (instance_ != XR_NULL_HANDLE) xrDestroyInstance(instance_);
}

void XrApp::lacks(std::string what) { missing_.push_back(std::move(what)); }

std::string XrApp::failed(const char* call, XrResult result) const {
  char text[XR_MAX_RESULT_STRING_SIZE] = {};
  if (instance_ != XR_NULL_HANDLE && XR_SUCCEEDED(xrResultToString(instance_, result, text)))
    return std::string(call) + ": " + text;
  return std::string(call) + ": " + number(result);
}

bool XrApp::create_instance() {
  XrResult result = XR_SUCCESS;
  const auto available = extensions(result);
  if (XR_FAILED(result)) {
    lacks("no OpenXR runtime (" + failed("xrEnumerateInstanceExtensionProperties", result) +
          "): install one, or name its manifest in XR_RUNTIME_JSON");
    return false;
  }
  headless_ = has(available, kHeadless);
  timespec_ = has(available, kTimespec);
  std::vector<const char*> wanted;
  if (headless_) wanted.push_back(kHeadless);
  if (timespec_) wanted.push_back(kTimespec);

  XrInstanceCreateInfo info{};
  info.type = XR_TYPE_INSTANCE_CREATE_INFO;
  put(info.applicationInfo.applicationName, "openxr_light");
  put(info.applicationInfo.engineName, "Lightwell");
  info.applicationInfo.apiVersion = XR_CURRENT_API_VERSION;
  info.enabledExtensionCount = static_cast<std::uint32_t>(wanted.size());
  info.enabledExtensionNames = wanted.data();
  result = xrCreateInstance(&info, &instance_);
  if (XR_FAILED(result)) {
    instance_ = XR_NULL_HANDLE;
    lacks("no instance (" + failed("xrCreateInstance", result) + "): is the runtime's service running?");
    return false;
  }
  XrInstanceProperties properties{};
  properties.type = XR_TYPE_INSTANCE_PROPERTIES;
  if (XR_SUCCEEDED(xrGetInstanceProperties(instance_, &properties)))
    runtime_ = std::string(properties.runtimeName) + " " + std::to_string(XR_VERSION_MAJOR(properties.runtimeVersion)) +
               "." + std::to_string(XR_VERSION_MINOR(properties.runtimeVersion));
  if (!timespec_) {
    lacks(std::string("the runtime has no ") + kTimespec + ": light is stamped in CLOCK_MONOTONIC only");
  } else if (const XrResult found = xrGetInstanceProcAddr(instance_, "xrConvertTimespecTimeToTimeKHR",
                                                          reinterpret_cast<PFN_xrVoidFunction*>(&to_xr_time_));
             XR_FAILED(found)) {
    to_xr_time_ = nullptr;
    lacks(failed("xrConvertTimespecTimeToTimeKHR", found));
  }
  return true;
}

bool XrApp::create_session() {
  if (!headless_) {
    lacks(std::string("the runtime has no ") + kHeadless +
          ": a session needs graphics there, which this sample does not have; the light is the same");
    return false;
  }
  XrSystemGetInfo get{};
  get.type = XR_TYPE_SYSTEM_GET_INFO;
  get.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  XrSystemId system = XR_NULL_SYSTEM_ID;
  XrResult result = xrGetSystem(instance_, &get, &system);
  if (XR_FAILED(result)) {
    lacks("no headset (" + failed("xrGetSystem", result) + "): plug one in, or simulate one");
    return false;
  }
  XrSessionCreateInfo info{};
  info.type = XR_TYPE_SESSION_CREATE_INFO;
  info.systemId = system;
  result = xrCreateSession(instance_, &info, &session_);
  if (XR_FAILED(result)) {
    session_ = XR_NULL_HANDLE;
    lacks("no session (" + failed("xrCreateSession", result) + ")");
    return false;
  }
  return true;
}

XrSpace XrApp::make_space(XrReferenceSpaceType type) const {
  XrReferenceSpaceCreateInfo info{};
  info.type = XR_TYPE_REFERENCE_SPACE_CREATE_INFO;
  info.referenceSpaceType = type;
  info.poseInReferenceSpace.orientation.w = 1;
  XrSpace space = XR_NULL_HANDLE;
  if (XR_FAILED(xrCreateReferenceSpace(session_, &info, &space))) return XR_NULL_HANDLE;
  return space;
}

bool XrApp::create_spaces() {
  world_name_ = "STAGE";
  world_ = make_space(XR_REFERENCE_SPACE_TYPE_STAGE);
  if (world_ == XR_NULL_HANDLE) {
    world_name_ = "LOCAL";
    world_ = make_space(XR_REFERENCE_SPACE_TYPE_LOCAL);
  }
  view_ = make_space(XR_REFERENCE_SPACE_TYPE_VIEW);
  if (world_ != XR_NULL_HANDLE && view_ != XR_NULL_HANDLE) return true;
  world_name_.clear();
  lacks("the runtime cannot create reference spaces");
  return false;
}

bool XrApp::poll_events() {
  if (instance_ == XR_NULL_HANDLE) return true;
  for (;;) {
    XrEventDataBuffer event{};
    event.type = XR_TYPE_EVENT_DATA_BUFFER;
    if (xrPollEvent(instance_, &event) != XR_SUCCESS) return !ended_;
    if (event.type == XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING) ended_ = true;
    if (event.type != XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED) continue;
    XrEventDataSessionStateChanged changed{};
    std::memcpy(&changed, &event, sizeof(changed));
    if (changed.state == XR_SESSION_STATE_READY) {
      XrSessionBeginInfo begin{};
      begin.type = XR_TYPE_SESSION_BEGIN_INFO;
      // A headless session ignores it, but the structure requires a value.
      begin.primaryViewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
      if (const XrResult result = xrBeginSession(session_, &begin); XR_FAILED(result))
        lacks(failed("xrBeginSession", result));
    } else if (changed.state == XR_SESSION_STATE_STOPPING) {
      xrEndSession(session_);
    } else if (changed.state == XR_SESSION_STATE_EXITING || changed.state == XR_SESSION_STATE_LOSS_PENDING) {
      ended_ = true;
    }
  }
}

std::optional<lightwell::Pose> XrApp::view_in_world() const {
  if (view_ == XR_NULL_HANDLE || world_ == XR_NULL_HANDLE || to_xr_time_ == nullptr) return std::nullopt;
  const auto when = xr_time(lightwell::monotonic_now_ns());
  if (!when) return std::nullopt;
  XrSpaceLocation location{};
  location.type = XR_TYPE_SPACE_LOCATION;
  if (XR_FAILED(xrLocateSpace(view_, world_, *when, &location))) return std::nullopt;
  if ((location.locationFlags & XR_SPACE_LOCATION_ORIENTATION_VALID_BIT) == 0) return std::nullopt;
  return pose_of(location.pose);
}

std::optional<XrTime> XrApp::xr_time(std::int64_t monotonic_ns) const {
  if (to_xr_time_ == nullptr || monotonic_ns <= 0) return std::nullopt;
  timespec moment{};
  moment.tv_sec = static_cast<time_t>(monotonic_ns / 1'000'000'000);
  moment.tv_nsec = static_cast<long>(monotonic_ns % 1'000'000'000);
  XrTime time = 0;
  if (XR_FAILED(to_xr_time_(instance_, &moment, &time))) return std::nullopt;
  return time;
}

}  // namespace openxr_light
