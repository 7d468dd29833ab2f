// Chooses a device's mode (format, size, rate) for a request.
//   Fraction, StepRange, Mode, RequestedFormat, SelectedMode
//   nearest_in(), choose_mode()
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::v4l2 {

/// Frame interval in seconds, as a fraction (v4l2_fract).
struct Fraction {
  std::uint32_t numerator = 0, denominator = 1;

  /// Frames per second; 0 if the interval is 0.
  [[nodiscard]] double rate() const {
    return numerator == 0 ? 0 : static_cast<double>(denominator) / static_cast<double>(numerator);
  }
};

/// Values from min to max in steps.
struct StepRange {
  int min = 0, max = 0, step = 1;
};
/// The nearest value in the range; of two, the larger one.
[[nodiscard]] int nearest_in(const StepRange& range, int wanted);

/// One size of one format, with its frame intervals.
struct Mode {
  std::uint32_t fourcc = 0;
  int width = 0, height = 0;
  /// The available intervals; if `any_between`, the longest and the shortest. Empty: not reported.
  std::vector<Fraction> intervals;
  bool any_between = false;
};

struct RequestedFormat {
  int width = 640, height = 480;
  double rate = 30;
  std::string format;  ///< Name of an Encoding; empty: any supported one.
};

struct SelectedMode {
  Mode mode;
  Fraction interval;  ///< {0, 1} if the device does not report intervals.
};

/// Criteria, in this order: the requested size, else the smallest that contains it, else the largest; a rate of at
/// least 95 % of the requested one; the order of encodings(); the nearest rate. invalid_argument, with a list of the
/// offered formats, if none is supported or none is the requested one.
[[nodiscard]] Result<SelectedMode> choose_mode(std::span<const Mode> modes, const RequestedFormat& wanted);

}  // namespace lightwell::v4l2
