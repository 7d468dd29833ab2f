#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/quantile.hpp>
#include <lightwell/recording.hpp>
#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

constexpr Duration kSecond{1'000'000'000};

volatile std::sig_atomic_t signal_seen = 0;

void on_signal(int) { signal_seen = 1; }

/// A copy of an Arrival.
struct ReceivedDescriptor {
  std::vector<std::byte> bytes;
  Descriptor descriptor;
  HostTime mid_exposure, received, stored;
};

/// All descriptors of a probe, from the SDK's reader thread to the main thread. SIGINT and SIGTERM end it instead of
/// the process, so that a summary is printed. No descriptor is dropped here: a slow tool blocks the reader thread. A
/// recording then waits; a probe drops descriptors, which is visible as gaps in the sequence.
class Feed {
 public:
  Feed() = default;
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  ~Feed() {
    {
      // Release the reader thread, which may wait in put(), because the probe's destructor joins it.
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    changed_.notify_all();
    probe_.reset();
  }

  [[nodiscard]] Status open(const Options& options) {
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    Result<Probe> probe = connect(options, [this](const Arrival& arrival) { put(arrival); });
    if (!probe.ok()) return probe.status();
    probe_.emplace(std::move(*probe));
    start_ = HostTime{monotonic_now_ns()};
    if (options.seconds > 0) end_ = start_ + Duration::from_seconds(options.seconds);
    return {};
  }

  /// Opens the file of the options for the descriptors.
  [[nodiscard]] Result<RecordWriter> recording(const std::string& file) const {
    return RecordWriter::open(file, {RecordingKind::descriptors, probe_->info().name, std::string(version()), {}});
  }

  [[nodiscard]] const Probe& probe() const { return *probe_; }
  /// When the probe was connected.
  [[nodiscard]] HostTime start() const { return start_; }
  /// When --seconds are over.
  [[nodiscard]] HostTime end() const { return end_; }

  /// The next descriptor; no value at `deadline`, at the end of a recording, or after a signal.
  [[nodiscard]] std::optional<ReceivedDescriptor> next(HostTime deadline) {
    // Wait in short periods, because neither a signal nor the end of a recording notifies the condition variable.
    constexpr std::int64_t kPollPeriod = 20'000'000;
    for (;;) {
      const bool last_poll = over() || monotonic_now_ns() >= deadline.ns;
      std::unique_lock lock(mutex_);
      const auto wait = last_poll ? 0 : std::min(kPollPeriod, deadline.ns - monotonic_now_ns());
      if (changed_.wait_for(lock, std::chrono::nanoseconds(wait), [this] { return !waiting_.empty(); })) {
        std::optional<ReceivedDescriptor> item;
        item.emplace(std::move(waiting_.front()));
        waiting_.pop_front();
        changed_.notify_all();
        return item;
      }
      if (last_poll) return std::nullopt;
    }
  }

  /// A signal was received, or the end of a recording is reached and next() has returned all descriptors.
  [[nodiscard]] bool over() const {
    if (signal_seen != 0) return true;
    if (probe_->stats().state != LinkState::ended) return false;
    const std::lock_guard lock(mutex_);
    return waiting_.empty();
  }

 private:
  void put(const Arrival& arrival) {
    ReceivedDescriptor item{{arrival.bytes.begin(), arrival.bytes.end()},
                            arrival.descriptor,
                            arrival.mid_exposure,
                            arrival.received,
                            arrival.stored};
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return closed_ || waiting_.size() < kMaxWaiting; });
    if (closed_) return;
    waiting_.push_back(std::move(item));
    changed_.notify_all();
  }

  static constexpr std::size_t kMaxWaiting = 256;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<ReceivedDescriptor> waiting_;
  bool closed_ = false;
  std::optional<Probe> probe_;
  HostTime start_, end_{std::numeric_limits<std::int64_t>::max()};
};

/// Statistics of the descriptors of a time interval. Percentiles are nearest-rank (lower_quantile()).
class WatchStatistics {
 public:
  void add(const ReceivedDescriptor& item) {
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

}  // namespace

int run_watch(const Options& options) {
  Feed feed;
  if (const Status s = feed.open(options); !s.ok()) return fail(s);
  std::optional<RecordWriter> writer;
  if (!options.file.empty()) {
    Result<RecordWriter> file = feed.recording(options.file);
    if (!file.ok()) return fail(kFile, file.status().message());
    writer.emplace(std::move(*file));
  }

  HostTime second_start = feed.start();
  WatchStatistics second, whole;
  for (;;) {
    const HostTime second_end = std::min(second_start + kSecond, feed.end());
    if (const std::optional<ReceivedDescriptor> item = feed.next(second_end)) {
      second.add(*item);
      whole.add(*item);
      if (writer)
        if (const Status status = writer->append(item->received.ns, item->bytes); !status.ok())
          return fail(kFile, options.file + ": " + status.message());
    }
    const HostTime now{monotonic_now_ns()};
    const bool done = now >= feed.end() || feed.over();
    if (now >= second_end || done) {
      // A last interval that is too short to measure a rate counts only in the summary.
      const Duration stretch = now - second_start;
      if (stretch.ns > kSecond.ns / 10) second.print("second", stretch.seconds(), feed.probe(), options.json);
      second = {};
      second_start = now;
    }
    if (done) break;
  }
  const Duration ran = HostTime{monotonic_now_ns()} - feed.start();
  whole.print("summary", ran.seconds(), feed.probe(), options.json);
  if (writer)
    if (const Status status = writer->flush(); !status.ok()) return fail(kFile, options.file + ": " + status.message());
  if (whole.empty()) return fail(kNothingReceived, options.uri + ": no descriptor was received");
  return kOk;
}

int run_record(const Options& options) {
  Feed feed;
  if (const Status s = feed.open(options); !s.ok()) return fail(s);
  Result<RecordWriter> writer = feed.recording(options.file);
  if (!writer.ok()) return fail(kFile, writer.status().message());
  std::uint64_t count = 0, bytes = 0;
  while (const std::optional<ReceivedDescriptor> item = feed.next(feed.end())) {
    if (const Status status = writer->append(item->received.ns, item->bytes); !status.ok())
      return fail(kFile, options.file + ": " + status.message());
    ++count;
    bytes += item->bytes.size();
  }
  if (const Status status = writer->flush(); !status.ok()) return fail(kFile, options.file + ": " + status.message());
  if (count == 0) return fail(kNothingReceived, options.uri + ": no descriptor was received");
  std::printf("%s: %llu descriptors, %llu bytes, %llu gaps\n", options.file.c_str(),
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(bytes),
              static_cast<unsigned long long>(feed.probe().stats().gaps));
  return kOk;
}

}  // namespace lightwell::tool
