#include <cstdio>
#include <limits>
#include <optional>

#include <lightwell/recording.hpp>

#include "commands.hpp"
#include "exit_code.hpp"
#include "feed.hpp"

namespace lightwell::tool {

int run_record(const RecordOptions& options) {
  stop_on_signals();
  Result<std::unique_ptr<Feed>> opened = Feed::open(options.uri, options.credentials);
  if (!opened.ok()) return fail(opened.status());
  Feed& feed = **opened;
  Result<RecordWriter> writer = RecordWriter::open(
      options.file, {RecordingKind::descriptors, feed.probe().info().name, std::string(version()), {}});
  if (!writer.ok()) return fail(kFile, writer.status().message());

  const HostTime start{monotonic_now_ns()};
  const HostTime end = options.seconds > 0 ? start + Duration::from_seconds(options.seconds)
                                           : HostTime{std::numeric_limits<std::int64_t>::max()};
  std::uint64_t count = 0, bytes = 0;
  while (const std::optional<ReceivedDescriptor> item = feed.next(end)) {
    Status status = writer->append(item->received.ns, item->bytes);
    // Each record goes to the file at once: a killed process loses none that it received.
    if (status.ok()) status = writer->flush();
    if (!status.ok()) return fail(kFile, options.file + ": " + status.message());
    ++count;
    bytes += item->bytes.size();
  }
  if (count == 0) return fail(kNothingReceived, options.uri + ": no descriptor was received");
  std::printf("%s: %llu descriptors, %llu bytes, %llu gaps\n", options.file.c_str(),
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(bytes),
              static_cast<unsigned long long>(feed.probe().stats().gaps));
  return kOk;
}

}  // namespace lightwell::tool
