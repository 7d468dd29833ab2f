// Time from the return of a network to valid light, for a client of a running lightwelld behind an impairing proxy. One
// JSON object per line for tests/figures: figure (cut.SECONDS, held.SECONDS, delayed), value (s from the link's return
// to a valid light that was made after it; the maximum over the repeats), lies (number of valid lights older than
// max_age).
//   measure_recovery grpc://127.0.0.1:PORT [--seconds S] [--repeats N]     outages of S seconds [10], N of each kind
//                                                                          [3]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include <lightwell/probe.hpp>

#include "measure/output.hpp"
#include "support/impairing_proxy.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
using std::chrono::milliseconds;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_recovery: %s\n", what.c_str());
  std::exit(1);
}

/// Queries the light for `seconds`, or until `enough` holds; counts valid lights that are too old in `lies`.
template <class Enough>
double watch(const Probe& probe, double seconds, int& lies, Enough&& enough) {
  const std::int64_t begin = monotonic_now_ns();
  for (;;) {
    const std::int64_t now = monotonic_now_ns();
    const Lighting light = probe.latest();
    if (light.validity() == Validity::valid &&
        now - light.descriptor().time.mid_exposure.ns > Lighting::kDefaultMaxAge.ns)
      ++lies;
    const double passed = 1e-9 * static_cast<double>(now - begin);
    if (enough(light) || passed > seconds) return passed;
    std::this_thread::sleep_for(milliseconds(1));
  }
}

/// Whether a light was made after `ns` by the probe's clock, which is this machine's clock, too.
auto fresh_since(std::int64_t ns) {
  return [ns](const Lighting& light) {
    return light.validity() == Validity::valid && light.descriptor().time.mid_exposure.ns > ns;
  };
}

void print(const std::string& figure, double value, int lies) {
  measure::print_figure(figure, value, {{"lies", lies}});
}

}  // namespace

int main(int argc, char** argv) {
  std::string uri;
  double seconds = 10;
  int repeats = 3;
  CLI::App app{"Time from the return of a network to valid light, behind an impairing proxy.", "measure_recovery"};
  app.add_option("URI", uri, "grpc://127.0.0.1:PORT of a running lightwelld")->required();
  app.add_option("--seconds", seconds, "Duration of an outage [10]")->check(CLI::PositiveNumber);
  app.add_option("--repeats", repeats, "Outages of each kind [3]")->check(CLI::PositiveNumber);
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  if (!uri.starts_with("grpc://127.0.0.1:")) return wrong_usage(app, "'" + uri + "' is not grpc://127.0.0.1:PORT");
  test::ImpairingProxy proxy(std::atoi(uri.c_str() + std::strlen("grpc://127.0.0.1:")));
  const Result<Probe> probe = Probe::connect("grpc://127.0.0.1:" + std::to_string(proxy.port()));
  if (!probe) fail(probe.status().message());
  int lies = 0;
  const auto never = [](const Lighting&) { return false; };
  watch(*probe, 1, lies, never);

  double worst = 0;
  for (int i = 0; i < repeats; ++i) {
    proxy.cut();
    watch(*probe, seconds, lies, never);
    proxy.restore();
    worst = std::max(worst, watch(*probe, 30, lies, fresh_since(monotonic_now_ns())));
    watch(*probe, 1, lies, never);
  }
  print("cut." + std::to_string(static_cast<int>(seconds)), worst, lies);

  worst = 0, lies = 0;
  for (int i = 0; i < repeats; ++i) {
    proxy.hold();
    watch(*probe, seconds, lies, never);
    proxy.resume();
    worst = std::max(worst, watch(*probe, 30, lies, fresh_since(monotonic_now_ns())));
    watch(*probe, 1, lies, never);
  }
  print("held." + std::to_string(static_cast<int>(seconds)), worst, lies);

  // A delay of 200 ms in each direction with jitter for a while: lights are stale or have their true age, and fresh at
  // once afterwards.
  lies = 0;
  proxy.impair({.delay = milliseconds(200), .jitter = milliseconds(60)});
  watch(*probe, seconds, lies, never);
  proxy.impair({});
  print("delayed", watch(*probe, 30, lies, fresh_since(monotonic_now_ns())), lies);
  return 0;
}
