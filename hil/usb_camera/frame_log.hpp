// Log of the outcome of every frame, with which a test compares the frames that arrived.
//   Outcome, FrameRecord, FrameLog
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include <lightwell/files.hpp>
#include <lightwell/result.hpp>

#include "usb_camera/controls.hpp"
#include "usb_camera/payload.hpp"

namespace lightwell::usb_camera {

enum class Outcome : std::uint8_t {
  sent,        ///< Sent completely.
  torn,        ///< Sent without its middle third (injected fault).
  shortened,   ///< Sent without its last third (injected fault).
  marked,      ///< Sent completely with the error bit (injected fault).
  skipped,     ///< Not sent (injected fault).
  silent,      ///< Not sent, because an injected fault keeps the camera silent.
  busy,        ///< Not sent: the previous frame was still being sent when it was due.
  replaced,    ///< Not sent: the host fetched nothing until the next frame was due.
  unrendered,  ///< Not sent: its image was not rendered in time.
  aborted,     ///< Sent in part: the host, a stall or unplugging ended the stream.
};
inline constexpr std::array<std::string_view, 10> kOutcomes = {"sent",   "torn", "shortened", "marked",     "skipped",
                                                               "silent", "busy", "replaced",  "unrendered", "aborted"};

[[nodiscard]] constexpr std::string_view to_string(Outcome outcome) {
  return kOutcomes[static_cast<std::size_t>(outcome)];
}

struct FrameRecord {
  std::uint64_t stream = 0;  ///< Number of the stream since the program began, from 1.
  std::uint64_t number = 0;  ///< Number of the frame in its stream, from 0, whether it was sent or not.
  CameraTime began;          ///< Start of exposure. clock_ticks() of it is the presentation time in payload headers.
  SensorSettings settings;   ///< Settings of the exposure.
  std::uint64_t bytes = 0;   ///< Size of the image.
  std::uint64_t sent = 0;    ///< Bytes of the image that were sent.
  Outcome outcome = Outcome::sent;
};

/// {"stream":1,"number":0,"began_ns":...,"pts":...,"exposure_s":0.001,"gain":1.0,"kelvin":6500,"bytes":614400,
///  "sent":614400,"outcome":"sent"}
[[nodiscard]] nlohmann::ordered_json json_of(const FrameRecord& record);

class FrameLog {
 public:
  /// `keep`: number of latest frames that are kept.
  explicit FrameLog(std::size_t keep = 4096) : keep_(keep) {}

  /// Writes a line of JSON for each frame from now on; overwrites an old file. unavailable: the file cannot be written.
  [[nodiscard]] Status write_to(const std::string& path);

  void add(const FrameRecord& record);
  /// Sets all counts to zero; frame numbers continue.
  void reset_counts() { counts_ = {}; }

  [[nodiscard]] std::uint64_t count(Outcome outcome) const { return counts_[static_cast<std::size_t>(outcome)]; }
  [[nodiscard]] const std::deque<FrameRecord>& records() const { return records_; }

 private:
  std::size_t keep_;
  std::deque<FrameRecord> records_;
  std::array<std::uint64_t, kOutcomes.size()> counts_{};
  FilePointer file_;
};

}  // namespace lightwell::usb_camera
