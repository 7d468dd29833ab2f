// Simulates a day of a probe in minutes: as many descriptors as 24 hours at 30 per second go from a publisher over gRPC
// to clients, one of which stays connected while others connect and disconnect; time stamps advance by 1/30 s. Prints
// resources of the process: the maximum over the first three hours, the value at the end (for threads and file
// descriptors the minimum over the ends of the last three hours), and the maximum in between. One JSON object per line
// for tests/figures (figure, value).
//   measure_day [--hours H]      24
//     rss_kb.settled, rss_kb.half (of the time), rss_kb.largest, rss_kb.last; fds...; threads... (without those of
//     gRPC's pools); pool_threads.most (of the largest pool, over all samples), pool_threads.bound; received,
//     coalesced, reconnects
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <dirent.h>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <unistd.h>

#include <lightwell/commands.hpp>
#include <lightwell/probe.hpp>

#include "link/grpc/grpc_link.hpp"
#include "link/link.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
using measure::print_figure;

constexpr double kRate = 30;
constexpr int kMinutesBetweenClients = 10;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_day: %s\n", what.c_str());
  std::exit(1);
}

std::size_t entries_of(const char* folder) {
  DIR* d = ::opendir(folder);
  if (d == nullptr) fail(std::string(folder) + " cannot be read");
  std::size_t n = 0;
  while (::readdir(d) != nullptr) ++n;
  ::closedir(d);
  return n;
}

/// Thread pools of gRPC 1.51 by the thread names that the kernel shows. They grow when work coincides, possibly after
/// hours. Executor threads are kept, at most two per core. The event engine has one thread per core and at least two,
/// and starts one more per second while all are busy, which ends after 30 s without work; gRPC does not limit these,
/// and the executors' limit is applied to them here.
constexpr std::array<std::string_view, 3> kPools{"default-executo", "resolver-execut", "event_engine"};

double pool_bound() { return 2.0 * static_cast<double>(::sysconf(_SC_NPROCESSORS_CONF)); }

struct Threads {
  double others = 0, largest_pool = 0;

  static Threads now() {
    DIR* d = ::opendir("/proc/self/task");
    if (d == nullptr) fail("/proc/self/task cannot be read");
    std::array<double, kPools.size()> pools{};
    Threads out;
    while (const dirent* entry = ::readdir(d)) {
      if (entry->d_name[0] == '.') continue;
      std::ifstream comm(std::string("/proc/self/task/") + entry->d_name + "/comm");
      std::string name;
      if (!std::getline(comm, name)) continue;  // The thread has ended in the meantime.
      const auto pool = std::find(kPools.begin(), kPools.end(), name);
      ++(pool == kPools.end() ? out.others : pools[static_cast<std::size_t>(pool - kPools.begin())]);
    }
    ::closedir(d);
    out.largest_pool = *std::max_element(pools.begin(), pools.end());
    return out;
  }
};

struct Held {
  double rss_kb = 0, fds = 0, threads = 0;
  double largest_pool = 0;  ///< Number of threads of gRPC's largest pool.

  static Held now() {
    const Threads threads = Threads::now();
    std::ifstream statm("/proc/self/statm");
    double pages = 0, resident = 0;
    statm >> pages >> resident;
    return {resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1024,
            static_cast<double>(entries_of("/proc/self/fd")), threads.others, threads.largest_pool};
  }
  [[nodiscard]] Held largest(const Held& o) const {
    return {std::max(rss_kb, o.rss_kb), std::max(fds, o.fds), std::max(threads, o.threads),
            std::max(largest_pool, o.largest_pool)};
  }
  /// This memory, and the minimum of threads and file descriptors, which fluctuate.
  [[nodiscard]] Held fewest(const Held& o) const {
    return {rss_kb, std::min(fds, o.fds), std::min(threads, o.threads), largest_pool};
  }
  void print(const std::string& when) const {
    print_figure("rss_kb." + when, std::round(rss_kb));
    print_figure("fds." + when, fds);
    print_figure("threads." + when, threads);
  }
};

