// `lightwell doctor`: the order of the checks, their output and the exit code.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <map>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "common.hpp"
#include "doctor/check.hpp"
#include "doctor/machine_checks.hpp"
#include "doctor/probe_checks.hpp"

namespace lightwell::tool {
namespace {

constexpr Duration kShort = Duration::from_seconds(10), kTcpTimeout = Duration::from_seconds(3);
/// The system's resolver tries each server twice, for five seconds (resolv.conf).
constexpr Duration kNameTimeout = Duration::from_seconds(20);
constexpr Duration kFirstFrameTimeout = Duration::from_seconds(5), kObserved = Duration::from_seconds(1.5);

/// Runs checks one after another, prints each, and knows how many had which verdict.
class Examination {
 public:
  explicit Examination(const Options& options) : json_(options.json) {}

  /// `code`: the exit code if the check is the first fault.
  Verdict run(const std::string& name, ExitCode code, std::function<Finding()> check, Duration limit = kShort) {
    const Outcome outcome = run_check(std::move(check), limit, [&] {
      warn(formatted("checking %s, for at most %.0f s ...", name.c_str(), limit.seconds()));
    });
    if (outcome.thread == Outcome::Thread::left_behind) thread_left_behind_ = true;
    return report(name, code, outcome.finding);
  }

  Verdict report(const std::string& name, ExitCode code, const Finding& finding) {
    if (finding.verdict == Verdict::fault && code_ == kOk) code_ = code;
    ++counts_[finding.verdict];
    if (json_)
      print_json({{"check", name},
                  {"verdict", to_string(finding.verdict)},
                  {"found", printable(finding.found)},
                  {"remedy", printable(finding.remedy)}});
    else
      print(name, finding);
    std::fflush(stdout);
    return finding.verdict;
  }

  /// Reports checks that depend on one that failed: in one line, unless it is JSON.
  void skip(const std::vector<std::string>& names, const std::string& why) {
    if (json_) {
      for (const std::string& name : names) report(name, kOk, not_checked(why));
      return;
    }
    counts_[Verdict::not_checked] += static_cast<int>(names.size());
    std::printf("%-12s %s: %s\n", std::string(to_string(Verdict::not_checked)).c_str(), joined(names).c_str(),
                printable(why).c_str());
  }

  /// Prints the sum and returns the exit code; ends the process if a check still runs in a thread that was left behind.
  int finish() {
    if (!json_)
      std::printf("ok %d, warnings %d, faults %d, not checked %d\n", counts_[Verdict::ok], counts_[Verdict::warning],
                  counts_[Verdict::fault], counts_[Verdict::not_checked]);
    std::fflush(stdout);
    if (thread_left_behind_) std::_Exit(code_);
    return code_;
  }

 private:
  static void print(const std::string& name, const Finding& finding) {
    std::printf("%-12s %-12s %s\n", std::string(to_string(finding.verdict)).c_str(), name.c_str(),
                printable(finding.found).c_str());
    if (!finding.remedy.empty()) std::printf("%-12s %-12s -> %s\n", "", "", printable(finding.remedy).c_str());
  }

