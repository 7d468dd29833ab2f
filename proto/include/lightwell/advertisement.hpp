// A probe's announcement in DNS-SD (RFC 6763), service type _lightwell._tcp. To the host it is untrusted input, because
// anyone on the network can announce anything.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

inline constexpr std::string_view kServiceType = "_lightwell._tcp";

struct AdvertisedLink {
  /// "grpc://:7420" (an empty host is the machine of the service record) or "mqtts://broker:8883/venue/probe".
  std::string uri;
  /// "none" or "tls".
  std::string security;

  friend bool operator==(const AdvertisedLink&, const AdvertisedLink&) = default;
};

struct Advertisement {
  std::string name;  ///< 1 to 64 bytes of UTF-8 without control characters.
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
  std::string version;  ///< Firmware version, "0.1.0"; 1 to 32 characters that are allowed in versions.
  std::uint32_t wire_version = 0;
  std::vector<AdvertisedLink> links;  ///< At most 8.

  friend bool operator==(const Advertisement&, const Advertisement&) = default;
};

/// The link of an address (Link::address()) as other machines reach it: "grpc://0.0.0.0:7420" becomes "grpc://:7420".
/// The uri is empty if they cannot reach it: a link on the loopback address.
[[nodiscard]] AdvertisedLink advertised_link(std::string_view address);

/// Strings "key=value" with txtvers, id, name, version, cal, wire, linkN, secN. A link that does not fit is left out.
[[nodiscard]] std::vector<std::string> advertisement_to_txt(const Advertisement& advertisement);

/// Unknown keys are ignored; of a repeated key the first is used (RFC 6763, section 6.4). invalid_argument names the
/// key that is missing, malformed, too long or not printable, or an unknown txtvers.
[[nodiscard]] Result<Advertisement> advertisement_from_txt(const std::vector<std::string>& txt);

}  // namespace lightwell
