// Mean radiance along the rows of one exposure of a bracket, from a sample of its pixels, for FlickerDetector. Rows of
// merged exposures have no common time, so that each exposure is evaluated by itself.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/flicker.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

class RowProfiler {
 public:
  /// Refers to `table`.
  RowProfiler(const RigParameters& rig, const RigTable& table);

  /// A profile for each lens of the rig, valid until the next call. `frame` must have passed RowReader::bind(). Empty
  /// where a lens is missing, or for floats, which are not exposures.
  std::span<const RowProfile> profile(const Frame& frame);

 private:
  struct Lens {
    /// Linear value of green by codes of 8, 10 and 12 bits, and by luma, assumed to be grey. NaN where saturated.
    std::vector<float> code8, code10, code12, luma;
    int group_rows = 0;
    std::vector<float> radiance;
  };

  const RigTable& table_;
  std::vector<Lens> lenses_;
  std::array<RowProfile, kMaxLenses> profiles_;
};

}  // namespace lightwell::estimate
