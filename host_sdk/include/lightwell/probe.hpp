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
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

/// Of this library, "0.1.0".
[[nodiscard]] std::string_view version();

/// The port of a grpc:// URI that names none.
inline constexpr int kDefaultPort = 7420;

/// One descriptor on its way into the store; spans and references live during the call.
struct Arrival {
  std::span<const std::byte> bytes;  ///< Exactly as received, unknown fields included.
  const Descriptor& descriptor;
  HostTime mid_exposure;  ///< Mapped to the host's clock.
  HostTime received;      ///< The bytes were here.
  HostTime stored;        ///< From here on Probe::latest() returned it.
};

struct ProbeOptions {
  /// Older answers are stale. Smaller: the application learns earlier that the light is not
  /// followed.
  Duration max_age = Lighting::kDefaultMaxAge;
  /// Descriptors kept for at(). Each costs about 2 kB (with an environment map of 32² 24 kB, of 64²
  /// 55 kB), and a pointer copy for every arrival.
  int history = 64;
  /// How long connect() tries, and each later attempt to connect. Longer hides a wrong address.
  Duration connect_timeout{2'000'000'000};
  /// Pauses between attempts start here and double, with 20 % jitter. Shorter costs the network.
  Duration retry_min{100'000'000};
  /// Where the pauses stop growing. Longer keeps an application in the dark after a long outage.
  Duration retry_max{5'000'000'000};
  /// Without a byte from the probe (it is asked for its clock every second) the link is given up
  /// and made anew. Shorter takes a busy network for a broken one.
  Duration silence_limit{4'000'000'000};
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
  /// Half the best round trip, growing by 100 ppm of its age.
  Duration clock_uncertainty;
  Counters counters;  ///< The probe's own, since its start; at most about a second old.
};

enum class LinkState : std::uint8_t {
  connecting,  ///< An attempt is under way.
  connected,   ///< Descriptors come as the probe makes them.
  waiting,     ///< The last attempt failed; the next follows after a pause.
  ended,       ///< The recording is over. Nothing more will come.
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
  std::uint64_t reconnects = 0;   ///< Times that the link came back.
  std::uint64_t maps = 0;         ///< Environment maps that came, whole or as changes.
  /// Changes to a whole map that never came here: until the next whole one the last map stays.
  std::uint64_t maps_without_key = 0;
  LinkState state = LinkState::connecting;
  std::string
      last_error;  ///< Of the link or of the last refused message; empty while all went well.
};

/// A link to one probe and what came through it. One reader thread per Probe follows the probe and
/// reconnects by itself. Every method may be called from any thread; a moved-from Probe may only be
/// destroyed or assigned to.
class Probe {
 public:
  /// uri: `grpc://host:port` (port 7420 where none is named; `grpc://[::1]:7420`), or
  /// `replay:PATH`, a recording of descriptors played at its own pace; `replay:PATH?speed=2` twice
  /// as fast,
  /// `?speed=0` as fast as it is read.
  /// invalid_argument: the URI or the options, with what would be right. unavailable: nobody
  /// answered within connect_timeout. not_found, data_loss: the recording.
  [[nodiscard]] static Result<Probe> connect(std::string_view uri, ProbeOptions options = {});

  Probe(Probe&&) noexcept;
  Probe& operator=(Probe&&) noexcept;
  /// Ends the link and its thread, within a second.
  ~Probe();

  /// The newest. Made for render threads: takes no lock, allocates nothing, does not wait for the
  /// reader thread; tens of nanoseconds. Validity::none before the first descriptor.
  [[nodiscard]] Lighting latest() const;

  /// How it was lit at `time`: interpolated between the two neighbouring descriptors (harmonics
  /// linearly; lights matched by track; a light that only one of them has fades). Later than the
  /// newest: the newest is held. Earlier than the oldest kept: Validity::before_history. stale
  /// where the nearest descriptor is more than max_age away. Takes no lock; allocates when it
  /// interpolates.
  [[nodiscard]] Lighting at(HostTime time) const;

  /// For tools: waits for a newest descriptor with another sequence than `seen` (nullopt: for any)
  /// and returns it. Not for render threads: it blocks. unavailable after `timeout`,
  /// failed_precondition where the recording has ended.
  [[nodiscard]] Result<Lighting> wait_for_next(std::optional<std::uint64_t> seen,
                                               Duration timeout) const;

  /// Blocks shortly. Zero uncertainty and offset for a recording.
  [[nodiscard]] ProbeInfo info() const;
  [[nodiscard]] LinkStats stats() const;

  /// Takes effect with the probe's next capture. Blocks until the probe answers, at most
  /// connect_timeout. failed_precondition for a recording; otherwise what the probe said.
  [[nodiscard]] Status set_estimator(const EstimatorConfig& config);

  /// Tells the probe what a lux meter beside it reads, facing `normal` (probe frame, need not be
  /// normalised): from then on its units are absolute. Returns the factor that was applied.
  /// Blocks and fails as set_estimator().
  [[nodiscard]] Result<double> report_lux(double lux, Vec3f normal);

 private:
  struct Impl;
  explicit Probe(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
