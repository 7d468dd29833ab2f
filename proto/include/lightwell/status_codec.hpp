// A probe's status as bytes: InfoResponse of probe_service.proto, whole, and in parts for links without RPC.
//   InfoAnswer, decode_info        the whole response
//   encode_status, decode_status   identity and counters, without the clock
//   encode_clock, decode_clock     the clock only
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <lightwell/result.hpp>
#include <lightwell/status.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

struct InfoAnswer {
  StatusSnapshot status;
  ProbeTime clock_now;  ///< When the response was made.
};

/// data_loss for bytes that are not an InfoResponse.
[[nodiscard]] Result<InfoAnswer> decode_info(std::span<const std::byte> bytes);

/// InfoResponse in binary form; clock_now_ns is not set.
[[nodiscard]] std::string encode_status(const StatusSnapshot& status);

/// data_loss for bytes that are not an InfoResponse. invalid_argument, naming the field, for one with values that no
/// probe sends: an empty name, a name above 64 bytes, a version or a camera above 256 bytes.
[[nodiscard]] Result<StatusSnapshot> decode_status(std::span<const std::byte> bytes);

/// InfoResponse in binary form with only clock_now_ns.
[[nodiscard]] std::string encode_clock(ProbeTime now);

/// data_loss for bytes that are not an InfoResponse, or whose clock is missing or beyond 73 years.
[[nodiscard]] Result<ProbeTime> decode_clock(std::span<const std::byte> bytes);

}  // namespace lightwell
