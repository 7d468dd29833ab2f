#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/plane_codec.hpp>
#include <lightwell/quantile.hpp>
#include <lightwell/recording.hpp>
#include <lightwell/text.hpp>

#include "common.hpp"
#include "mcap_writer.hpp"

namespace lightwell::tool {
namespace {

constexpr Duration kSecond{1'000'000'000};

volatile std::sig_atomic_t signal_seen = 0;

void on_signal(int) { signal_seen = 1; }

/// What to add to a time of the host's monotonic clock, now: somebody may set the clock.
std::int64_t utc_minus_monotonic_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
             .count() -
         monotonic_now_ns();
}

/// Passes the descriptors of a probe to `take` and to the recording, until --seconds are over, a played recording ends,
/// or SIGINT or SIGTERM arrives, which do not end the process, so that a summary is printed. No descriptor is dropped
/// here: the SDK's reader thread runs `take`. If it is slow, a played recording waits, and a probe drops descriptors,
/// which is visible as gaps in the sequence.
class Feed {
 public:
  /// Connects, and opens the file of the options, if any.
  Feed(const Options& options, std::function<void(const Arrival&)> take) : file_(options.file), take_(std::move(take)) {
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    const std::lock_guard lock(mutex_);  // Descriptors wait until the file is open.
    std::function<void(const PlaneArrival&)> put_planes;
    if (options.plane) put_planes = [this](const PlaneArrival& arrival) { put_plane(arrival); };
    probe_.emplace(connect(
        options, [this](const Arrival& arrival) { put(arrival); }, put_planes));
    start_ = HostTime{monotonic_now_ns()};
    if (options.seconds > 0) end_ = start_ + Duration::from_seconds(options.seconds);
    const RecordingKind kind = options.plane ? RecordingKind::descriptors_and_planes : RecordingKind::descriptors;
    if (options.mcap)
      mcap_.emplace(require(McapWriter::create(file_, probe_->info().name), kFile));
    else if (!file_.empty())
      writer_.emplace(
          require(RecordWriter::open(file_, {kind, probe_->info().name, std::string(version()), {}}), kFile));
  }

  [[nodiscard]] const Probe& probe() const { return *probe_; }
  /// When the probe was connected.
  [[nodiscard]] HostTime start() const { return start_; }
  /// When --seconds are over.
  [[nodiscard]] HostTime end() const { return end_; }

  /// Number of recorded messages of planes.
  [[nodiscard]] std::uint64_t planes() const { return planes_; }

  /// Waits until `until`; false if there are no more descriptors, at end() at the latest.
  [[nodiscard]] bool wait(HostTime until) {
    // In short periods, because neither a signal nor the end of a recording notifies.
    constexpr std::int64_t kPollPeriod = 20'000'000;
    for (;;) {
      const HostTime now{monotonic_now_ns()};
      {
        const std::lock_guard lock(mutex_);
        require(written_, kFile);
        if (signal_seen != 0 || now >= end_ || probe_->stats().state == LinkState::ended) return false;
      }
      if (now >= until) return true;
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(kPollPeriod, (until - now).ns)));
    }
  }

  /// No descriptor is passed while the lock is held.
  [[nodiscard]] std::unique_lock<std::mutex> lock() { return std::unique_lock(mutex_); }

  /// Ends the recording; no descriptor is passed any more. An error names the file.
  [[nodiscard]] Status close() {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(closed_, true) && mcap_ && written_.ok()) written_ = mcap_->finish().in(file_);
    return written_;
  }

 private:
  void put(const Arrival& arrival) {
    const std::lock_guard lock(mutex_);
    if (closed_ || !written_.ok()) return;
    take_(arrival);
    write(arrival.mid_exposure, arrival.received, arrival.bytes, RecordedMessage::descriptor);
  }

  void put_plane(const PlaneArrival& arrival) {
    const std::lock_guard lock(mutex_);
    if (closed_ || !written_.ok()) return;
    write(arrival.received, arrival.received, arrival.bytes, RecordedMessage::plane);
    ++planes_;
  }

  /// published: when it was measured, if that is known.
  void write(HostTime published, HostTime received, std::span<const std::byte> bytes, RecordedMessage message) {
    if (mcap_) {
      const std::int64_t utc_ns = utc_minus_monotonic_ns();
      written_ = mcap_->append(
          {static_cast<std::uint64_t>(published.ns + utc_ns), static_cast<std::uint64_t>(received.ns + utc_ns)}, bytes,
          message);
    } else if (writer_) {
      written_ = writer_->append(received.ns, bytes, message);
      // Each record goes to the file at once: a killed process loses none that it received.
      if (written_.ok()) written_ = writer_->flush();
    }
    written_ = written_.in(file_);
  }

  std::mutex mutex_;
  const std::string file_;
  const std::function<void(const Arrival&)> take_;
  std::optional<RecordWriter> writer_;
  std::optional<McapWriter> mcap_;
  Status written_;
  bool closed_ = false;
  std::atomic<std::uint64_t> planes_{0};
  HostTime start_, end_{std::numeric_limits<std::int64_t>::max()};
  std::optional<Probe> probe_;  // Last, because its thread uses the members above.
};

