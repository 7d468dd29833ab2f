// A probe, as an application sees it: connect, then ask how it is lit.
//   version                  of this library
//   ProbeOptions, Arrival    how a probe is followed
//   ProbeInfo, LinkStats     what is known of the probe, and how the link fares
//   Probe                    the connection
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/credentials.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

struct MqttAddress;

/// Of this library, "0.1.0".
[[nodiscard]] std::string_view version();

/// The port of a grpc:// or grpcs:// URI that names none.
inline constexpr int kDefaultPort = 7420;

/// One descriptor on its way into the store; spans and references live during the call.
struct Arrival {
  std::span<const std::byte> bytes;  ///< Exactly as received, unknown fields included.
  const Descriptor& descriptor;
  HostTime mid_exposure;  ///< Mapped to the host's clock.
  HostTime received;      ///< The bytes were here.
  HostTime stored;        ///< From here on Probe::latest() returned it.
};

/// With what a broker is met. Files are PEM; empty where there is none. For mqtt:// and mqtts:// alone.
struct MqttCredentials {
  /// Of the authorities that may have signed the broker's certificate. Empty: the system's. The certificate must name
  /// the broker as the URI does.
  std::string ca_file;
  /// Our own certificate and its key (without a pass phrase), where the broker asks for one.
  std::string certificate_file, key_file;
  /// They go over mqtts:// and to a broker on this machine; over mqtt:// elsewhere only where the address ends in
  /// `?security=plain`, for everyone on the network could read them.
  std::string user, password;

  /// invalid_argument names the field, not_found the file.
  [[nodiscard]] Status validate() const;
};

