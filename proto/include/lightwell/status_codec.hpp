// A probe's status as bytes: InfoResponse of probe_service.proto, whole, and in parts for links that have no calls.
//   InfoAnswer, decode_info        all of it
//   encode_status, decode_status   who the probe is, with its counters, without the clock
//   encode_clock, decode_clock     the clock alone
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
  ProbeTime clock_now;  ///< When the answer was made.
};

/// data_loss for bytes that are no InfoResponse.
[[nodiscard]] Result<InfoAnswer> decode_info(std::span<const std::byte> bytes);

/// InfoResponse in binary form; clock_now_ns is not set.
[[nodiscard]] std::string encode_status(const StatusSnapshot& status);

/// data_loss for bytes that are no InfoResponse. invalid_argument, naming the field, for one that no probe sends:
/// without a name, with a name above 64 bytes, a version or a camera above 256.
[[nodiscard]] Result<StatusSnapshot> decode_status(std::span<const std::byte> bytes);

/// InfoResponse in binary form with clock_now_ns alone.
[[nodiscard]] std::string encode_clock(ProbeTime now);

/// data_loss for bytes that are no InfoResponse or tell no clock; a clock beyond 73 years is none.
[[nodiscard]] Result<ProbeTime> decode_clock(std::span<const std::byte> bytes);

}  // namespace lightwell
