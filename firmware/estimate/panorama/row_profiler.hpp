// How light runs down the rows of one exposure of a bracket, from a sample of its pixels. Merged exposures have no one
// time for a row, so that flicker is looked for in each by itself.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "calibration/lens_table.hpp"
#include "camera/frame.hpp"
#include "estimate/common/flicker.hpp"

namespace lightwell::estimate {

class RowProfiler {
 public:
  /// `table` stays the caller's.
  RowProfiler(const RigParameters& rig, const RigTable& table);

  /// Of a frame that has passed RowReader::bind(): a profile for each lens of the rig, good until the next call. Empty
  /// where the frame lacks a lens or holds floats, which are no exposures.
  std::span<const RowProfile> profile(const Frame& frame);

 private:
  struct Lens {
    /// Linear value of codes of 8, 10 and 12 bits, of green, and of luma taken for grey. NaN where saturated.
    std::vector<float> code8, code10, code12, luma;
    int group_rows = 0;
    std::vector<float> radiance;
  };

  const RigTable& table_;
  std::vector<Lens> lenses_;
  std::array<RowProfile, kMaxLenses> profiles_;
};

}  // namespace lightwell::estimate
