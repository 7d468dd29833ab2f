// A probe's status: what links and dashboards report. As bytes it is an InfoResponse of probe_service.proto, whole, or
// in parts for links without RPC.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

/// Counters since the start of the daemon. Meanings: proto/lightwell/v1/probe_service.proto.
struct Counters {
  std::uint64_t frames = 0;
  std::uint64_t captures_dropped = 0;
  std::uint64_t brackets_incomplete = 0;
  std::uint64_t estimates = 0;
  std::uint64_t estimates_failed = 0;
  std::uint64_t descriptors_coalesced = 0;
  std::uint32_t clients = 0;
  std::uint64_t frames_recorded = 0;
  std::uint64_t recording_faults = 0;
  std::uint64_t frames_lost = 0;
  std::uint64_t setting_moves = 0;
  std::uint64_t estimates_late = 0;
  std::uint64_t estimates_late_at_fast = 0;
  std::uint64_t messages_refused = 0;
  std::uint64_t authentication_failures = 0;
  std::uint64_t client_list_faults = 0;

  friend bool operator==(const Counters&, const Counters&) = default;
};

/// What a client asks of the probe's own recording.
enum class RecordingAction : std::uint8_t { start = 1, stop = 2 };

/// The probe's own recording of what it sends: the one that runs, otherwise the last one.
struct RecordingStatus {
  bool running = false;
  std::string file;  ///< Name in the probe's folder, without the folder; empty before the first recording.
  std::uint64_t bytes = 0;
  std::uint64_t descriptors = 0;
  std::uint64_t lost = 0;    ///< Messages that came while the disk was too slow, and are missing in the file.
  std::string end_reason;    ///< Why it ended although no client stopped it: a limit or a fault; otherwise empty.
  std::uint64_t faults = 0;  ///< Recordings that a fault or a limit ended, since the start of the daemon.

  friend bool operator==(const RecordingStatus&, const RecordingStatus&) = default;
};

/// One link of the probe. Counters: since the start of the daemon.
struct LinkStatus {
  std::string name;           ///< "grpc", "web", "usb_gadget" or "mqtt".
  std::uint32_t clients = 0;  ///< Now.
  std::uint64_t descriptors_coalesced = 0;
  std::uint64_t messages_refused = 0;
  std::uint64_t authentication_failures = 0;
  bool fault = false;  ///< It has a fault now; the probe's log says which.

  friend bool operator==(const LinkStatus&, const LinkStatus&) = default;
};

struct StatusSnapshot {
  std::string probe_name;
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
  std::string version;
  std::string camera;
  Counters counters{};
  std::optional<UncertainPose> T_world_probe{};  ///< Mounting of the probe in its room, if configured.
  std::optional<float> temperature_c{};          ///< Of the hottest thermal zone, if the machine has a sensor.
  std::vector<LinkStatus> links{};
  std::optional<RecordingStatus> recording{};  ///< If the probe has a folder for recordings.

  friend bool operator==(const StatusSnapshot&, const StatusSnapshot&) = default;
};

struct InfoAnswer {
  StatusSnapshot status;
  ProbeTime clock_now;  ///< When the response was made.
};

/// data_loss for bytes that are not an InfoResponse.
[[nodiscard]] Result<InfoAnswer> decode_info(std::span<const std::byte> bytes);

/// InfoResponse in binary form; clock_now_ns is not set.
[[nodiscard]] std::string encode_status(const StatusSnapshot& status);

/// data_loss for bytes that are not an InfoResponse. invalid_argument, naming the field, for one with values that no
/// probe sends: an empty name, a name above 64 bytes, a version, a camera or a text of the recording above 256 bytes.
[[nodiscard]] Result<StatusSnapshot> decode_status(std::span<const std::byte> bytes);

/// InfoResponse in binary form with only clock_now_ns.
[[nodiscard]] std::string encode_clock(ProbeTime now);

/// data_loss for bytes that are not an InfoResponse, or whose clock is missing or beyond 73 years.
[[nodiscard]] Result<ProbeTime> decode_clock(std::span<const std::byte> bytes);

}  // namespace lightwell
