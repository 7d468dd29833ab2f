// Which probes there are: what they announce by multicast DNS, what they retain at an MQTT broker, and what is plugged
// in.
//   FoundBy, FoundLink, FoundProbe   what was found; all of it said by others, checked and bounded, and no proof of
//   anything DiscoverOptions, discover        looks for a while
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
  mqtt,  ///< Its status is retained at the broker that was asked.
  usb,   ///< Plugged into this machine.
};

[[nodiscard]] constexpr std::string_view to_string(FoundBy by) {
  switch (by) {
    case FoundBy::mdns:
      return "mdns";
    case FoundBy::mqtt:
      return "mqtt";
    case FoundBy::usb:
      return "usb";
  }
  return "unknown";
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
  std::string version;             ///< Of its firmware.
  std::uint32_t wire_version = 0;  ///< 0: not told.
  /// By mDNS: under which name it is announced, its own unless another has that. At a broker: its base topic.
  /// By USB: its serial number; a probe that another program reads tells no more.
  std::string instance;
  /// By mDNS: the name of its machine, "attic.local".
  std::string host;
  /// It has left the broker: nobody is reached there.
  bool gone = false;
  std::vector<FoundLink> links;
};

struct DiscoverOptions {
  /// How long to look. Probes answer within a second; a network that loses packets wants more.
  Duration timeout{2'000'000'000};
  /// `mqtt://broker` or `mqtt://broker/venue`: probes up to three levels below are looked for there as well. Empty:
  /// nowhere.
  std::string broker;
  MqttCredentials credentials;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

struct Discovered {
  /// By name. One that is found both ways is there twice.
  std::vector<FoundProbe> probes;
  /// Why one of the ways could not be gone, for a person: no avahi-daemon, a broker that refused.
  std::vector<std::string> problems;
  /// Announcements and statuses that were malformed, and what was above the limit of 1,000 probes.
  std::size_t refused = 0;
};

/// Blocks for `timeout` (while the system looks up a broker's name, for longer). invalid_argument: the options. Where a
/// way cannot be gone the others are, and `problems` says so; an SDK that was built without a way says so there, too.
[[nodiscard]] Result<Discovered> discover(const DiscoverOptions& options = {});

}  // namespace lightwell
