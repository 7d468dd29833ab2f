// From what a device offers to what it is asked for: values in, a choice out.
//   Fraction, StepRange, Mode, Wanted, Choice
//   nearest_in(), choose_mode()
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::v4l2 {

/// Seconds from frame to frame, as V4L2 says it.
struct Fraction {
  std::uint32_t numerator = 0, denominator = 1;

  /// Frames a second; 0 where the interval is none.
  [[nodiscard]] double rate() const {
    return numerator == 0 ? 0 : static_cast<double>(denominator) / static_cast<double>(numerator);
  }
};

/// From min to max in steps.
struct StepRange {
  int min = 0, max = 0, step = 1;
};
/// The value of the range that lies nearest; of two, the larger one.
[[nodiscard]] int nearest_in(const StepRange& range, int wanted);

/// One size of one format.
struct Mode {
  std::uint32_t fourcc = 0;
  int width = 0, height = 0;
  /// What can be had; the slowest and the fastest where `any_between`. Empty: the device does not say.
  std::vector<Fraction> intervals;
  bool any_between = false;
};

struct RequestedFormat {
  int width = 640, height = 480;
  double rate = 30;
  std::string format;  ///< An Encoding's name; empty: any that can be read.
};

struct SelectedMode {
  Mode mode;
  Fraction interval;  ///< {0, 1} where the device does not say what it offers.
};

/// In this order: the size that is asked for, else the smallest that holds it, else the largest; a rate of at least
/// 95 % of the one asked for; the order of encodings(); the rate that lies nearest.
/// invalid_argument names what there is where nothing of it can be read, or not in the format asked for.
[[nodiscard]] Result<SelectedMode> choose_mode(std::span<const Mode> modes, const RequestedFormat& wanted);

}  // namespace lightwell::v4l2
