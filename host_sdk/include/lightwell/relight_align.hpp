// Alignment of time-multiplexed photographs of a subject that moves (optional library lightwell_relight).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A photograph and its time of mid-exposure, s, on any clock.
struct TimedPhotograph {
  double time_s = 0;
  std::span<const Radiance> picture;
};

/// How far pictures were moved, and where that is not known.
struct AlignmentSummary {
  double median_px = 0, largest_px = 0;  ///< Displacement from the first tracking frame to the second.
  /// Pixels whose displacement back from the second frame does not return to them within a pixel: hidden in one of the
  /// frames, or not found. They are moved all the same.
  std::size_t uncertain = 0;
};

/// Moves photographs to the time of the first of two tracking frames between which they were taken: frames under the
/// same light from all around, one in each cycle (Wenger et al. 2005, "Performance Relighting and Reflectance
/// Transformation with Time-Multiplexed Illumination"). Optical flow between the tracking frames (DIS, Kroeger et al.
/// 2016, by OpenCV); a photograph between them has the share of it that its time says: motion is linear within a cycle.
/// out[i] is that of photographs[i]; pixels that come from outside of the picture are those at its edge.
/// invalid_argument for pictures of other size, below 16 pixels a side, for times that are not finite, not in order, or
/// outside of the tracking frames; failed_precondition in a build without OpenCV.
[[nodiscard]] Result<AlignmentSummary> align_photographs(int columns, int rows, const TimedPhotograph& first_tracking,
                                                         const TimedPhotograph& second_tracking,
                                                         std::span<const TimedPhotograph> photographs,
                                                         std::vector<std::vector<Radiance>>& out);

}  // namespace lightwell
