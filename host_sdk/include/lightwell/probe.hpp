// Client API of a probe: connect, then query the lighting.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration_summary.hpp>
#include <lightwell/credentials.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/plane_appearance.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

/// Version of this library, such as "0.1.0".
[[nodiscard]] std::string_view version();

/// Default port of a grpc:// or grpcs:// URI.
inline constexpr int kDefaultPort = 7420;
/// Default port of a ws:// or wss:// URI.
inline constexpr int kDefaultWebPort = 7443;

/// One received descriptor. Spans and references are valid during the call.
struct Arrival {
  std::span<const std::byte> bytes;  ///< Exactly as received, unknown fields included.
  const Descriptor& descriptor;
  HostTime mid_exposure;  ///< Mid-exposure, mapped to the host's clock.
  HostTime received;      ///< When the message was received.
  HostTime stored;        ///< From when Probe::latest() returned it.
};

/// One received message of a captured plane (PlaneUpdate). The span is valid during the call.
struct PlaneArrival {
  std::span<const std::byte> bytes;  ///< Exactly as received, unknown fields included.
  HostTime received;                 ///< When the message was received.
};

/// Credentials for an MQTT broker (mqtt:// and mqtts:// only). Files are PEM; an empty path means none.
struct MqttCredentials {
  /// Certification authorities for the broker's certificate. Empty: the system's. The certificate must be valid for the
  /// host name in the URI.
  std::string ca_file;
  /// The client's certificate and its key (without a pass phrase), if the broker requires one.
  std::string certificate_file, key_file;
  /// Sent over mqtts:// and to a broker on this machine. Over mqtt:// to another machine they are sent only if the
  /// address ends in `?security=plain`, because anyone on the network could read them.
  std::string user, password;

  /// invalid_argument names the field, not_found the file.
  [[nodiscard]] Status validate() const;
};

/// Whether a Probe receives the plane that the probe captures. A whole plane is about 400 kB with its texture, 120 kB
/// without.
enum class PlaneReception : std::uint8_t { none, receive };

