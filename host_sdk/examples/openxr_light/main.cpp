// An OpenXR application that gets its lighting from a probe instead of XR_ANDROID_light_estimation.
//
//   openxr_light URI [--frames N] [--world-probe QX,QY,QZ,QW] [--total] [--require-session]
//
// It runs headless (XR_MND_headless), without graphics, and prints what it would upload each frame. Without a runtime,
// or if a part of it is missing, it prints a message and continues with the available parts.
//
// exit status: 0 done, 1 the probe cannot be reached or was lost, 2 usage, 3 no session, with --require-session.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iomanip>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/conventions.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/time.hpp>

// Selects the parts of the platform header, and the system's time type.
#include <time.h>
#define XR_USE_TIMESPEC 1
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

namespace {

using lightwell::Converted;
using lightwell::Lighting;
using lightwell::OpenXrLightEstimate;
using lightwell::Pose;
using lightwell::XrLightEstimateState;
using lightwell::XrSphericalHarmonicsKind;

// Instance, headless session, spaces and time of OpenXR.

/// OpenXR has the same axes, quaternion order and handedness as Lightwell.
Pose pose_of(const XrPosef& pose) {
  return {{pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w},
          {pose.position.x, pose.position.y, pose.position.z}};
}

constexpr const char* kHeadless = XR_MND_HEADLESS_EXTENSION_NAME;
constexpr const char* kTimespec = XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME;

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

/// One thread. Everything is destroyed in the order that OpenXR requires.
class XrApp {
 public:
  /// Initialises as far as loader and runtime allow. Never fails: missing() lists what is not available.
  XrApp() { (void)(create_instance() && create_session() && create_spaces()); }

  ~XrApp() {
    if (view_ != XR_NULL_HANDLE) xrDestroySpace(view_);
    if (world_ != XR_NULL_HANDLE) xrDestroySpace(world_);
    if (session_ != XR_NULL_HANDLE) xrDestroySession(session_);
    if (instance_ != XR_NULL_HANDLE) xrDestroyInstance(instance_);
  }
  XrApp(const XrApp&) = delete;
  XrApp& operator=(const XrApp&) = delete;

  /// One message for each missing part, with the remedy; empty if all are available.
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }

  /// Name and version of the runtime; empty without an instance.
  [[nodiscard]] const std::string& runtime() const { return runtime_; }

  /// The reference space of the world: "STAGE", or "LOCAL" if the runtime has no stage; empty without a session.
  [[nodiscard]] const std::string& world_space() const { return world_name_; }

