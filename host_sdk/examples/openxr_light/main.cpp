// An OpenXR application that gets its lighting from a probe instead of XR_ANDROID_light_estimation.
//
//   openxr_light URI [--frames N] [--world-probe QX,QY,QZ,QW] [--total] [--require-session]
//
// It runs headless (XR_MND_headless), without graphics, and prints what it would upload each frame. Without a runtime,
// or if a part of it is missing, it prints a message and continues with the available parts.
//
// exit status: 0 done, 1 the probe cannot be reached or was lost, 2 usage, 3 no session, with --require-session.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <lightwell/probe.hpp>

#include "light_upload.hpp"
#include "xr_app.hpp"

namespace {

using lightwell::Pose;
using lightwell::XrSphericalHarmonicsKind;

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

void describe(const openxr_light::XrApp& app) {
  std::cout << "OpenXR runtime: " << (app.runtime().empty() ? "none" : app.runtime()) << '\n';
  std::cout << "world space: " << (app.world_space().empty() ? "none" : app.world_space()) << '\n';
  for (const std::string& what : app.missing()) std::cout << "missing: " << what << '\n';
}

void show_frame(int frame, const openxr_light::XrApp& app, const lightwell::Lighting& lighting,
                const Options& options) {
  std::cout << "frame " << frame << ", descriptor " << lighting.descriptor().sequence << '\n';
  std::cout << "  world:\n";
  auto world = openxr_light::light_in_space(lighting, options.T_world_probe, {}, options.kind);
  // lastUpdatedTime is in CLOCK_MONOTONIC; the runtime's other structures use XrTime.
  if (const auto time = app.xr_time(world.value.lastUpdatedTime)) {
    world.value.lastUpdatedTime = *time;
    std::cout << "    lastUpdatedTime " << *time << " (XrTime)\n";
  }
  openxr_light::print(std::cout, world, "    ");
  // For shading in view space: the same lighting in the current head frame.
  if (const auto T_world_view = app.view_in_world()) {
    std::cout << "  view:\n";
    openxr_light::print(
        std::cout, openxr_light::light_in_space(lighting, options.T_world_probe, *T_world_view, options.kind), "    ");
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = parsed(argc, argv);
  if (!options) {
    std::cerr << "usage: openxr_light URI [--frames N] [--world-probe QX,QY,QZ,QW] [--total] [--require-session]\n";
    return 2;
  }
  openxr_light::XrApp app;
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