struct ProbeOptions {
  /// Older answers are stale. Smaller: the application detects earlier that descriptors no longer arrive.
  Duration max_age = Lighting::kDefaultMaxAge;
  /// Number of descriptors kept for at(). Each costs about 2 kB (with an environment map of 32² 24 kB, of 64² 55 kB),
  /// and a pointer copy for every received descriptor.
  int history = 64;
  /// How far beyond the newest descriptor at() extrapolates lights, 0 to 1 s. The velocity is measured over at least as
  /// much time in the past, so noise of directions at most triples. Longer: overshoots where a light stops. 0: the
  /// newest descriptor is held.
  Duration extrapolation{50'000'000};
  /// Limit of connect() and of each later connection attempt. Longer: a wrong address is noticed later.
  Duration connect_timeout{2'000'000'000};
  /// First pause between connection attempts; pauses double, with 20 % jitter. Shorter: more network traffic.
  Duration retry_min{100'000'000};
  /// Longest pause between attempts, and so the longest delay after the network is back. Shorter: more attempts while
  /// the network is down, and more load on a probe with many clients.
  Duration retry_max{500'000'000};
  /// The connection is closed and made again if nothing arrives from the probe for this long (its clock is requested
  /// every second). Shorter: a busy network is mistaken for a broken one.
  Duration silence_limit{4'000'000'000};
  /// Fixed pose of the probe in the application's world, if known. latest_in_world() prefers it to the mounting that
  /// the probe reports (ProbeInfo::T_world_probe, in the frame of the room). For a moving probe call
  /// latest().in_world(pose) with the current pose.
  std::optional<UncertainPose> T_world_probe;
  /// receive: for plane(). Over MQTT a whole plane arrives within the probe's key interval, 10 s; over the other links
  /// at once. A recording has planes if it was made with them (`lightwell record --plane`).
  PlaneReception plane = PlaneReception::none;
  MqttCredentials mqtt;
  /// Trust anchors for a grpcs:// or wss:// probe, and this client's identity. Empty: those that `lightwell pair`
  /// stored.
  ProbeCredentials credentials;
  /// Called for every valid descriptor on the reader thread, which waits for its return: be quick, do not throw, do not
  /// destroy the Probe. Meant for recording; applications call latest().
  std::function<void(const Arrival&)> on_descriptor;
  /// The same for every valid message of a plane. Needs `plane`.
  std::function<void(const PlaneArrival&)> on_plane;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// Properties of a probe and of its clock.
struct ProbeInfo {
  std::string name;
  std::uint32_t id = 0;
  std::uint32_t calibration_id = 0;
  std::string version;  ///< Firmware version.
  std::string camera;
  /// The probe's clock minus the host's. The true value is within clock_uncertainty of it.
  Duration clock_offset;
  /// Maximum error of clock_offset: half the width of the interval that the stored round trips allow.
  Duration clock_uncertainty;
  /// Drift of the probe's clock against the host's, ppm; limited to +-100.
  double clock_drift_ppm = 0;
  Counters counters;  ///< The probe's counters since its start; at most about a second old.
  /// The probe's pose in the frame of its room, if it was configured (lightwelld --mounting).
  std::optional<UncertainPose> T_world_probe;
  /// Of the hottest thermal zone of the probe's machine, degrees Celsius; no value if it has no sensor.
  std::optional<float> temperature_c;
  /// The probe's links, with their counters; empty with older firmware.
  std::vector<LinkStatus> links;
  /// The probe's own recording; at most about a second old. No value if the probe has no folder for recordings, or
  /// firmware that is too old for them.
  std::optional<RecordingStatus> recording;
};

enum class LinkState : std::uint8_t {
  connecting,  ///< A connection attempt is in progress.
  connected,   ///< Descriptors are received as the probe makes them.
  waiting,     ///< The last attempt failed; the next follows after a pause.
  ended,       ///< The end of the recording is reached. No more descriptors follow.
  gone,        ///< MQTT only: connected to the broker, which reports that the probe is offline. Waiting for it.
};

[[nodiscard]] constexpr std::string_view to_string(LinkState state) {
  constexpr std::string_view kNames[] = {"connecting", "connected", "waiting", "ended", "gone"};
  return state <= LinkState::gone ? kNames[static_cast<std::size_t>(state)] : "unknown";
}

/// Statistics since connect().
struct LinkStats {
  std::uint64_t received = 0;     ///< Valid descriptors.
  std::uint64_t bytes = 0;        ///< Total size of the valid descriptors.
  std::uint64_t gaps = 0;         ///< Missing captures: gaps in the sequence numbers.
  std::uint64_t oversized = 0;    ///< Messages above kMaxDescriptorBytes, dropped without decoding.
  std::uint64_t undecodable = 0;  ///< Messages that are not valid; the last valid descriptor and plane are kept.
  std::uint64_t replayed = 0;     ///< Descriptors that were received again after a newer one: dropped.
  /// USB only, where each message is a numbered frame: frames that were not received (in flight when the cable was
  /// pulled), and frames that were damaged, malformed, too large or repeated.
  std::uint64_t frames_lost = 0;
  std::uint64_t frames_refused = 0;
  /// Descriptors rejected as replays: not newer than an earlier one, or dated in the future; messages of a plane that
  /// are dated in the future or of an earlier capture. Counted for MQTT, where other clients of the broker may publish.
  std::uint64_t untimely = 0;
  std::uint64_t reconnects = 0;  ///< Number of reconnections.
  std::uint64_t maps = 0;        ///< Environment maps received, whole or as changes.
  /// Changes to a whole map that was not received: the last map is kept until the next whole one.
  std::uint64_t maps_without_key = 0;
  LinkState state = LinkState::connecting;
  std::string last_error;  ///< Last error of the link or of a rejected message; empty if there was none.
};

/// A connection to one probe, with the received descriptors. One reader thread per Probe receives descriptors and
/// reconnects automatically. Every method may be called from any thread; a moved-from Probe may only be destroyed or
/// assigned to.
class Probe {
 public:
  /// uri: one of
  ///   grpc://host:port    default port 7420; IPv6 as `grpc://[::1]:7420`; `grpcs://` with TLS (credentials)
  ///   ws://host:port      the probe's link by WebSocket, default port 7443; `wss://` with TLS (credentials)
  ///   usb:SERIAL          or `usb:` for the only probe on USB
  ///   replay:PATH         a recording of descriptors at its original speed; `?speed=2` twice as fast, `?speed=0` as
  ///                       fast as it can be read
  ///   mqtt://host:port/venue/probe   a broker and the probe's base topic; default port 1883; `mqtts://` with TLS, 8883
  /// invalid_argument: the URI or the options; the message says what is allowed. unavailable: no response within
  /// connect_timeout, or a certificate was rejected; over MQTT, that the probe is offline or does not report its clock,
  /// without which no age is known. not_found, data_loss: the recording. not_found: no credentials for this probe, or a
  /// file of MqttCredentials is missing. failed_precondition: the SDK was built without libusb, MQTT,
  /// libwebsockets or gRPC.
  [[nodiscard]] static Result<Probe> connect(std::string_view uri, ProbeOptions options = {});

  Probe(Probe&&) noexcept;
  Probe& operator=(Probe&&) noexcept;
  /// Closes the connection and joins its thread, within a second.
  ~Probe();

  /// The newest descriptor. For render threads: lock-free, no allocation, independent of the reader thread; tens of
  /// nanoseconds. Validity::none before the first descriptor.
  [[nodiscard]] Lighting latest() const;

  /// latest().in_world(T_world_probe), which allocates and takes about 20 µs: call it once per frame. T_world_probe is
  /// that of ProbeOptions, else the mounting that the probe reported when the descriptor was received;
  /// Validity::invalid_query if neither is known.
  [[nodiscard]] Lighting latest_in_world() const;

  /// The lighting at `time`: interpolated between the two neighbouring descriptors (harmonics linearly; lights matched
  /// by track; a light that only one of them has fades in or out). After the newest descriptor, directions of lights
  /// are extrapolated within ProbeOptions::extrapolation (irradiances and harmonics stay constant) and the error bound
  /// grows accordingly; beyond that the newest descriptor is held. Lighting::derivation() tells which applies. Before
  /// the oldest stored descriptor: Validity::before_history. stale if the nearest descriptor is more than max_age away.
  /// Lock-free; allocates when it interpolates.
  [[nodiscard]] Lighting at(HostTime time) const;

  /// The newest complete state of the plane that the probe captures. For render threads: as latest(). Validity::none
  /// without ProbeOptions::plane, before the first, and for a recording without planes.
  [[nodiscard]] PlaneAppearance plane() const;

  /// For tools: waits until the newest descriptor has a sequence number other than `seen` (nullopt: any) and returns
  /// it. It blocks, so not for render threads. unavailable after `timeout`, failed_precondition if the recording has
  /// ended.
  [[nodiscard]] Result<Lighting> wait_for_next(std::optional<std::uint64_t> seen, Duration timeout) const;

  /// Blocks briefly. Clock offset and uncertainty are zero for a recording.
  [[nodiscard]] ProbeInfo info() const;
  [[nodiscard]] LinkStats stats() const;

  /// The current configuration of the probe's estimator: the probe's file with the changes of all clients. Requests it
  /// from the probe; blocks as change_estimator(). failed_precondition if the probe's firmware is too old to report it.
  [[nodiscard]] Result<EstimatorConfig> estimator_config() const;
  /// The probe's active estimator. Blocks and fails as estimator_config().
  [[nodiscard]] Result<EstimatorKind> estimator_kind() const;

  /// Sets the fields that have a value, for all clients of the probe, and leaves the others unchanged:
  /// `change_estimator({.panorama = {.epsilon = 0.02}})`. Takes effect with the probe's next capture. Blocks until the
  /// probe responds, at most connect_timeout. invalid_argument: a value is not allowed, or no field is set.
  /// failed_precondition for a recording, and over MQTT, where a probe accepts no commands; otherwise the probe's
  /// error.
  [[nodiscard]] Status change_estimator(const EstimatorUpdate& fields);
  /// Replaces the whole configuration, including the fields that other clients or the probe's file have set and that
  /// have their defaults in `config`. Blocks and fails as change_estimator().
  [[nodiscard]] Status set_estimator(const EstimatorConfig& config);

  /// Reports to the probe the reading (lux) of a lux meter beside it that faces `normal` (probe frame, need not be
  /// normalised): from then on its units are absolute. Returns the factor that was applied to radiance. Blocks and
  /// fails as change_estimator().
  [[nodiscard]] Result<double> report_lux(double lux, Vec3f normal);

  /// What the probe's calibration covers, and how well. Blocks and fails as estimator_config().
  [[nodiscard]] Result<CalibrationSummary> calibration() const;

  /// Starts, or stops, a recording of all descriptors by the probe, in the folder that its owner has configured
  /// (`recordings`); the file stays there. Returns the state after it. Blocks and fails as change_estimator(), also:
  /// failed_precondition if the probe has no such folder or cannot write there, if a recording runs already, or none
  /// does. resource_exhausted: a limit of the folder or of the disk, or too many starts.
  [[nodiscard]] Result<RecordingStatus> start_recording();
  [[nodiscard]] Result<RecordingStatus> stop_recording();

 private:
  struct Impl;
  explicit Probe(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
