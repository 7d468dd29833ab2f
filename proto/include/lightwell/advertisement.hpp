// What a probe says of itself in DNS-SD (RFC 6763), service type _lightwell._tcp. The host's side of it is hostile
// input: anybody on the network can say anything.
//   Advertisement            the values
//   advertisement_to_txt     the strings of the TXT record
//   advertisement_from_txt   checked and bounded
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

inline constexpr std::string_view kServiceType = "_lightwell._tcp";

struct AdvertisedLink {
  /// "grpc://:7420": an empty host is the machine that the service record names. "mqtts://broker:8883/venue/probe".
  std::string uri;
  /// "none" or "tls".
  std::string security;

  friend bool operator==(const AdvertisedLink&, const AdvertisedLink&) = default;
};

struct Advertisement {
  std::string name;  ///< 1 to 64 bytes of UTF-8 without control characters.
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
  std::string version;  ///< Of the firmware, "0.1.0"; 1 to 32 of the characters that versions have.
  std::uint32_t wire_version = 0;
  std::vector<AdvertisedLink> links;  ///< At most 8.

  friend bool operator==(const Advertisement&, const Advertisement&) = default;
};

/// Of what a link says of itself (Link::address()), as other machines reach it: "grpc://0.0.0.0:7420" becomes
/// "grpc://:7420". An empty uri where they do not: a link on the loopback address.
[[nodiscard]] AdvertisedLink advertised_link(std::string_view address);

/// "key=value" each: txtvers, id, name, version, cal, wire, linkN, secN. A link that does not fit is left out.
[[nodiscard]] std::vector<std::string> advertisement_to_txt(const Advertisement& advertisement);

/// Keys that are not known are passed over; of one that comes twice the first counts (RFC 6763, section 6.4).
/// invalid_argument names the key: what is missing, malformed, too long, not printable, or of another txtvers.
[[nodiscard]] Result<Advertisement> advertisement_from_txt(const std::vector<std::string>& txt);

}  // namespace lightwell
