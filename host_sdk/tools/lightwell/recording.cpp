#include <cstdio>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

int print(const RecordingStatus& recording, const Options& options) {
  if (options.json) {
    print_json({{"running", recording.running},
                {"file", recording.file},
                {"bytes", recording.bytes},
                {"descriptors", recording.descriptors},
                {"lost", recording.lost},
                {"end_reason", recording.end_reason},
                {"faults", recording.faults}});
    return kOk;
  }
  const auto wide = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  if (recording.file.empty())
    std::printf("no recording since the probe's start\n");
  else
    std::printf("%s %s: %llu descriptors, %llu bytes, %llu lost\n", recording.running ? "recording" : "recorded",
                printable(recording.file).c_str(), wide(recording.descriptors), wide(recording.bytes),
                wide(recording.lost));
  if (!recording.end_reason.empty()) std::printf("it has ended: %s\n", printable(recording.end_reason).c_str());
  return kOk;
}

}  // namespace

int run_recording_start(const Options& options) { return print(require(connect(options).start_recording()), options); }

int run_recording_stop(const Options& options) { return print(require(connect(options).stop_recording()), options); }

int run_recording_status(const Options& options) {
  const Probe probe = connect(options);
  const std::optional<RecordingStatus> recording = probe.info().recording;
  if (!recording)
    fail(kFile, options.uri +
                    ": the probe has no folder for recordings (`recordings` in its configuration), or its firmware is "
                    "too old for them");
  return print(*recording, options);
}

}  // namespace lightwell::tool
