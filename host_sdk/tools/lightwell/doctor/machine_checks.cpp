#include "doctor/machine_checks.hpp"

#include <array>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <dlfcn.h>
#include <ifaddrs.h>
#include <memory>
#include <netdb.h>
#include <poll.h>
#include <unistd.h>

#include <net/if.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <sys/wait.h>

#include <lightwell/deleter.hpp>
#include <lightwell/files.hpp>
#include <lightwell/lightwell.h>
#include <lightwell/probe.hpp>
#include <lightwell/text.hpp>

#include "core/discovery_backends.hpp"
#include "core/features.hpp"

namespace lightwell::tool {
namespace {

/// What the child of check_library() reports through a pipe.
struct LibraryReport {
  enum class Kind : std::uint8_t { loaded, not_loaded, no_library } kind = Kind::not_loaded;
  std::uint32_t abi = 0;
  std::array<char, 512> text{};  ///< Its version, or the loader's error.
};

template <class Function>
Function* symbol_of(void* library, const char* name) {
  return reinterpret_cast<Function*>(dlsym(library, name));
}

LibraryReport load_library(const char* path) {
  LibraryReport report;
  const auto say = [&](const char* text) {
    std::strncpy(report.text.data(), text, report.text.size() - 1);
    return report;
  };
  // A namespace of its own: this process has the libraries of the static SDK already.
  void* const library = dlmopen(LM_ID_NEWLM, path, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const char* const error = dlerror();
    return say(error == nullptr ? "unknown error" : error);
  }
  auto* const abi = symbol_of<decltype(lw_abi_version)>(library, "lw_abi_version");
  auto* const name = symbol_of<decltype(lw_version)>(library, "lw_version");
  report.kind = LibraryReport::Kind::no_library;
  if (abi == nullptr || name == nullptr) return say("it has no lw_abi_version");
  report.kind = LibraryReport::Kind::loaded;
  report.abi = abi();
  return say(name());
}

/// The report of a child process; no_library if it crashed or did not end in time.
LibraryReport report_of_child(const std::string& library) {
  LibraryReport report;
  report.kind = LibraryReport::Kind::no_library;
  std::array<int, 2> ends{-1, -1};
  if (pipe(ends.data()) != 0) return report;
  const FileDescriptor reading(ends[0]);
  FileDescriptor writing(ends[1]);
  const pid_t child = fork();
  if (child == 0) {
    const LibraryReport mine = load_library(library.c_str());
    _exit(write(writing.get(), &mine, sizeof mine) == static_cast<ssize_t>(sizeof mine) ? 0 : 1);
  }
  writing = FileDescriptor();
  if (child < 0) return report;
  constexpr int kTimeout_ms = 5000;
  pollfd ready{reading.get(), POLLIN, 0};
  LibraryReport received;
  if (poll(&ready, 1, kTimeout_ms) == 1 &&
      read(reading.get(), &received, sizeof received) == static_cast<ssize_t>(sizeof received))
    report = received;
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  report.text.back() = '\0';
  return report;
}

std::string abi_text(std::uint32_t abi) { return formatted("%u.%u", abi >> 16U, abi & 0xFFFFU); }

}  // namespace

Finding check_sdk() {
  std::vector<std::string> built, missing, packages;
  for (const core::Feature& f : core::features()) {
    (f.built == core::Built::yes ? built : missing).emplace_back(f.name);
    if (f.built == core::Built::no) packages.emplace_back(f.package);
  }
  const std::string found = "version " + std::string(version()) + " with " + joined(built);
  if (missing.empty()) return ok(found);
  return warning(found + "; built without " + joined(missing),
                 "if you need them, install " + joined(packages) + " and build the SDK again");
}

Finding check_library(const std::string& library) {
  const LibraryReport report = report_of_child(library);
  const std::string text = report.text.data();
  if (report.kind == LibraryReport::Kind::not_loaded)
    return not_checked(library + " was not loaded: " + text,
                       "only applications in C, Python and C# need it: install it, or name it in LIGHTWELL_LIBRARY");
  if (report.kind == LibraryReport::Kind::no_library)
    return fault(library + " cannot be used: " + (text.empty() ? "loading it crashed or took too long" : text),
                 "install liblightwell again, together with the libraries that it needs (`ldd " + library + "`)");
  const std::string both = library + " has version " + text + ", ABI " + abi_text(report.abi) +
                           "; the headers of this SDK have ABI " + abi_text(LW_ABI_VERSION);
  if (report.abi >> 16U != LW_ABI_VERSION >> 16U)
    return fault(both, "they do not fit: install library and headers of the same version, compile applications again");
  if (report.abi < LW_ABI_VERSION)
    return warning(both, "the library is older and lacks functions of these headers: install this SDK's library");
  if (report.abi > LW_ABI_VERSION) return ok(both + ": it is newer and compatible");
  return ok(both);
}

Finding check_wall_clock() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  const std::string date = formatted("%04d-%02d-%02d %02d:%02d UTC", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                                     utc.tm_hour, utc.tm_min);
  constexpr int kFirstYear = 2024;
  if (utc.tm_year + 1900 < kFirstYear)
    return fault("it is " + date + " by this machine's clock",
                 "set the clock (`sudo timedatectl set-ntp true`, or `sudo date --set ...`): with a wrong date every "
                 "certificate is refused");
  timex state{};
  const int synchronised = adjtimex(&state);
  if (synchronised < 0) return ok("it is " + date + "; whether the clock is synchronised is not known");
  if (synchronised == TIME_ERROR)
    return warning("it is " + date + " by a clock that no time server sets",
                   "compare the date; `sudo timedatectl set-ntp true` synchronises it. Only certificates depend on it: "
                   "the age of light is measured with another clock");
  return ok("it is " + date + ", synchronised");
}

