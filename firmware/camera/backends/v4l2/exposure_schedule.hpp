// Which frame was exposed how, when a camera takes a control's new value some frames after it was set.
//   ExposureSchedule: what to set now, and what a frame had
//   delay_of_step(): how many frames it takes, from a step that was measured
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace lightwell::v4l2 {

/// Frame number s shall have place s % bracket of the cycle, and what is set when s is the newest frame acts from frame
/// s + delay on. What was set too late, or not at all since frames were lost, is known by its consequences: those
/// frames have no place.
class ExposureSchedule {
 public:
  /// bracket 1 to kMaxBracket, delay 1 to kMaxDelay.
  static constexpr int kMaxDelay = 30;
  ExposureSchedule(int bracket, int delay);

  /// Nothing is known of the frames to come.
  void restart();

  struct Write {
    std::uint64_t from = 0;  ///< The first frame that will have it.
    int index = 0;           ///< Place in the cycle.
  };
  /// What to set now that `newest` has come; nothing where it has been set already, or exposure does not change.
  [[nodiscard]] std::optional<Write> due(std::uint64_t newest) const;

  enum class Outcome : std::uint8_t {
    in_time,
    uncertain,  ///< It failed, or another frame had come by then: it may act a frame later.
  };
  void written(const Write& write, Outcome outcome);

  /// The place in the cycle that a frame was exposed with; nothing where that is not known or not the frame's own.
  [[nodiscard]] std::optional<int> index_of(std::uint64_t sequence) const;

 private:
  static constexpr int kUnknown = -1;
  struct Change {
    std::uint64_t from = 0;
    int index = kUnknown;
  };

  int bracket_, delay_;
  /// The newest changes, in a ring; more than can be under way.
  std::array<Change, 2 * static_cast<std::size_t>(kMaxDelay) + 4> changes_{};
  std::size_t count_ = 0;
};

/// How bright a frame is, 0 to 1.
struct Level {
  std::uint64_t sequence = 0;
  double level = 0;
};

/// A step of exposure was set when frame `set_at` was the newest; `levels` are in order and reach from some frames
/// before to some after. Nothing where that does not show it beyond doubt: less than three frames before or six after,
/// a step that is small beside the frames' own spread, not steep, or not for good, or whose frame was lost.
[[nodiscard]] std::optional<int> delay_of_step(std::span<const Level> levels, std::uint64_t set_at);

}  // namespace lightwell::v4l2
