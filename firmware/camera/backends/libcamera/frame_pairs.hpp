// Two free-running cameras: pairs their frames by time, and aligns their cycles of exposures.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <lightwell/time.hpp>

namespace lightwell::libcam {

/// A frame that may be waiting for its counterpart.
struct PendingFrame {
  ProbeTime at;
  int token = 0;  ///< The caller's identifier of the frame.
};

/// Two frames are a pair if their times differ by at most half the frame interval: then each is the nearest to the
/// other. Frames without a counterpart are dropped and counted. The phase between the cameras drifts; after half an
/// interval one frame is dropped, and pairing continues with the next.
class FramePairer {
 public:
  /// Largest number of frames of one camera that wait while the other delivers none.
  static constexpr std::size_t kMaxWaiting = 2;

  /// `interval`: frame interval, positive.
  explicit FramePairer(Duration interval) : half_(Duration{interval.ns / 2}) {}

  /// Adds a frame of lens 0 or 1. Afterwards call next() until it returns Kind::nothing.
  void offer(int lens, const PendingFrame& frame);

  enum class Kind : std::uint8_t {
    nothing,  ///< No decision: the remaining frames wait.
    pair,     ///< tokens[0] of lens 0 and tokens[1] of lens 1.
    dropped,  ///< tokens[lens] of `lens`.
  };
  struct PairResult {
    Kind kind = Kind::nothing;
    int lens = 0;
    std::array<int, 2> tokens{};
  };
  [[nodiscard]] PairResult next();

  /// Discards the waiting frames, which the caller has taken back, and the previous times. Counts are kept.
  void restart();

  struct Counts {
    std::uint64_t pairs = 0;
    std::array<std::uint64_t, 2> unpaired{};
    /// Not later than the previous frame of the same lens.
    std::array<std::uint64_t, 2> disordered{};
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  /// The frames of one lens in order of time; capacity one above kMaxWaiting.
  struct FrameQueue {
    std::array<PendingFrame, kMaxWaiting + 1> frames{};
    std::size_t size = 0;
    bool seen = false;
    ProbeTime last;

    [[nodiscard]] PendingFrame take_front();
  };
  [[nodiscard]] PairResult drop_front(int lens);

  Duration half_;
  std::array<FrameQueue, 2> queues_{};
  PairResult refused_;  ///< The frame that offer() refused, for next().
  Counts counts_;
};

/// Index of the exposure in the cycle. Empty if none matches, or more than one (within kExposureTolerance).
[[nodiscard]] std::optional<int> index_in_cycle(std::span<const double> exposure_s, double in_force_s);

/// Whether all exposures of the cycle differ by more than the tolerance, so that an exposure determines its index.
[[nodiscard]] bool distinct(std::span<const double> exposure_s);

/// Aligns two cameras that run through the same cycle of exposures, so that simultaneous frames have the same exposure.
/// A correction takes effect some frames after it was made; until then disagreeing pairs do not cause another one.
class CycleAlignment {
 public:
  /// `patience`: number of pairs until a correction has taken effect.
  CycleAlignment(int size, int patience) : size_(size), patience_(patience) {}

  /// Takes the cycle indices of a pair. Returns by how many exposures the second camera's next request must advance.
  [[nodiscard]] int observe(int first, int second);
  void restart() { waited_ = patience_; }

 private:
  int size_, patience_;
  int waited_ = patience_;
};

}  // namespace lightwell::libcam
