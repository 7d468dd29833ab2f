// The pass for a single exposure of integer codes: sums the rows of a block for all lanes at once in integers, and
// applies the weights of pixels (solid angle, vignetting) to the sums.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/pixel.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/kernels/block_scan.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

/// Layout of samples in a row.
enum class Lanes : std::uint8_t { interleaved, planar, mosaic };
inline constexpr std::size_t kLaneKinds = 3;
[[nodiscard]] Lanes lanes_of(PixelFormat format);

/// Neighbouring blocks of a row of blocks: columns of blocks from `first` to before `end`.
struct BlockRange {
  int first, end;
};

/// Neighbouring blocks of one kind within a row of blocks.
struct WeightRun {
  BlockRange blocks;
  bool weighted;  ///< Pixels have 8-bit weights; false: the fitted plane is applied to sums and moments.
  std::array<std::size_t, kLaneKinds> weights;  ///< Offset of its rows of weights.
};

/// Range of lanes that a kernel processes: at least kMinLanes.
struct LaneRange {
  std::size_t begin, count;
};

/// Weights of code sums, precomputed for a rig. Within a block, the weight of a pixel (solid angle divided by relative
/// illumination) is a plane over x and y, so that sums and first moments of the codes give the weighted sum. Where a
/// plane does not fit (edge of a lens, overlap of two), each pixel has its own 8-bit weight. Empty for blocks of one
/// pixel, and of more than kMaxRows rows.
class CodeWeights {
 public:
  CodeWeights(const RigTable& table, const BlockLayout& layout);

  /// Runs of a row of blocks. Blocks without solid angle are in none.
  [[nodiscard]] std::span<const WeightRun> runs(int lens, int block_row) const {
    return rows_[static_cast<std::size_t>(lens)][static_cast<std::size_t>(block_row)];
  }
  /// The lanes of a range of blocks of `run`, and others of it where these are fewer than kMinLanes.
  [[nodiscard]] LaneRange lane_range(int lens, Lanes lanes, const WeightRun& run, BlockRange blocks) const;
  /// Weights of a weighted run: rows of lane_range(run.blocks).count elements.
  [[nodiscard]] const std::uint8_t* weights(const WeightRun& run, Lanes lanes) const {
    return bytes_.data() + run.weights[static_cast<std::size_t>(lanes)];
  }
  /// By block, whether its weights are a plane; empty where there are no weights.
  [[nodiscard]] std::vector<std::uint8_t> planes() const;
  /// Pointers to the coefficients of this block and the following ones.
  [[nodiscard]] BlockWeights block_weights(std::size_t block, Lanes lanes) const;

 private:
  /// One element per block, plus padding for the kernel. See BlockWeights.
  struct BlockWeightArrays {
    explicit BlockWeightArrays(std::size_t blocks);
    std::vector<float> mean, along_x, along_y, half_x, total, pixels, per_total, per_pixel, inverse_vignetting, spread,
        solid_angle;
    std::array<std::vector<float>, kLaneKinds> unit, middle_x, middle_y;
  };

  void plan_row(int lens, int top, std::vector<WeightRun>& runs);
  void plan_block(int lens, std::size_t block);
  void plan_weights(int lens, int top, WeightRun& run);
  void round_weights(int lens, std::size_t block, Lanes lanes, const LaneRange& s, std::uint8_t* weights);

  const RigTable& table_;
  const BlockLayout& layout_;
  BlockWeightArrays block_weights_;
  std::vector<std::vector<std::vector<WeightRun>>> rows_;  ///< By lens and row of blocks.
  std::vector<std::uint8_t> bytes_;
};

/// Fills the same BlockSums as BlockPass, many times faster (see CodeWeights for the weights of pixels).
class CodePass {
 public:
  CodePass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout);
  CodePass(CodePass&&) = default;  ///< Not copyable: BlockRun::step points into a LensPlan.

  /// Whether the bracket is a single exposure of integer codes that the kernels can sum: rows of at least kMinLanes
  /// pixels, blocks of 2 to kMaxRows rows, and a linear response if codes have 10 or 12 bits.
  [[nodiscard]] bool supports(std::span<const Frame> bracket) const;
  /// By block, whether some of its rows may be read alone; empty: none.
  [[nodiscard]] std::vector<std::uint8_t> planes() const { return weights_.planes(); }
  /// `frame` must have passed RowReader::bind(). `read`: by block, whether it is read; empty: all are. The others keep
  /// what they hold; totals are of the blocks that were read. `rows`: those that are summed, as if the others were
  /// dark; a part only of blocks in planes().
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
