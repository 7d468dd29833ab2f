// Which place of the declared cycle of exposures a frame has, for cameras that change the exposure between frames.
//   ReportedCycle  the camera says of each frame which exposure was in force: places are told from that
//   HeldCycle      it does not, or two cameras must agree: an exposure is held until a frame is sure to have it
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "camera/frame.hpp"

namespace lightwell {

/// Exposures that differ by less are the same one: sensors round them to their lines.
inline constexpr double kExposureTolerance = 0.05;

/// invalid_argument where there is none, more than kMaxBracket, or one that is not a positive number.
[[nodiscard]] Status check_exposures(std::span<const double> exposure_s);

/// A frame's place, and its number for FrameInfo::sequence.
struct CyclePlace {
  int index = 0;
  std::uint64_t sequence = 0;
};

/// Numbers grow over restarts. Where two frames follow each other and their exposures do not, the camera has left an
/// exposure out; that counts as a lost frame, so that the numbers show a gap there, too.
class ReportedCycle {
 public:
  /// Exposures as check_exposures() wants them.
  explicit ReportedCycle(std::span<const double> exposure_s);

  /// The camera counts anew.
  void restart() { fresh_ = true; }

  /// Nothing for a frame that is none of ours: its exposure is not in the cycle (or no number), or its number does not
  /// grow.
  [[nodiscard]] std::optional<CyclePlace> place(std::uint64_t camera_sequence, double exposure_s);

 private:
  [[nodiscard]] std::optional<int> index_of(double exposure_s) const;
  [[nodiscard]] int after_last() const { return last_ ? (last_->index + 1) % static_cast<int>(size_) : 0; }

  std::array<double, kMaxBracket> cycle_{};
  std::size_t size_;
  bool fresh_ = true;
  std::uint64_t camera_last_ = 0;
  std::uint64_t shift_ = 0;  ///< From the camera's numbers to ours, modulo 2^64.
  std::optional<CyclePlace> last_;
};

/// One exposure is asked for and held. Its frame is the first one that began to be exposed `settle` after the camera
/// was told; then the next exposure's turn comes. Frames in between are nobody's: numbers count exposures, not frames.
class HeldCycle {
 public:
  HeldCycle(int size, Duration settle) : size_(size), settle_(settle) {}

  /// The exposure that the camera is to have now.
  [[nodiscard]] int index() const { return index_; }
  /// The camera was told so, at that time. The later of several counts.
  void told(ProbeTime at);
  /// Nobody knows any more what the camera has: it was started anew.
  void restart() { requested_at_.reset(); }
  /// Whether a frame whose exposure began at `began` must have it.
  [[nodiscard]] bool settled(ProbeTime began) const { return requested_at_ && began >= *requested_at_ + settle_; }

  /// The frame came and is handed on; the next exposure's turn.
  [[nodiscard]] CyclePlace take();
  /// It came and nobody had room for it: a gap, and the same exposure again.
  void skip() { ++next_sequence_; }

 private:
  int size_;
  Duration settle_;
  int index_ = 0;
  std::optional<ProbeTime> requested_at_;
  std::uint64_t next_sequence_ = 0;
};

}  // namespace lightwell
