#include <cstdio>
#include <limits>
#include <optional>

#include <lightwell/recording.hpp>

#include "commands.hpp"
#include "exit_code.hpp"
#include "feed.hpp"
#include "watch_statistics.hpp"

namespace lightwell::tool {
namespace {

constexpr Duration kSecond{1'000'000'000};

void print(WatchStatistics& statistics, std::string_view kind, double seconds, const Probe& probe, Output output) {
  const LinkStats stats = probe.stats();
  const ProbeInfo info = probe.info();
  const std::string line =
      output == Output::json ? statistics.json(kind, seconds, stats, info) : statistics.text(seconds, stats, info);
  std::printf("%s%s\n", output == Output::text && kind == "summary" ? "all: " : "", line.c_str());
  std::fflush(stdout);
}

}  // namespace

int run_watch(const WatchOptions& options) {
  stop_on_signals();
  Result<std::unique_ptr<Feed>> opened = Feed::open(options.uri, options.credentials);
  if (!opened.ok()) return fail(opened.status());
  Feed& feed = **opened;

  std::optional<RecordWriter> writer;
  if (!options.record.empty()) {
    Result<RecordWriter> file = RecordWriter::open(
        options.record, {RecordingKind::descriptors, feed.probe().info().name, std::string(version()), {}});
    if (!file.ok()) return fail(kFile, file.status().message());
    writer.emplace(std::move(*file));
  }

  const HostTime start{monotonic_now_ns()};
  const HostTime end = options.seconds > 0 ? start + Duration::from_seconds(options.seconds)
                                           : HostTime{std::numeric_limits<std::int64_t>::max()};
  HostTime second_start = start;
  WatchStatistics second, whole;
  for (;;) {
    const HostTime second_end = std::min(second_start + kSecond, end);
    if (const std::optional<ReceivedDescriptor> item = feed.next(second_end)) {
      second.add(*item);
      whole.add(*item);
      if (writer)
        if (const Status status = writer->append(item->received.ns, item->bytes); !status.ok())
          return fail(kFile, options.record + ": " + status.message());
    }
    const HostTime now{monotonic_now_ns()};
    const bool done = now >= end || feed.over() || stop_requested();
    if (now >= second_end || done) {
      // A last interval that is too short to measure a rate counts only in the summary.
      const Duration stretch = now - second_start;
      if (stretch.ns > kSecond.ns / 10) print(second, "second", stretch.seconds(), feed.probe(), options.output);
      second = {};
      second_start = now;
    }
    if (done) break;
  }
  const Duration ran = HostTime{monotonic_now_ns()} - start;
  print(whole, "summary", ran.seconds(), feed.probe(), options.output);
  if (writer)
    if (const Status status = writer->flush(); !status.ok())
      return fail(kFile, options.record + ": " + status.message());
  if (whole.empty()) return fail(kNothingReceived, options.uri + ": no descriptor was received");
  return kOk;
}

}  // namespace lightwell::tool
