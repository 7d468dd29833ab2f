// Measures the control delay of a camera: the number of frames until a new exposure takes effect.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <lightwell/result.hpp>

#include "camera/backends/v4l2/connection.hpp"

namespace lightwell::v4l2 {

/// Mean pixel value on a grid of at most 64 x 64 pixels, as a fraction of full scale: luma, green, or all colours of a
/// mosaic alike. For comparisons between frames of one camera, not for photometry.
[[nodiscard]] double mean_level(const View& view);

/// Mean level of a frame, 0 to 1 (mean_level()).
struct Level {
  std::uint64_t sequence = 0;
  double level = 0;
};

/// Control delay from one step of exposure that was set when frame `set_at` was the newest. `levels`: frames before and
/// after, in order. Empty if the step is not unambiguous: fewer than three frames before or six after, a step that is
/// small compared with the spread of the levels, gradual or transient, or whose frame was lost.
[[nodiscard]] std::optional<int> delay_of_step(std::span<const Level> levels, std::uint64_t set_at);

/// Streams for about a hundred frames: switches between two exposures until four steps are visible in the mean levels,
/// and counts the frames from each request to its effect. `rate`: frame rate, 1/s. No buffer may be queued before, and
/// none is afterwards; exposure.codes.front() is set at the end.
/// unavailable if no step is visible (darkness, flicker) or the steps disagree.
[[nodiscard]] Result<int> measure_control_delay(Connection& connection, Converter& converter, double rate);

}  // namespace lightwell::v4l2
