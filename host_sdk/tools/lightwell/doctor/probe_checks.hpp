// What works between this machine and a probe, in the order in which each needs the one before.
#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/probe.hpp>
#include <lightwell/result.hpp>

#include "doctor/check.hpp"

namespace lightwell::tool {

enum class Encryption : std::uint8_t { none, tls };
enum class Peer : std::uint8_t { probe, broker };

/// The network part of a probe's address, or of its broker's.
struct NetworkAddress {
  std::string host;  ///< Without brackets.
  int port = 0;
  Encryption encryption = Encryption::none;
  Peer peer = Peer::probe;
};
/// No value for usb: and replay:. invalid_argument: not a probe's address.
[[nodiscard]] Result<std::optional<NetworkAddress>> network_address_of(const std::string& uri);

struct ResolvedName {
  Finding finding;
  std::vector<std::string> addresses;  ///< Numeric.
};
/// The addresses of a host; names in .local by multicast DNS.
[[nodiscard]] ResolvedName check_name(const NetworkAddress& address);

/// A TCP connection to one of the addresses, each for at most `timeout`.
[[nodiscard]] Finding check_reachable(const NetworkAddress& address, const std::vector<std::string>& addresses,
                                      Duration timeout);

/// This client's credentials for the probe: stored, or in the given folder. not_checked for an address without TLS, and
/// for a broker, whose login is in environment variables.
[[nodiscard]] Finding check_credentials(const std::string& uri, const ProbeCredentials& given);

/// TLS handshake, and whether the probe accepts this client: by what Probe::connect() reports. `access` is not_checked
/// if the handshake failed. `address`: none for usb: and replay:.
struct ConnectionFindings {
  Finding encryption, access;
};
[[nodiscard]] ConnectionFindings check_connection(const std::optional<NetworkAddress>& address,
                                                  const Status& connected);

/// The probe's firmware and this SDK; wire versions are compared when a descriptor arrives.
[[nodiscard]] Finding check_versions(const ProbeInfo& info);

/// The offset of the clocks, and its uncertainty, which limits what is known of the age of light.
[[nodiscard]] Finding check_clock(const ProbeInfo& info);

/// What arrived from a probe.
struct ArrivalStatistics {
  std::size_t count = 0;
  double per_second = 0;  ///< 0 for a single one.
  /// From mid-exposure until it could be queried; the median is the lower one (lower_quantile()).
  double age_median_ms = 0, age_max_ms = 0;
};
/// Collects them; for ProbeOptions::on_descriptor, and read by another thread.
class ArrivalRecorder {
 public:
  void add(const Arrival& arrival);
  [[nodiscard]] ArrivalStatistics statistics() const;

 private:
  static constexpr std::size_t kMaxAges = 10'000;
  mutable std::mutex mutex_;
  std::vector<double> ages_ms_;
  HostTime first_, last_;
};

/// Whether descriptors arrive, and how old they are. `waiting` is how long the first was waited for.
[[nodiscard]] Finding check_frames(const ArrivalStatistics& arrivals, const ProbeInfo& info, Duration waiting);

/// Descriptors that were lost or refused on the way.
[[nodiscard]] Finding check_losses(const LinkStats& stats);

/// Faults that the probe itself reports.
[[nodiscard]] Finding check_probe_status(const ProbeInfo& info);

/// Whether the light can be used: darkness, saturation, an infinite bound.
[[nodiscard]] Finding check_light(const Lighting& lighting);

}  // namespace lightwell::tool