Finding check_network() {
  ifaddrs* raw = nullptr;
  if (getifaddrs(&raw) != 0) return not_checked("the system does not list its network interfaces");
  const std::unique_ptr<ifaddrs, Deleter<freeifaddrs>> all(raw);
  std::vector<std::string> found;
  for (const ifaddrs* i = all.get(); i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || (i->ifa_flags & IFF_UP) == 0 || (i->ifa_flags & IFF_LOOPBACK) != 0) continue;
    const int family = i->ifa_addr->sa_family;
    if (family != AF_INET && family != AF_INET6) continue;
    std::array<char, NI_MAXHOST> text{};
    const socklen_t size = family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
    if (getnameinfo(i->ifa_addr, size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) == 0)
      found.push_back(std::string(i->ifa_name) + " " + text.data());
  }
  if (found.empty())
    return warning(
        "no network: this machine has no address but its own",
        "connect it to the probe's network, by cable or Wi-Fi; probes by USB and on this machine still work");
  return ok(joined(found));
}

Finding check_mdns(Duration timeout) {
  for (const core::Feature& f : core::features())
    if (f.package == "libavahi-client-dev" && f.built == core::Built::no)
      return not_checked("this SDK was built without it",
                         "install libavahi-client-dev and build the SDK again, or give the probe's IP address");
  core::DiscoveryResults results;
  core::discover_by_mdns(timeout, results);
  const Discovered found = results.take();
  if (!found.problems.empty())
    return fault(joined(found.problems),
                 "start it (`sudo systemctl start avahi-daemon`, package avahi-daemon), or give the probe's IP address "
                 "instead of a name in .local");
  std::vector<std::string> probes;
  for (const FoundProbe& p : found.probes) {
    probes.push_back(p.name + " (" + p.version + ")");
    for (const FoundLink& link : p.links) probes.back() += " " + link.uri;
  }
  if (found.probes.empty())
    return warning("avahi-daemon runs, and no probe is announced",
                   "is the probe on, in the same network, and started with --announce (discovery {} of its "
                   "configuration)? Guest networks often keep their devices apart (client isolation)");
  return ok(joined(probes));
}

}  // namespace lightwell::tool
