// Exposure bracketing with a camera whose controls take effect some frames after they are set (control delay).
//   ExposureSchedule: which exposure to set now, and which one a frame had
//   delay_of_step(): control delay from one measured step of exposure
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace lightwell::v4l2 {

/// Frame s should have index s % bracket of the cycle. A value that is set when s is the newest frame takes effect at
/// frame s + delay. Frames whose value was set too late, or not at all because frames were lost, have no index.
class ExposureSchedule {
 public:
  /// bracket 1 to kMaxBracket, delay 1 to kMaxDelay.
  static constexpr int kMaxDelay = 30;
  ExposureSchedule(int bracket, int delay);

  /// Discards all writes: the exposure of the next frames is unknown.
  void restart();

  struct Write {
    std::uint64_t from = 0;  ///< First frame with this exposure.
    int index = 0;           ///< Index in the cycle.
  };
  /// The write that is due after frame `newest`; empty if it was made already, or the exposure is constant.
  [[nodiscard]] std::optional<Write> due(std::uint64_t newest) const;

  enum class Outcome : std::uint8_t {
    in_time,
    uncertain,  ///< It failed, or another frame had come by then: it may take effect a frame later.
  };
  void written(const Write& write, Outcome outcome);

  /// Index in the cycle of a frame's exposure; empty if it is unknown or not the one that the frame should have.
  [[nodiscard]] std::optional<int> index_of(std::uint64_t sequence) const;

 private:
  static constexpr int kUnknown = -1;
  struct Change {
    std::uint64_t from = 0;
    int index = kUnknown;
  };

  int bracket_, delay_;
  /// Ring buffer of the newest changes; more than can be pending.
  std::array<Change, 2 * static_cast<std::size_t>(kMaxDelay) + 4> changes_{};
  std::size_t count_ = 0;
};

/// Mean level of a frame, 0 to 1 (mean_level()).
struct Level {
  std::uint64_t sequence = 0;
  double level = 0;
};

/// Control delay from one step of exposure that was set when frame `set_at` was the newest. `levels`: frames before and
/// after, in order. Empty if the step is not unambiguous: fewer than three frames before or six after, a step that is
/// small compared with the spread of the levels, gradual or transient, or whose frame was lost.
[[nodiscard]] std::optional<int> delay_of_step(std::span<const Level> levels, std::uint64_t set_at);

}  // namespace lightwell::v4l2
