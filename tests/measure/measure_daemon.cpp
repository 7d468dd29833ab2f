// CPU time of the whole daemon for a frame, at 30 frames a second with one client, and of other work on the same
// pictures, which arrive at the same rate: all with cold caches. Prints one JSON object per line for tests/figures.
//   measure_daemon [--vector best|avx2|sse4] [--seconds S]   S of each case [8]
//     camera, sensor       1 or 2 lenses of WIDTHxHEIGHT, sRGB; as they arrive
//     fastest_ms, fast_ms, balanced_ms   all threads of lightwelld but the camera's, which only hands out frames that
//                          were rendered before
//     resize_ms            cv::resize INTER_AREA of each picture to 160x120, of YUYV after cvtColor
//     detection_ms         Algorithm 1 of Alhakamy and Tuceryan 2019, on an RGB8 picture of the whole sphere with as
//                          many pixels
//     memcpy_ms, vector    of the bytes; vector unit of lightwell's kernels
//     dropped              frames that the daemon lost or dropped while it was measured
// OpenCV chooses its vector unit itself; OPENCV_CPU_DISABLE=AVX512_SKX limits it to AVX2.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <spawn.h>
#include <string>
#include <string_view>
#include <thread>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sys/wait.h>

#include <lightwell/config.hpp>

#include "app/daemon.hpp"
#include "bench/alhakamy2019.hpp"
#include "bench/thread_time.hpp"
#include "bench/vector_unit.hpp"
#include "camera/backend.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
using Clock = std::chrono::steady_clock;

constexpr double kRate = 30;
constexpr std::size_t kCopies = 8;
constexpr Setting kMeasured[] = {Setting::fastest, Setting::fast, Setting::balanced};

struct Case {
  const char* rig;
  int lenses, width, height;
};
constexpr Case kCases[] = {{"single", 1, 640, 480}, {"single", 1, 1280, 960}, {"pair", 2, 1920, 1440}};
constexpr PixelFormat kFormats[] = {PixelFormat::rgb8, PixelFormat::yuyv};

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_daemon: %s\n", what.c_str());
  std::exit(1);
}

/// Mean CPU time, ms, of work(k) on picture k, called at the rate of frames.
double paced_ms(double seconds, const std::function<void(std::size_t)>& work) {
  const auto count = static_cast<std::size_t>(seconds * kRate);
  double total = 0;
  auto next = Clock::now();
  for (std::size_t i = 0; i < count; ++i) {
    next += std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / kRate));
    std::this_thread::sleep_until(next);
    const double start = bench::thread_time_ms();
    work(i % kCopies);
    total += bench::thread_time_ms() - start;
  }
  return total / static_cast<double>(count);
}

struct Picture {
  int width, height;
  std::vector<std::vector<std::byte>> lenses;
};

/// A picture of each lens, 5 % below saturation where it is brightest.
Picture picture_of(const sim::Scene& scene, const char* kind, int width, int height, PixelFormat format) {
  const Result<RigParameters> rig = sim::make_rig(kind, width, height, format);
  if (!rig) fail(rig.status().message());
  measure::Camera camera(*rig, format);
  const measure::LensRadiance radiance = camera.render(scene, scene.state_at(0));
  const std::vector<double> exposure{
      camera.bracket_of_three(measure::peak_of(radiance), measure::mean_of(radiance))[0]};
  return {width, height, camera.expose(radiance, exposure, 0).pixels};
}

struct Peers {
  double resize = 0, detection = 0, copy = 0;  ///< ms
};

Peers measure_peers(const sim::Scene& scene, const Case& c, PixelFormat format, double seconds) {
  cv::setNumThreads(1);
  const Picture one = picture_of(scene, c.rig, c.width, c.height, format);
  std::vector<std::vector<std::vector<std::byte>>> pictures(kCopies, one.lenses);
  Peers out;
  cv::Mat small, rgb;
  out.resize = paced_ms(seconds, [&](std::size_t k) {
    for (std::vector<std::byte>& lens : pictures[k]) {
      const int channels = format == PixelFormat::yuyv ? 2 : 3;
      cv::Mat picture(c.height, c.width, CV_8UC(channels), lens.data());
      if (format == PixelFormat::yuyv) cv::cvtColor(picture, rgb, cv::COLOR_YUV2RGB_YUYV);
      cv::resize(format == PixelFormat::yuyv ? rgb : picture, small, {160, 120}, 0, 0, cv::INTER_AREA);
    }
  });
  out.copy = paced_ms(seconds, [&](std::size_t k) {
    std::vector<std::vector<std::byte>>& to = pictures[(k + kCopies / 2) % kCopies];
    for (std::size_t lens = 0; lens < to.size(); ++lens)
      std::memcpy(to[lens].data(), pictures[k][lens].data(), to[lens].size());
  });
  pictures.clear();
  const int height = static_cast<int>(std::sqrt(c.lenses * c.width * c.height / 2.0)) / 2 * 2;
  const Picture sphere = picture_of(scene, "equirect", 2 * height, height, PixelFormat::rgb8);
  const std::vector<std::vector<std::byte>> spheres(kCopies, sphere.lenses[0]);
  out.detection = paced_ms(seconds, [&](std::size_t k) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(spheres[k].data());
    (void)bench::alhakamy_detect(
        {2 * height, height, {bytes, spheres[k].size()}, 6 * static_cast<std::size_t>(height)});
  });
  return out;
}