  const bool json_;
  ExitCode code_ = kOk;
  std::map<Verdict, int> counts_;
  bool thread_left_behind_ = false;
};

std::string library_path() {
  const char* const named = std::getenv("LIGHTWELL_LIBRARY");
  return named == nullptr ? "liblightwell.so.1" : named;
}

void examine_machine(Examination& examination) {
  examination.run("SDK", kFile, check_sdk);
  examination.run("library", kFile, [path = library_path()] { return check_library(path); });
  examination.run("date", kFile, check_wall_clock);
  examination.run("network", kFile, check_network);
  examination.run("pairings", kFile, [] { return check_credential_store(default_credential_store()); });
  examination.run("USB rule", kFile, [] { return check_usb_rule(); });
  examination.run("USB", kFile, [] { return check_usb_devices(); });
}

/// What the checks of one probe share; the threads of checks that were given up keep it alive.
struct ProbeState {
  std::string uri;
  ProbeOptions options;
  std::vector<std::string> addresses;
  ArrivalRecorder arrivals;
  std::optional<Probe> probe;  // last: its thread uses the recorder
};

constexpr const char* kChecksOfProbe[] = {"reachable", "credentials", "TLS",    "access", "versions",
                                          "frames",    "clock",       "losses", "probe",  "light"};

/// Reports that all checks from `first` on are not checked.
void skip_from(Examination& examination, std::string_view first, const std::string& why) {
  const auto* const begin = std::ranges::find(kChecksOfProbe, first);
  examination.skip({begin, std::end(kChecksOfProbe)}, why);
}

/// Whether the network leads to the probe.
bool examine_route(Examination& examination, const std::shared_ptr<ProbeState>& state,
                   const std::optional<NetworkAddress>& address) {
  if (!address) {
    examination.report("name", kUnreachable, not_checked("not over a network"));
    examination.report("reachable", kUnreachable, not_checked("not over a network"));
    return true;
  }
  const Verdict name = examination.run(
      "name", kUnreachable,
      [state, address] {
        ResolvedName resolved = check_name(*address);
        state->addresses = std::move(resolved.addresses);
        return resolved.finding;
      },
      kNameTimeout);
  if (name == Verdict::fault) {
    skip_from(examination, "reachable", "the name has no address");
    return false;
  }
  const Verdict reachable = examination.run(
      "reachable", kUnreachable, [state, address] { return check_reachable(*address, state->addresses, kTcpTimeout); },
      kTcpTimeout + kTcpTimeout + kTcpTimeout);
  if (reachable == Verdict::ok) return true;
  skip_from(examination, "credentials", "the address cannot be reached");
  return false;
}

bool examine_connection(Examination& examination, const std::shared_ptr<ProbeState>& state,
                        const std::optional<NetworkAddress>& address) {
  if (examination.run("credentials", kFile, [state] {
        return check_credentials(state->uri, state->options.credentials);
      }) == Verdict::fault) {
    skip_from(examination, "TLS", "there are no credentials for it");
    return false;
  }
  const auto findings = std::make_shared<ConnectionFindings>();
  const Verdict encryption = examination.run("TLS", kFile, [state, address, findings] {
    Result<Probe> probe = Probe::connect(state->uri, state->options);
    *findings = check_connection(address, probe.status());
    if (probe.ok()) state->probe = std::move(*probe);
    return findings->encryption;
  });
  // Without a handshake, or without TLS, no probe has refused anything.
  const Verdict access =
      examination.report("access", encryption == Verdict::not_checked ? kUnreachable : kFile, findings->access);
  if (encryption != Verdict::fault && access == Verdict::ok) return true;
  skip_from(examination, "versions", "there is no connection");
  return false;
}

void examine_light(Examination& examination, const std::shared_ptr<ProbeState>& state) {
  const bool recording = state->uri.starts_with("replay:");
  const Finding of_recording = not_checked("a recording");
  const auto live = [&](const char* name, ExitCode code, Finding (*check)(const ProbeInfo&)) {
    examination.run(name, code, [=] { return recording ? of_recording : check(state->probe->info()); });
  };
  live("versions", kFile, check_versions);
  examination.run("frames", kNothingReceived, [state] {
    // A recording may have ended before it is read.
    (void)state->probe->wait_for_next(std::nullopt, kFirstFrameTimeout);
    std::this_thread::sleep_for(std::chrono::nanoseconds(kObserved.ns));
    return check_frames(state->arrivals.statistics(), state->probe->info(), kFirstFrameTimeout);
  });
  // After the frames, because the clock is measured by round trips meanwhile.
  live("clock", kFile, check_clock);
  examination.run("losses", kFile, [state] { return check_losses(state->probe->stats()); });
  live("probe", kFile, check_probe_status);
  examination.run("light", kFile, [state] { return check_light(state->probe->latest()); });
}

}  // namespace

int run_doctor(const Options& options) {
  Examination examination(options);
  if (options.uri.empty()) {
    examine_machine(examination);
    examination.run("discovery", kFile, [] { return check_mdns(Duration::from_seconds(3)); });
    return examination.finish();
  }
  const Result<std::optional<NetworkAddress>> address = network_address_of(options.uri);
  require(address.status());
  const auto state = std::make_shared<ProbeState>();
  state->uri = options.uri;
  state->options.mqtt = broker_login();
  state->options.credentials.folder = options.credentials;
  state->options.connect_timeout = Duration::from_seconds(4);
  state->options.on_descriptor = [recorder = &state->arrivals](const Arrival& a) { recorder->add(a); };
  examine_machine(examination);
  if (examine_route(examination, state, *address) && examine_connection(examination, state, *address))
    examine_light(examination, state);
  return examination.finish();
}

}  // namespace lightwell::tool
