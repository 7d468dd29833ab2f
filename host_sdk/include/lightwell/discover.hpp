// Discovery of probes: multicast DNS announcements, statuses retained at an MQTT broker, and USB devices.
//   FoundBy, FoundLink, FoundProbe   a found probe; checked and bounded, but not authenticated
//   DiscoverOptions, discover        the search, for a limited time
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/probe.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

enum class FoundBy : std::uint8_t {
  mdns,  ///< Announced on the local network.
  mqtt,  ///< Its status is retained at the broker of DiscoverOptions::broker.
  usb,   ///< Connected to this machine.
};

[[nodiscard]] constexpr std::string_view to_string(FoundBy by) {
  constexpr std::string_view kNames[] = {"mdns", "mqtt", "usb"};
  return by <= FoundBy::usb ? kNames[static_cast<std::size_t>(by)] : "unknown";
}

struct FoundLink {
  std::string uri;       ///< For Probe::connect().
  std::string security;  ///< "none" or "tls".
};

struct FoundProbe {
  FoundBy by = FoundBy::mdns;
  std::string name;
  std::uint32_t id = 0;
  std::uint32_t calibration_id = 0;
  std::string version;             ///< Firmware version.
  std::uint32_t wire_version = 0;  ///< 0: unknown.
  /// mDNS: its service instance name, which is its own name unless another probe has that. MQTT: its base topic. USB:
  /// its serial number, which is all that is known of a probe that another program has opened.
  std::string instance;
  /// mDNS: its host name, "attic.local".
  std::string host;
  /// MQTT: its status says that it has left the broker; it cannot be reached there.
  bool gone = false;
  std::vector<FoundLink> links;
};

struct DiscoverOptions {
  /// Duration of the search. Probes answer within a second; a network that loses packets needs longer.
  Duration timeout{2'000'000'000};
  /// `mqtt://broker` or `mqtt://broker/venue`: also searches there, up to three topic levels below. Empty: no broker.
  std::string broker;
  MqttCredentials credentials;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

struct Discovered {
  /// Sorted by name. A probe that is found by two methods is listed twice.
  std::vector<FoundProbe> probes;
  /// Human-readable reasons why a method failed: no avahi-daemon, a broker that refused the connection.
  std::vector<std::string> problems;
  /// Number of malformed announcements and statuses, and of probes above the limit of 1,000.
  std::size_t refused = 0;
};

/// Searches with all methods. Blocks for `timeout` (longer while the system resolves a broker's name).
/// invalid_argument: the options. If a method fails, or the SDK was built without it, the others are used and
/// `problems` has the reason.
[[nodiscard]] Result<Discovered> discover(const DiscoverOptions& options = {});

}  // namespace lightwell