  /// Handles the runtime's events; false once it has asked the application to end.
  [[nodiscard]] bool poll_events() {
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

  /// T_world_view, the head pose in world space. No value without a session, and while the head is not tracked.
  [[nodiscard]] std::optional<Pose> view_in_world() const {
    if (view_ == XR_NULL_HANDLE || world_ == XR_NULL_HANDLE || to_xr_time_ == nullptr) return std::nullopt;
    const auto when = xr_time(lightwell::monotonic_now_ns());
    if (!when) return std::nullopt;
    XrSpaceLocation location{};
    location.type = XR_TYPE_SPACE_LOCATION;
    if (XR_FAILED(xrLocateSpace(view_, world_, *when, &location))) return std::nullopt;
    if ((location.locationFlags & XR_SPACE_LOCATION_ORIENTATION_VALID_BIT) == 0) return std::nullopt;
    return pose_of(location.pose);
  }

  /// Converts a time of CLOCK_MONOTONIC (lightwell::HostTime) to the runtime's time. No value if the runtime lacks
  /// XR_KHR_convert_timespec_time.
  [[nodiscard]] std::optional<XrTime> xr_time(std::int64_t monotonic_ns) const {
    if (to_xr_time_ == nullptr || monotonic_ns <= 0) return std::nullopt;
    timespec moment{};
    moment.tv_sec = static_cast<time_t>(monotonic_ns / 1'000'000'000);
    moment.tv_nsec = static_cast<long>(monotonic_ns % 1'000'000'000);
    XrTime time = 0;
    if (XR_FAILED(to_xr_time_(instance_, &moment, &time))) return std::nullopt;
    return time;
  }

 private:
  [[nodiscard]] bool create_instance() {
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
    std::string_view("openxr_light").copy(info.applicationInfo.applicationName, XR_MAX_APPLICATION_NAME_SIZE - 1);
    std::string_view("Lightwell").copy(info.applicationInfo.engineName, XR_MAX_ENGINE_NAME_SIZE - 1);
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
      runtime_ = std::string(properties.runtimeName) + " " +
                 std::to_string(XR_VERSION_MAJOR(properties.runtimeVersion)) + "." +
                 std::to_string(XR_VERSION_MINOR(properties.runtimeVersion));
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

  [[nodiscard]] bool create_session() {
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

  [[nodiscard]] bool create_spaces() {
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

  [[nodiscard]] XrSpace make_space(XrReferenceSpaceType type) const {
    XrReferenceSpaceCreateInfo info{};
    info.type = XR_TYPE_REFERENCE_SPACE_CREATE_INFO;
    info.referenceSpaceType = type;
    info.poseInReferenceSpace.orientation.w = 1;
    XrSpace space = XR_NULL_HANDLE;
    if (XR_FAILED(xrCreateReferenceSpace(session_, &info, &space))) return XR_NULL_HANDLE;
    return space;
  }

  void lacks(std::string what) { missing_.push_back(std::move(what)); }

  /// "xrCreateSession: XR_ERROR_...".
  [[nodiscard]] std::string failed(const char* call, XrResult result) const {
    char text[XR_MAX_RESULT_STRING_SIZE] = {};
    if (instance_ != XR_NULL_HANDLE && XR_SUCCEEDED(xrResultToString(instance_, result, text)))
      return std::string(call) + ": " + text;
    return std::string(call) + ": XrResult " + std::to_string(static_cast<int>(result));
  }

  std::vector<std::string> missing_;
  std::string runtime_, world_name_;
  bool headless_ = false, timespec_ = false, ended_ = false;
  XrInstance instance_ = XR_NULL_HANDLE;
  XrSession session_ = XR_NULL_HANDLE;
  XrSpace world_ = XR_NULL_HANDLE, view_ = XR_NULL_HANDLE;
  PFN_xrConvertTimespecTimeToTimeKHR to_xr_time_ = nullptr;
};

// What the application passes to its renderer each frame.

std::string_view name(XrLightEstimateState state) { return state == XrLightEstimateState::valid ? "VALID" : "INVALID"; }

std::ostream& operator<<(std::ostream& out, const std::array<float, 3>& v) {
  return out << v[0] << ' ' << v[1] << ' ' << v[2];
}

/// The lighting in an XrSpace S, in the form of XR_ANDROID_light_estimation.
///   lighting        of the probe, in the probe's axes
///   T_world_probe   pose of the probe in the world (STAGE or LOCAL): a measured mounting, or from a tag on the probe
///                   that the headset detects
///   T_world_space   pose of S in the world, from xrLocateSpace(S, world); the identity for the world itself
Converted<OpenXrLightEstimate> light_in_space(const Lighting& lighting, const Pose& T_world_probe,
                                              const Pose& T_world_space, XrSphericalHarmonicsKind kind) {
  const Pose T_space_probe = compose(inverse(T_world_space), T_world_probe);
  return to_openxr(lighting.in_world(T_space_probe), kind);
}

/// Prints an estimate in lines that start with `indent`.
void print(std::ostream& out, const Converted<OpenXrLightEstimate>& estimate, const char* indent) {
  const OpenXrLightEstimate& e = estimate.value;
  out << std::fixed << std::setprecision(4);
  out << indent << "state " << name(e.state) << ", " << to_string(estimate.validity);
  if (estimate.residual) out << ", residual " << *estimate.residual;
  out << '\n';
  if (!estimate.has_estimate()) return;
  out << indent << "ambient intensity " << e.ambientLight.intensity << '\n';
  out << indent << "directional " << name(e.directionalLight.state);
  if (e.directionalLight.state == XrLightEstimateState::valid)
    out << ", direction " << e.directionalLight.direction << ", intensity " << e.directionalLight.intensity;
  out << '\n'
      << indent << "harmonics " << name(e.sphericalHarmonics.state) << ", "
      << (e.sphericalHarmonics.kind == XrSphericalHarmonicsKind::total ? "TOTAL" : "AMBIENT") << '\n';
  for (const auto& coefficient : e.sphericalHarmonics.coefficients) out << indent << "  " << coefficient << '\n';
}

// Options and output.

constexpr std::chrono::milliseconds kFrame{11};

struct Options {
  std::string uri;
  int frames = 1;
  Pose T_world_probe;
  XrSphericalHarmonicsKind kind = XrSphericalHarmonicsKind::ambient;
  bool require_session = false;
};

std::optional<Pose> parsed_rotation(const char* text) {
  lightwell::Quat q;
  char rest = 0;
  if (std::sscanf(text, "%lf,%lf,%lf,%lf%c", &q.x, &q.y, &q.z, &q.w, &rest) != 4) return std::nullopt;
  const double squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(squared > 0) || !(squared < 1e12)) return std::nullopt;
  return Pose{q.normalized(), {}};
}

std::optional<Options> parsed(int argc, char** argv) {
  Options out;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool last = i + 1 == argc;
    if (word == "--frames" && !last) {
      char* end = nullptr;
      const long frames = std::strtol(argv[++i], &end, 10);
      if (*end != '\0' || frames < 1 || frames > 1'000'000) return std::nullopt;
      out.frames = static_cast<int>(frames);
    } else if (word == "--world-probe" && !last) {
      const auto pose = parsed_rotation(argv[++i]);
      if (!pose) return std::nullopt;
      out.T_world_probe = *pose;
    } else if (word == "--total") {
      out.kind = XrSphericalHarmonicsKind::total;
    } else if (word == "--require-session") {
      out.require_session = true;
    } else if (!word.starts_with("--") && out.uri.empty()) {
      out.uri = word;
    } else {
      return std::nullopt;
    }
  }
  if (out.uri.empty()) return std::nullopt;
  return out;
}

void describe(const XrApp& app) {
  std::cout << "OpenXR runtime: " << (app.runtime().empty() ? "none" : app.runtime()) << '\n';
  std::cout << "world space: " << (app.world_space().empty() ? "none" : app.world_space()) << '\n';
  for (const std::string& what : app.missing()) std::cout << "missing: " << what << '\n';
}

void show_frame(int frame, const XrApp& app, const Lighting& lighting, const Options& options) {
  std::cout << "frame " << frame << ", descriptor " << lighting.descriptor().sequence << '\n';
  std::cout << "  world:\n";
  auto world = light_in_space(lighting, options.T_world_probe, {}, options.kind);
  // lastUpdatedTime is in CLOCK_MONOTONIC; the runtime's other structures use XrTime.
  if (const auto time = app.xr_time(world.value.lastUpdatedTime)) {
    world.value.lastUpdatedTime = *time;
    std::cout << "    lastUpdatedTime " << *time << " (XrTime)\n";
  }
  print(std::cout, world, "    ");
  // For shading in view space: the same lighting in the current head frame.
  if (const auto T_world_view = app.view_in_world()) {
    std::cout << "  view:\n";
    print(std::cout, light_in_space(lighting, options.T_world_probe, *T_world_view, options.kind), "    ");
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = parsed(argc, argv);
  if (!options) {
    std::cerr << "usage: openxr_light URI [--frames N] [--world-probe QX,QY,QZ,QW] [--total] [--require-session]\n";
    return 2;
  }
  XrApp app;
  describe(app);
  if (options->require_session && app.world_space().empty()) return 3;

  const auto probe = lightwell::Probe::connect(options->uri);
  if (!probe.ok()) {
    std::cerr << probe.status().message() << '\n';
    return 1;
  }
  // A render loop would not wait; this sample waits for the first descriptor, because it has nothing else to show.
  if (const auto first = probe->wait_for_next(std::nullopt, {5'000'000'000}); !first.ok()) {
    std::cerr << first.status().message() << '\n';
    return 1;
  }
  for (int frame = 0; frame < options->frames && app.poll_events(); ++frame) {
    show_frame(frame, app, probe->latest(), *options);
    std::this_thread::sleep_for(kFrame);
  }
  return 0;
}
