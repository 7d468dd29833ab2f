// Assigns each frame its index in the declared cycle of exposures, for cameras that change the exposure between frames.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <lightwell/time.hpp>

#include "imaging/frame.hpp"

namespace lightwell {

/// Relative difference below which two exposures count as equal: sensors round exposures to whole rows.
inline constexpr double kExposureTolerance = 0.05;

/// Index of a frame in the cycle, and its FrameInfo::sequence.
struct CyclePlace {
  int index = 0;
  std::uint64_t sequence = 0;
};

/// For cameras that report the exposure of each frame: the index follows from the report. Sequence numbers increase
/// across restarts. If two consecutive frames do not have consecutive exposures, the camera has skipped an exposure;
/// that counts as a lost frame and leaves a gap in the sequence.
class ReportedCycle {
 public:
  /// `exposure_s`: 1 to kMaxBracket exposure times above zero.
  explicit ReportedCycle(std::span<const double> exposure_s);

  /// The camera's frame counter starts again.
  void restart() { fresh_ = true; }

  /// Empty for a frame to discard: its exposure is not in the cycle, or its sequence number does not increase.
  [[nodiscard]] std::optional<CyclePlace> place(std::uint64_t camera_sequence, double exposure_s);

 private:
  [[nodiscard]] std::optional<int> index_of(double exposure_s) const;
  [[nodiscard]] int after_last() const { return last_ ? (last_->index + 1) % static_cast<int>(size_) : 0; }

  std::array<double, kMaxBracket> cycle_{};
  std::size_t size_;
  bool fresh_ = true;
  std::uint64_t camera_last_ = 0;
  std::uint64_t shift_ = 0;  ///< Added to the camera's sequence number, modulo 2^64.
  std::optional<CyclePlace> last_;
};

/// For cameras that do not report exposures, or two cameras in step: requests one exposure and holds it. The first
/// frame whose exposure begins at least `settle` after the request has it; then the next exposure is requested. Frames
/// in between are discarded: sequence numbers count exposures.
class HeldCycle {
 public:
  HeldCycle(int size, Duration settle) : size_(size), settle_(settle) {}

  /// Index of the exposure to request now.
  [[nodiscard]] int index() const { return index_; }
  /// The exposure index() was requested from the camera at `at`. Of several requests the latest counts.
  void exposure_requested(ProbeTime at) { requested_at_ = requested_at_ ? std::max(*requested_at_, at) : at; }
  /// The camera was restarted, so its exposure is unknown until the next request.
  void restart() { requested_at_.reset(); }
  /// Whether a frame whose exposure began at `began` certainly has exposure index().
  [[nodiscard]] bool settled(ProbeTime began) const { return requested_at_ && began >= *requested_at_ + settle_; }

  /// Accepts the frame with exposure index() and goes on to the next exposure.
  [[nodiscard]] CyclePlace take();
  /// Drops the frame with exposure index() (no free buffer): leaves a gap and repeats the exposure.
  void skip() { ++next_sequence_; }

 private:
  int size_;
  Duration settle_;
  int index_ = 0;
  std::optional<ProbeTime> requested_at_;
  std::uint64_t next_sequence_ = 0;
};

}  // namespace lightwell