/// CPU time, ms, of all threads of this process but this one and the camera's.
double daemon_time_ms() {
  double total = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    const pid_t thread = std::stoi(entry.path().filename());
    std::string name;
    std::getline(std::ifstream(entry.path() / "comm"), name);
    if (thread == gettid() || name == ThreadedBackend::kThreadName) continue;
    // The kernel's number of a thread's CPU clock (clock_getcpuclockid(3) of its thread number).
    const auto clock = static_cast<clockid_t>(~static_cast<unsigned>(thread) << 3U | 6U);
    timespec now{};
    if (clock_gettime(clock, &now) == 0)
      total += 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
  }
  return total;
}

/// The daemon's own counters, by the program `lightwell`.
nlohmann::json counters_of(const std::string& program, const std::string& uri) {
  FILE* pipe = popen((program + " info " + uri + " --json").c_str(), "r");
  if (pipe == nullptr) fail("cannot start " + program);
  std::string text;
  std::array<char, 4096> buffer;
  for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) text.append(buffer.data(), n);
  if (pclose(pipe) != 0) fail(program + " info failed: " + text);
  return nlohmann::json::parse(text);
}

struct DaemonTime {
  double ms = 0, dropped = 0;
};

DaemonTime measure_daemon(const Case& c, PixelFormat format, Setting setting, double seconds) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "lightwell";
  const std::string address = "127.0.0.1:7429", uri = "grpc://" + address;
  Config config;
  config.camera.uri = std::string("sim:city?rig=") + c.rig + "&sensor=" + std::string(to_string(format));
  config.camera.width = c.width;
  config.camera.height = c.height;
  config.camera.frame_rate = kRate;
  config.estimator.setting = setting;
  config.grpc.listen_address = address;
  std::thread daemon([&config] {
    if (const Status s = run_daemon(config); !s.ok()) fail(s.message());
  });
  pid_t client = 0;
  const char* arguments[] = {program.c_str(), "watch", uri.c_str(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  // The client and its signals are not blocked as here.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  while (true) {
    // The camera renders its frames first.
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    if (std::system((program + " info " + uri + " >/dev/null 2>&1").c_str()) == 0) break;
  }
  if (posix_spawn(&client, program.c_str(), &actions, &attributes, const_cast<char**>(arguments), environ) != 0)
    fail("cannot start " + program);
  std::this_thread::sleep_for(std::chrono::seconds(2));
  const nlohmann::json before = counters_of(program, uri);
  const double start = daemon_time_ms();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  const double used = daemon_time_ms() - start;
  const nlohmann::json after = counters_of(program, uri);
  kill(client, SIGTERM);
  waitpid(client, nullptr, 0);
  kill(getpid(), SIGTERM);
  daemon.join();
  const auto change = [&](const char* key) { return after.at(key).get<double>() - before.at(key).get<double>(); };
  return {used / (seconds * kRate), change("captures_dropped") + change("frames_lost") + change("estimates_failed")};
}

}  // namespace

int main(int argc, char** argv) {
  block_stop_signals();
  CLI::App app{"CPU time of the whole daemon for a frame, and of other work on it.", "measure_daemon"};
  std::string vector = "best";
  double seconds = 8;
  app.add_option("--vector", vector, "best, avx2 or sse4 [best]");
  app.add_option("--seconds", seconds, "Duration of each case [8]")->check(CLI::PositiveNumber);
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  const Result<std::string> unit = bench::select_vector_unit(vector);
  if (!unit) return wrong_usage(app, unit.status().message());
  // The daemon prints its address to stdout.
  FILE* const out = fdopen(dup(1), "w");
  if (out == nullptr || std::freopen("/dev/null", "w", stdout) == nullptr) fail("cannot redirect stdout");

  const Result<std::string> path = sim::scene_path("city");
  if (!path) fail(path.status().message());
  Result<sim::Panorama> city = sim::load_panorama(*path);
  if (!city) fail(city.status().message());
  const sim::Scene scene(std::move(*city));
  for (const Case& c : kCases)
    for (const PixelFormat format : kFormats) {
      const Peers peers = measure_peers(scene, c, format, seconds);
      nlohmann::ordered_json line = {{"lenses", c.lenses},
                                     {"size", std::to_string(c.width) + "x" + std::to_string(c.height)},
                                     {"sensor", to_string(format)},
                                     {"vector", *unit},
                                     {"memcpy_ms", peers.copy},
                                     {"resize_ms", peers.resize},
                                     {"detection_ms", peers.detection}};
      double dropped = 0;
      for (const Setting setting : kMeasured) {
        const DaemonTime daemon = measure_daemon(c, format, setting, seconds);
        line[std::string(to_string(setting)) + "_ms"] = daemon.ms;
        dropped += daemon.dropped;
      }
      line["dropped"] = dropped;
      std::fprintf(out, "%s\n", json_text(line).c_str());
      std::fflush(out);
    }
  return 0;
}
