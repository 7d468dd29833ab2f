#include <cstdio>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

int print(const RecordingStatus& recording, const Options& options) {
  if (options.json)
    print_json(recording_json(recording));
  else
    std::printf("%s\n", recording_text(recording).c_str());
  return kOk;
}

/// Why the client knows no recording of the probe.
std::string no_recording_reason(const std::string& uri) {
  if (uri.starts_with("replay:"))
    return "this is a file of descriptors, and `recording` is about the disk of a probe; give the probe's address, "
           "grpc://HOST:PORT, ws://HOST:PORT or usb:";
  if (uri.starts_with("mqtt"))
    return "a probe does not report its recording over MQTT; give its address, grpc://HOST:PORT, ws://HOST:PORT or "
           "usb:";
  return "the probe has no folder for recordings (`recordings` in its configuration), or its firmware is too old for "
         "them";
}

}  // namespace

std::string recording_text(const RecordingStatus& recording) {
  const auto wide = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::string text = "no recording since the probe's start";
  if (!recording.file.empty())
    text = (recording.running ? "recording " : "recorded ") + printable(recording.file) +
           formatted(": %llu descriptors, %llu bytes, %llu lost", wide(recording.descriptors), wide(recording.bytes),
                     wide(recording.lost));
  if (!recording.end_reason.empty()) text += "; it has ended: " + printable(recording.end_reason);
  return text;
}

nlohmann::ordered_json recording_json(const RecordingStatus& recording) {
  return {{"running", recording.running}, {"file", recording.file},
          {"bytes", recording.bytes},     {"descriptors", recording.descriptors},
          {"lost", recording.lost},       {"end_reason", recording.end_reason},
          {"faults", recording.faults}};
}

int run_recording_start(const Options& options) { return print(require(connect(options).start_recording()), options); }

int run_recording_stop(const Options& options) { return print(require(connect(options).stop_recording()), options); }

int run_recording_status(const Options& options) {
  const Probe probe = connect(options);
  const std::optional<RecordingStatus> recording = probe.info().recording;
  if (!recording) fail(kFile, options.uri + ": " + no_recording_reason(options.uri));
  return print(*recording, options);
}

}  // namespace lightwell::tool