/// Statistics of the descriptors of a time interval. Percentiles are nearest-rank (lower_quantile()).
class WatchStatistics {
 public:
  void add(const Arrival& item) {
    const Duration delivered = item.descriptor.time.delivered_after;
    latency_ms_.push_back((item.stored - (item.mid_exposure + delivered)).milliseconds());
    age_ms_.push_back((item.stored - item.mid_exposure).milliseconds());
    bytes_.push_back(static_cast<double>(item.bytes.size()));
    newest_ = item.descriptor;
  }
  [[nodiscard]] bool empty() const { return latency_ms_.empty(); }

  /// `kind` is "second" or "summary", `seconds` the length of the interval; the probe's counters are since the start.
  /// The keys of the JSON are documented in `lightwell watch --help`.
  void print(std::string_view kind, double seconds, const Probe& probe, bool json) {
    const LinkStats stats = probe.stats();
    const double clock_ms = probe.info().clock_uncertainty.milliseconds();
    if (json)
      print_json(json_of(kind, seconds, stats, clock_ms));
    else
      std::printf("%s%s\n", kind == "summary" ? "all: " : "", text_of(seconds, stats, clock_ms).c_str());
    std::fflush(stdout);
  }

 private:
  nlohmann::ordered_json json_of(std::string_view kind, double seconds, const LinkStats& stats, double clock_ms) {
    const std::size_t count = latency_ms_.size();
    const auto whole = [](double n) {
      return std::isfinite(n) ? nlohmann::ordered_json(std::llround(n)) : nlohmann::ordered_json();
    };
    return {{"kind", kind},
            {"seconds", seconds},
            {"frames", count},
            {"frames_per_s", seconds > 0 ? static_cast<double>(count) / seconds : 0},
            {"latency_p50_ms", lower_quantile(latency_ms_, 0.5)},
            {"latency_p99_ms", lower_quantile(latency_ms_, 0.99)},
            {"age_p50_ms", lower_quantile(age_ms_, 0.5)},
            {"age_p99_ms", lower_quantile(age_ms_, 0.99)},
            {"bytes_p50", whole(lower_quantile(bytes_, 0.5))},
            {"bytes_max", whole(lower_quantile(bytes_, 1))},
            {"lights", newest_.lights.size()},
            {"band", newest_.radiance.band},
            {"bound", newest_.bound.total},
            {"flags", flag_names(newest_.flags)},
            {"sequence", newest_.sequence},
            {"gaps", stats.gaps},
            {"rejected", stats.oversized + stats.undecodable + stats.replayed + stats.frames_refused + stats.untimely},
            {"reconnects", stats.reconnects},
            {"clock_uncertainty_ms", clock_ms},
            {"state", to_string(stats.state)}};
  }

  std::string text_of(double seconds, const LinkStats& stats, double clock_ms) {
    if (empty()) {
      std::string text = "no descriptor; the link is " + std::string(to_string(stats.state));
      return stats.last_error.empty() ? text : text + " (" + stats.last_error + ")";
    }
    return formatted(
        "%5.1f/s  latency %.2f / %.2f ms  age %.1f / %.1f ms  clock +-%.2f ms  %.0f B  "
        "lights %zu  band %d  bound %s  flags %s  gaps %llu",
        static_cast<double>(latency_ms_.size()) / seconds, lower_quantile(latency_ms_, 0.5),
        lower_quantile(latency_ms_, 0.99), lower_quantile(age_ms_, 0.5), lower_quantile(age_ms_, 0.99), clock_ms,
        lower_quantile(bytes_, 0.5), newest_.lights.size(), newest_.radiance.band,
        bound_text(newest_.bound.total).c_str(), flags_text(newest_.flags).c_str(),
        static_cast<unsigned long long>(stats.gaps));
  }

  std::vector<double> latency_ms_, age_ms_, bytes_;
  Descriptor newest_;
};

/// A line of `lightwell replay`.
void print_descriptor(double seconds, std::size_t bytes, const Descriptor& descriptor) {
  const Lighting lighting = Lighting::of(descriptor);
  const double up = static_cast<double>(lighting.irradiance({0, 1, 0}).value.luminance());
  std::printf(
      "#%llu  %8.3f s  %zu B  band %d  lights %zu  upward irradiance %.4g%s  bound %s  "
      "flags %s\n",
      static_cast<unsigned long long>(descriptor.sequence), seconds, bytes, descriptor.radiance.band,
      descriptor.lights.size(), up, descriptor.units == Units::absolute ? " lux" : "",
      bound_text(descriptor.bound.total).c_str(), flags_text(descriptor.flags).c_str());
}

