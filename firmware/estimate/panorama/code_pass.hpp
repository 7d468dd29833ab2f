// The pass for a single exposure of integer codes: sums the rows of a block for all lanes at once in integers, and
// applies the weights of pixels (solid angle, vignetting) to the sums.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/code_weights.hpp"
#include "estimate/panorama/kernels/block_scan.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

/// Fills the same BlockSums as BlockPass, many times faster (see CodeWeights for the weights of pixels).
class CodePass {
 public:
  CodePass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout);
  CodePass(CodePass&&) = default;  ///< Not copyable: BlockRun::step points into a LensPlan.

  /// Whether the bracket is a single exposure of integer codes that the kernels can sum: rows of at least kMinLanes
  /// pixels, blocks of 2 to kMaxRows rows, and a linear response if codes have 10 or 12 bits.
  [[nodiscard]] bool supports(std::span<const Frame> bracket) const;
  [[nodiscard]] const CodeWeights& weights() const { return weights_; }
  /// `frame` must have passed RowReader::bind(). `read`: by block, whether it is read; empty: all are. The others keep
  /// what they hold; totals are of the blocks that were read. `rows`: those that are summed, as if the others were
  /// dark; a part only of blocks whose weights are a plane.
  void run(const Frame& frame, std::span<const std::uint8_t> read, const SampledRows& rows, BlockSums& out);

 private:
  /// Sums of a run by colour, one element per block (see BlockCodes).
  struct Codes {
    std::array<std::vector<float>, 3> sum, across, down, top;
    std::vector<float> clipped;
    void resize(std::size_t blocks);
    [[nodiscard]] BlockCodes at_first();
  };
  struct LensPlan {
    CodeTable linear16;
    std::vector<float> step8;  ///< Quantization step by linear value in 1/4095.
    float linear_unit = 0;     ///< Linear value = run.linear_from + linear_unit * linear16 / 65535.
    bool linear = false;       ///< Codes are linear; linear16 is not used.
    std::array<unsigned, kCodeBits.size()> clipped_from{};  ///< saturated_from() by index in kCodeBits.
    BlockRun run;                                           ///< The constants of the lens.
  };
  struct Scratch {
    std::vector<std::uint32_t> sum, early, across;
    std::vector<std::uint16_t> peak, clipped;
    explicit Scratch(std::size_t lanes) : sum(lanes), early(lanes), across(lanes), peak(lanes), clipped(lanes) {}
    [[nodiscard]] LaneSums at(std::size_t lane) {
      return {sum.data() + lane, early.data() + lane, peak.data() + lane, clipped.data() + lane};
    }
  };

  void plan_lens(const PhotometricCalibration& photometry);
  /// Blocks of a row of blocks that are read at once.
  struct Strip {
    const View& view;
    const LensPlan& plan;
    int top, rows;  ///< Of pixels; `rows` that are read.
    const SampledRows& sampled;
    const WeightRun& run;
    BlockRange blocks;  ///< Of the run.
  };
  void sum_strip(const Strip& strip);
  void finish_strip(const Strip& strip, float radiance_per_linear, BlockSums& out);
  /// Fills codes_ with the sums of `blocks` blocks from lane `begin`. `columns`: samples of a channel per block row.
  template <Lanes lanes>
  void gather_codes(const LensPlan& plan, int rows, std::size_t begin, std::size_t columns, std::size_t blocks,
                    unsigned clipped_from);

  const BlockLayout& layout_;
  CodeWeights weights_;
  std::vector<LensPlan> lenses_;
  Codes codes_;
  /// Sums of up to three groups of lanes: the planes converted from YCbCr, or the even and the odd rows of a mosaic.
  std::vector<Scratch> groups_;
  std::vector<std::uint8_t> planes_;
};

}  // namespace lightwell::estimate
