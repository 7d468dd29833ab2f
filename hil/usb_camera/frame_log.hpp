// What became of every frame: the camera's own account, against which a test holds what arrived.
//   Outcome, FrameRecord, FrameLog
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <memory>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

#include "usb_camera/controls.hpp"
#include "usb_camera/payload.hpp"

namespace lightwell::usb_camera {

enum class Outcome : std::uint8_t {
  sent,        ///< Whole.
  torn,        ///< Sent without its middle, as a fault asked.
  shortened,   ///< Sent without its end, likewise.
  marked,      ///< Sent whole with the error bit, likewise.
  skipped,     ///< Not sent, likewise.
  silent,      ///< Not sent while a fault kept the camera silent.
  busy,        ///< Not sent: the one before was still on its way when it was due.
  replaced,    ///< Not sent: the host took nothing until the next one was due.
  unrendered,  ///< Not sent: its picture was not ready.
  aborted,     ///< Sent in part: the host, a stall or an unplugging ended the stream.
};
inline constexpr std::array<std::string_view, 10> kOutcomes = {"sent",   "torn", "shortened", "marked",     "skipped",
                                                               "silent", "busy", "replaced",  "unrendered", "aborted"};

[[nodiscard]] constexpr std::string_view to_string(Outcome outcome) {
  return kOutcomes[static_cast<std::size_t>(outcome)];
}

struct FrameRecord {
  std::uint64_t stream = 0;  ///< Number of the stream since the program began, from 1.
  std::uint64_t number = 0;  ///< Of the frame in its stream, from 0. Every frame has one, sent or not.
  CameraTime began;          ///< Its exposure. clock_ticks() of it is the presentation time in payload headers.
  SensorSettings settings;   ///< What it was exposed with.
  std::uint64_t bytes = 0;   ///< Of the picture.
  std::uint64_t sent = 0;    ///< Of these, how many went out.
  Outcome outcome = Outcome::sent;
};

/// {"stream": 1, "number": 0, "began_ns": ..., "pts": ..., "exposure_s": 0.001, "gain": 1, "kelvin": 6500,
///  "bytes": 614400, "sent": 614400, "outcome": "sent"}
[[nodiscard]] std::string to_json(const FrameRecord& record);

class FrameLog {
 public:
  /// The latest frames that are kept.
  explicit FrameLog(std::size_t keep = 4096) : keep_(keep) {}

  /// A line of JSON a frame from now on; an old file is overwritten. unavailable where it cannot be written.
  [[nodiscard]] Status write_to(const std::string& path);

  void add(const FrameRecord& record);
  /// Counts start at zero again; numbers of frames do not.
  void reset_counts() { counts_ = {}; }

  [[nodiscard]] std::uint64_t count(Outcome outcome) const { return counts_[static_cast<std::size_t>(outcome)]; }
  [[nodiscard]] const std::deque<FrameRecord>& records() const { return records_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::size_t keep_;
  std::deque<FrameRecord> records_;
  std::array<std::uint64_t, kOutcomes.size()> counts_{};
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace lightwell::usb_camera
