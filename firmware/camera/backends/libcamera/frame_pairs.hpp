// Frames of two cameras that run freely, made into pairs by their times: which frame of the one belongs to which of the
// other, on values alone.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell::libcam {

/// A frame that waits for its counterpart.
struct PendingFrame {
  ProbeTime at;
  int token = 0;  ///< The caller's.
};

/// Two frames are a pair where their times differ by no more than half the interval between frames: each is then the
/// nearest to the other. What finds no counterpart is dropped and counted. The phase between cameras drifts; when it
/// has drifted by half an interval, one frame is dropped and the pairs go on with the next.
class FramePairer {
 public:
  /// A camera that is silent does not hold up more frames of the other than this.
  static constexpr std::size_t kMaxWaiting = 2;

  /// Interval above zero.
  explicit FramePairer(Duration interval) : half_(Duration{interval.ns / 2}) {}

  /// A frame of lens 0 or 1. Afterwards next() says what became of frames, until it has nothing more to say.
  void offer(int lens, const PendingFrame& frame);

  enum class Kind : std::uint8_t {
    nothing,  ///< All others wait.
    pair,     ///< tokens[0] of lens 0 and tokens[1] of lens 1.
    dropped,  ///< tokens[lens] of `lens`.
  };
  struct PairResult {
    Kind kind = Kind::nothing;
    int lens = 0;
    std::array<int, 2> tokens{};
  };
  [[nodiscard]] PairResult next();

  /// Forgets what waits and the times seen: the caller has those frames back. Counts stay.
  void restart();

  struct Counts {
    std::uint64_t pairs = 0;
    std::array<std::uint64_t, 2> unpaired{};
    /// Not later than the frame before of the same lens.
    std::array<std::uint64_t, 2> disordered{};
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  /// The frames of a lens in order of time, one more than may wait.
  struct FrameQueue {
    std::array<PendingFrame, kMaxWaiting + 1> frames{};
    std::size_t size = 0;
    bool seen = false;
    ProbeTime last;

    [[nodiscard]] PendingFrame take_front();
  };
  [[nodiscard]] PairResult drop_front(int lens);

  Duration half_;
  std::array<FrameQueue, 2> lines_{};
  PairResult refused_;  ///< What offer() could not take.
  Counts counts_;
};

}  // namespace lightwell::libcam