/// A line of `lightwell replay` for a message of a captured plane.
void print_plane(double seconds, std::size_t bytes, const PlaneUpdate& update, bool json) {
  if (json)
    return print_json({{"seconds", seconds},
                       {"bytes", bytes},
                       {"plane",
                        {{"capture", update.info.capture},
                         {"revision", update.revision},
                         {"tiles", update.tiles.size()},
                         {"texture_edge", update.layout.texture_edge()}}}});
  std::printf("plane %08x  %8.3f s  %zu B  revision %llu  tiles %zu of %zu  texture %d\n", update.info.capture, seconds,
              bytes, static_cast<unsigned long long>(update.revision), update.tiles.size(), update.layout.size(),
              update.layout.texture_edge());
}

/// A line of `lightwell replay`. An error, and no line, if the record holds no valid message.
Status print_record(double seconds, const Record& record, bool json) {
  if (record.message == RecordedMessage::unknown)
    return {StatusCode::data_loss, "neither a descriptor nor a message of a plane"};
  if (record.message == RecordedMessage::plane) {
    const Result<PlaneUpdate> update = decode_plane_update(record.payload);
    if (update) print_plane(seconds, record.payload.size(), *update, json);
    return update.status();
  }
  const Result<Descriptor> descriptor = decode_descriptor(record.payload);
  if (!descriptor) return descriptor.status();
  if (!json) {
    print_descriptor(seconds, record.payload.size(), *descriptor);
    return {};
  }
  const std::string text = require(descriptor_to_json(record.payload), kFile);
  print_json(
      {{"seconds", seconds}, {"bytes", record.payload.size()}, {"descriptor", nlohmann::ordered_json::parse(text)}});
  return {};
}

}  // namespace

int run_watch(const Options& options) {
  WatchStatistics second, whole;
  Feed feed(options, [&](const Arrival& arrival) {
    second.add(arrival);
    whole.add(arrival);
  });
  HostTime second_start = feed.start();
  for (bool more = true; more;) {
    more = feed.wait(std::min(second_start + kSecond, feed.end()));
    auto lock = feed.lock();
    WatchStatistics done = std::exchange(second, {});
    const HostTime now{monotonic_now_ns()};
    // Not while printing: a blocked standard output must not delay the reception.
    lock.unlock();
    // A last interval that is too short to measure a rate counts only in the summary.
    const Duration interval = now - second_start;
    if (interval.ns > kSecond.ns / 10) done.print("second", interval.seconds(), feed.probe(), options.json);
    second_start = now;
  }
  const Status recorded = feed.close();
  whole.print("summary", (HostTime{monotonic_now_ns()} - feed.start()).seconds(), feed.probe(), options.json);
  require(recorded, kFile);
  if (whole.empty()) fail(kNothingReceived, options.uri + ": no descriptor was received");
  return kOk;
}

int run_record(const Options& options) {
  if (options.file.empty()) fail(kFile, "the name of the file is empty");
  std::uint64_t count = 0, bytes = 0;
  Feed feed(options, [&](const Arrival& arrival) {
    ++count;
    bytes += arrival.bytes.size();
  });
  static_cast<void>(feed.wait(feed.end()));
  require(feed.close(), kFile);
  if (count + feed.planes() == 0) fail(kNothingReceived, options.uri + ": nothing was received");
  std::printf("%s: %llu descriptors, %llu bytes, %llu gaps", options.file.c_str(),
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(bytes),
              static_cast<unsigned long long>(feed.probe().stats().gaps));
  if (options.plane) std::printf(", %llu messages of planes", static_cast<unsigned long long>(feed.planes()));
  std::printf("\n");
  return kOk;
}

int run_replay(const Options& options) {
  RecordReader reader = require(RecordReader::open(options.file), kFile);
  if (reader.header().kind == RecordingKind::frames)
    fail(kFile,
         options.file + " holds a camera's frames, not descriptors; lightwelld plays it as the camera replay:PATH");
  std::size_t count = 0, bad = 0;
  std::optional<std::int64_t> first_ns;
  Record record;
  while (reader.next(record)) {
    ++count;
    if (!first_ns) first_ns = record.time_ns;
    const double seconds = Duration{record.time_ns - *first_ns}.seconds();
    if (const Status s = print_record(seconds, record, options.json); !s.ok()) {
      ++bad;
      warn("record " + std::to_string(count) + ": " + s.message());
    }
  }
  if (reader.torn_bytes() > 0)
    warn(options.file + " is truncated: its last " + std::to_string(reader.torn_bytes()) +
         " bytes are not a complete record");
  if (count == 0) fail(kNothingReceived, options.file + " contains no message");
  return bad > 0 ? kFile : kOk;
}

}  // namespace lightwell::tool