struct ProbeOptions {
  /// Older answers are stale. Smaller: the application learns earlier that the light is not
  /// followed.
  Duration max_age = Lighting::kDefaultMaxAge;
  /// Descriptors kept for at(). Each costs about 2 kB (with an environment map of 32² 24 kB, of 64²
  /// 55 kB), and a pointer copy for every arrival.
  int history = 64;
  /// How far beyond the newest descriptor at() moves lights on, 0 to 1 s. It looks back as far as it looks ahead, so
  /// noise of directions at most triples. Longer: a lamp that stops is followed past its stop. 0: the newest is held.
  Duration extrapolation{50'000'000};
  /// How long connect() tries, and each later attempt to connect. Longer hides a wrong address.
  Duration connect_timeout{2'000'000'000};
  /// Pauses between attempts start here and double, with 20 % jitter. Shorter costs the network.
  Duration retry_min{100'000'000};
  /// Where the pauses stop growing: so long an application may be in the dark after the network is back. Shorter costs
  /// a network that is down, and a probe that many look for, an attempt each.
  Duration retry_max{500'000'000};
  /// Without a byte from the probe (it is asked for its clock every second) the link is given up
  /// and made anew. Shorter takes a busy network for a broken one.
  Duration silence_limit{4'000'000'000};
  /// Where the probe is in the application's world, where that is known and stays so. For latest_in_world(), before
  /// what the probe itself was told of its mounting (ProbeInfo::T_world_probe), whose world is the room's. A probe that
  /// moves: ask latest().in_world(pose) with the pose of the moment.
  std::optional<UncertainPose> T_world_probe;
  MqttCredentials mqtt;
  /// Whom a grpcs:// probe is trusted for, and who this client is. Empty: what `lightwell pair` wrote.
  ProbeCredentials credentials;
  /// Called for every good descriptor on the reader thread, which waits for it: be quick, do not
  /// throw, do not destroy the Probe. How a tool records; an application asks latest().
  std::function<void(const Arrival&)> on_descriptor;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// What is known of a probe.
struct ProbeInfo {
  std::string name;
  std::uint32_t id = 0;
  std::uint32_t calibration_id = 0;
  std::string version;  ///< Of its firmware.
  std::string camera;
  /// The probe's clock minus the host's. The true value is within clock_uncertainty of it.
  Duration clock_offset;
  /// Half the width of what all round trips of the last minutes leave possible.
  Duration clock_uncertainty;
  /// How fast the probe's clock gains on the host's, in millionths; within 100 of zero.
  double clock_drift_ppm = 0;
  Counters counters;  ///< The probe's own, since its start; at most about a second old.
  /// Where the probe hangs in its own room, where it was told (lightwelld --mounting).
  std::optional<UncertainPose> T_world_probe;
};

enum class LinkState : std::uint8_t {
  connecting,  ///< An attempt is under way.
  connected,   ///< Descriptors come as the probe makes them.
  waiting,     ///< The last attempt failed; the next follows after a pause.
  ended,       ///< The recording is over. Nothing more will come.
  gone,        ///< Of MQTT: the broker is there, and says that the probe has left it. It is waited for.
};

[[nodiscard]] constexpr std::string_view to_string(LinkState state) {
  switch (state) {
    case LinkState::connecting:
      return "connecting";
    case LinkState::connected:
      return "connected";
    case LinkState::waiting:
      return "waiting";
    case LinkState::ended:
      return "ended";
    case LinkState::gone:
      return "gone";
  }
  return "unknown";
}

/// Since connect().
struct LinkStats {
  std::uint64_t received = 0;     ///< Good descriptors.
  std::uint64_t bytes = 0;        ///< Of the good ones.
  std::uint64_t gaps = 0;         ///< Captures that never came, from holes in the sequence.
  std::uint64_t oversized = 0;    ///< Messages above kMaxDescriptorBytes, dropped unread.
  std::uint64_t undecodable = 0;  ///< Messages that were no descriptor; the last good one stays.
  std::uint64_t replayed = 0;     ///< Descriptors that came again after a newer one: dropped.
  /// By USB alone, where each message is a numbered frame: those that never came (in flight as the
  /// cable was pulled), and those that came damaged, malformed, too large or a second time.
  std::uint64_t frames_lost = 0;
  std::uint64_t frames_refused = 0;
  /// Descriptors not newer than what had come, or dated in the future: replays. Refused. Counted where others than the
  /// probe may write, at a broker.
  std::uint64_t untimely = 0;
  std::uint64_t reconnects = 0;  ///< Times that the link came back.
  std::uint64_t maps = 0;        ///< Environment maps that came, whole or as changes.
  /// Changes to a whole map that never came here: until the next whole one the last map stays.
  std::uint64_t maps_without_key = 0;
  LinkState state = LinkState::connecting;
  std::string last_error;  ///< Of the link or of the last refused message; empty while all went well.
};

/// A link to one probe and what came through it. One reader thread per Probe follows the probe and
/// reconnects by itself. Every method may be called from any thread; a moved-from Probe may only be
/// destroyed or assigned to.
class Probe {
 public:
  /// uri: `grpc://host:port` (port 7420 where none is named; `grpc://[::1]:7420`), over TLS `grpcs://host:port` (see
  /// ProbeOptions::credentials); `usb:SERIAL`, or `usb:` for the only probe that is plugged in; or `replay:PATH`, a
  /// recording of descriptors played at its own pace; `replay:PATH?speed=2` twice as fast,
  /// `?speed=0` as fast as it is read; or `mqtt://broker:1883/venue/probe`, `mqtts://` with TLS: a broker and the topic
  /// below which the probe publishes (ports 1883 and 8883 where none is named).
  /// invalid_argument: the URI or the options, with what would be right. unavailable: nobody
  /// answered within connect_timeout, or the probe's certificate or ours was refused, as the message says; at a broker,
  /// that the probe has gone or does not tell its clock, without which no age is known. not_found, data_loss: the
  /// recording. not_found: there are no credentials for this probe, or a file of MqttCredentials is not there.
  /// failed_precondition: an SDK that was built without libusb or without MQTT.
  [[nodiscard]] static Result<Probe> connect(std::string_view uri, ProbeOptions options = {});

  Probe(Probe&&) noexcept;
  Probe& operator=(Probe&&) noexcept;
  /// Ends the link and its thread, within a second.
  ~Probe();

  /// The newest. Made for render threads: takes no lock, allocates nothing, does not wait for the
  /// reader thread; tens of nanoseconds. Validity::none before the first descriptor.
  [[nodiscard]] Lighting latest() const;

  /// latest().in_world(T_world_probe), which allocates and takes about 20 µs: ask once a frame. T_world_probe is that
  /// of ProbeOptions, else what the probe said of itself when the descriptor came; Validity::invalid_query where
  /// neither knows where the probe is.
  [[nodiscard]] Lighting latest_in_world() const;

  /// How it was lit at `time`: interpolated between the two neighbouring descriptors (harmonics
  /// linearly; lights matched by track; a light that only one of them has fades). Later than the
  /// newest: lights go on as they moved before, within ProbeOptions::extrapolation (brightness and harmonics stay: a
  /// lamp that was switched on does not grow brighter and brighter), and the bound grows by what that moves; beyond,
  /// the newest is held. Lighting::derivation() says which. Earlier than the oldest kept: Validity::before_history.
  /// stale where the nearest descriptor is more than max_age away. Takes no lock; allocates when it interpolates.
  [[nodiscard]] Lighting at(HostTime time) const;

  /// For tools: waits for a newest descriptor with another sequence than `seen` (nullopt: for any)
  /// and returns it. Not for render threads: it blocks. unavailable after `timeout`,
  /// failed_precondition where the recording has ended.
  [[nodiscard]] Result<Lighting> wait_for_next(std::optional<std::uint64_t> seen, Duration timeout) const;

  /// Blocks shortly. Zero uncertainty and offset for a recording.
  [[nodiscard]] ProbeInfo info() const;
  [[nodiscard]] LinkStats stats() const;

  /// How the probe's estimator is configured now, by its owner's file and by all clients since. Asks the probe; blocks
  /// as change_estimator(). failed_precondition where the probe's firmware is too old to tell.
  [[nodiscard]] Result<EstimatorConfig> estimator_config() const;
  /// Which estimator runs there. As estimator_config().
  [[nodiscard]] Result<EstimatorKind> estimator_kind() const;

  /// Sets the fields that have a value, for all clients of the probe, and leaves the others as they are:
  /// `change_estimator({.panorama = {.epsilon = 0.02}})`. Takes effect with the probe's next capture. Blocks until the
  /// probe answers, at most connect_timeout. invalid_argument: a value, or no field at all. failed_precondition for a
  /// recording, and over MQTT, where a probe takes no commands; otherwise what the probe said.
  [[nodiscard]] Status change_estimator(const EstimatorUpdate& fields);
  /// Replaces the whole configuration: what the owner or other clients chose is lost, also in the fields that are
  /// defaults here. As change_estimator().
  [[nodiscard]] Status set_estimator(const EstimatorConfig& config);

  /// Tells the probe what a lux meter beside it reads, facing `normal` (probe frame, need not be
  /// normalised): from then on its units are absolute. Returns the factor that was applied.
  /// Blocks and fails as change_estimator().
  [[nodiscard]] Result<double> report_lux(double lux, Vec3f normal);

 private:
  struct Impl;
  explicit Probe(std::unique_ptr<Impl> impl);
  [[nodiscard]] static Result<Probe> connect_at_broker(const MqttAddress& broker, const ProbeOptions& options,
                                                       std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