/// Commands of a probe without a camera.
class NoCommands final : public Commands {
 public:
  [[nodiscard]] StatusSnapshot status() const override {
    StatusSnapshot s;
    s.probe_name = "day";
    s.version = "0";
    return s;
  }
  [[nodiscard]] EstimatorConfig estimator() const override { return {}; }
  [[nodiscard]] EstimatorKind estimator_kind() const override { return EstimatorKind::panorama; }
  [[nodiscard]] Status update_estimator(const EstimatorUpdate&) override { return {}; }
  [[nodiscard]] Result<double> report_lux(double, Vec3d) override { return 1.0; }
  [[nodiscard]] CalibrationSummary calibration() const override { return {}; }
  [[nodiscard]] Result<RecordingStatus> control_recording(RecordingAction) override { return RecordingStatus{}; }
  [[nodiscard]] Result<PreviewJpeg> preview() override { return PreviewJpeg(); }
};

/// A synthetic descriptor: the sun moves, and the numbers of lights and bands vary.
Descriptor at_frame(std::uint64_t n) {
  Descriptor d;
  d.sequence = n;
  d.time.mid_exposure.ns = static_cast<std::int64_t>(static_cast<double>(n) / kRate * 1e9);
  d.radiance.band = static_cast<int>(n / 1000 % 7);
  for (int i = 0; i < d.radiance.count(); ++i) {
    const float v = i == 0 ? 3.0F : 0.2F * std::sin(static_cast<float>(i) + 1e-4F * static_cast<float>(n % 62832));
    d.radiance.c[static_cast<std::size_t>(i)] = {v, v, v};
  }
  for (std::uint64_t k = 0; k < n / 500 % 9; ++k) {
    Light light;
    const float t = 1e-4F * static_cast<float>(n % 62832) + static_cast<float>(k);
    light.direction = {std::cos(t), 0, std::sin(t)};
    light.irradiance = {5, 4, 3};
    light.angular_radius_rad = 0.01F;
    light.track = static_cast<std::uint32_t>(k + 1);
    d.lights.push_back(light);
  }
  d.probe_id = 1;
  return d;
}

}  // namespace

int main(int argc, char** argv) {
  double hours = 24;
  CLI::App app{"Memory, handles and threads of a publisher and its clients over a day, time-compressed.",
               "measure_day"};
  app.add_option("--hours", hours, "Duration [24]")->check(number_where("at least 4", [](double h) { return h >= 4; }));
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;

  NoCommands commands;
  Publisher publisher;
  publisher.add(make_grpc_link({.listen_address = "127.0.0.1:0"}, "day", commands));
  if (const Status s = publisher.start(); !s.ok()) fail(s.message());
  const std::string uri = publisher.links()[0]->address();
  const Result<Probe> stays = Probe::connect(uri);
  if (!stays) fail(stays.status().message());

  const auto frames = static_cast<std::uint64_t>(hours * 3600 * kRate);
  const auto hour = static_cast<std::uint64_t>(3600 * kRate),
             visit = static_cast<std::uint64_t>(60 * kMinutesBetweenClients * kRate);
  std::optional<Probe> visitor;
  // Threads and file descriptors of connecting and disconnecting clients may be counted in some of the last samples; a
  // leak is present in all of them.
  constexpr std::uint64_t kSettling = 3;
  Held settled, half, most, last;
  for (std::uint64_t n = 1; n <= frames; ++n) {
    Descriptor d = at_frame(n);
    if (const Status s = publisher.publish(d); !s.ok()) fail(s.message());
    (void)stays->latest().irradiance({0, 1, 0});
    // Lets the links' threads run; otherwise descriptors would be coalesced instead of sent.
    if (n % 64 == 0) std::this_thread::yield();
    if (n % visit == 0) {
      visitor.reset();
      Result<Probe> next = Probe::connect(uri);
      if (!next) fail(next.status().message());
      visitor = std::move(*next);
    }
    if (n % hour != 0) continue;
    const Held now = Held::now();
    if (n <= kSettling * hour) settled = settled.largest(now);
    if (n / hour == static_cast<std::uint64_t>(hours / 2)) half = now;
    most = most.largest(now);
    last = n > frames - (kSettling - 1) * hour ? now.fewest(last) : now;
    std::fprintf(stderr, "measure_day: hour %llu, %.0f kB\n", static_cast<unsigned long long>(n / hour), now.rss_kb);
  }
  settled.print("settled");
  half.print("half");
  most.print("largest");
  last.print("last");
  print_figure("pool_threads.most", most.largest_pool);
  print_figure("pool_threads.bound", pool_bound());
  print_figure("published", static_cast<double>(frames));
  print_figure("received", static_cast<double>(stays->stats().received));
  print_figure("coalesced", static_cast<double>(publisher.counters().coalesced));
  print_figure("reconnects", static_cast<double>(stays->stats().reconnects));
  visitor.reset();
  publisher.stop();
  return 0;
}
