// The pass over pictures of integer codes, one exposure: rows of a block are summed for all lanes at once, in integers, and
// what a pixel weighs (solid angle, vignetting) is put on the sums.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "calibration/lens_table.hpp"
#include "camera/frame.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/kernels/block_light.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// Fills the same BlockSums as BlockPass, many times faster.
///
/// Within a block the weight of a pixel, solid angle over vignetting, is a plane over x and y, fitted once: then sums and
/// first moments of bare codes give the weighted sum. Where it is not (at the rim of a lens, where two lenses share what
/// they see) each pixel has its own weight, in 8 bits.
class CodePass {
 public:
  CodePass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout);

  /// One exposure, a format of codes, wide enough for vectors, rows that lie within the data. Others go through BlockPass.
  [[nodiscard]] bool takes(std::span<const Frame> bracket) const;
  /// The frame has passed RowReader::bind().
  void run(const Frame& frame, BlockSums& out);

 private:
  /// How samples lie in a row.
  enum class Lanes : std::uint8_t { interleaved, planar, mosaic };
  static constexpr std::size_t kLaneKinds = 3;

  /// What a block's sums are worth, while it is planned.
  struct BlockWeight {
    float mean = 0, along_x = 0, along_y = 0;  ///< Plain: the fitted plane about the middle of the block.
    float half_x = 0;                          ///< That middle, pixels from the block's corner.
    float total = 0;                           ///< Sum of weights.
    float pixels = 0;                          ///< That see something.
    float solid_angle = 0;
    /// Of the three above, made once because divisions are what a block's sums would wait for.
    float per_total = 0, per_pixel = 0, brighten = 0, spread = 0;
    /// Weighted: weight of the 8-bit number 256, so that the block's numbers add up to its total; 0 marks a plain block.
    float unit[kLaneKinds] = {};
    float middle_x[kLaneKinds] = {}, middle_y[kLaneKinds] = {};  ///< Of these numbers, pixels from the block's corner.
  };
  /// The same of all blocks, by what the kernel reads.
  struct Worths {
    std::vector<float> mean, along_x, along_y, half_x, total, pixels, per_total, per_pixel, brighten, spread, solid_angle;
    std::array<std::vector<float>, kLaneKinds> unit, middle_x, middle_y;
    [[nodiscard]] BlockWorth at(std::size_t block, Lanes lanes) const;
  };
  /// A run's sums, taken apart by colour.
  struct Codes {
    std::array<std::vector<float>, 3> sum, across, down, top;
    std::vector<float> clipped;
    void resize(std::size_t blocks);
    [[nodiscard]] BlockCodes at_first();
  };
  /// Neighbouring blocks of one kind within a row of blocks.
  struct Run {
    int first, end;  ///< Columns of blocks.
    bool weighted;
    std::size_t weights[kLaneKinds];  ///< Where the run's rows of weights begin.
  };
  struct BlockRow {
    std::vector<Run> runs;
  };
  struct LensPlan {
    std::vector<BlockRow> rows;
    CodeTable16 linear16;
    std::vector<float> step8;  ///< By linear value in 1/4095: how far apart its neighbouring codes are.
    float linear_from = 0, linear_unit = 0;  ///< Linear value of code 0 and, per unit of linear16 over 65535, of the rest.
    bool identity = false;                   ///< Codes are linear: no table is needed.
    unsigned clipped8 = 256, clipped10 = 1024, clipped12 = 4096;
    float read2 = 0, shot = 0, cut_noise = 0;
    float white[3] = {1, 1, 1};
  };
  /// The lanes that a kernel runs over for some columns of blocks: at least kFewestLanes of them.
  struct Stretch {
    std::size_t begin, count;
  };
  struct Scratch {
    std::vector<std::uint32_t> sum, early, across;
    std::vector<std::uint16_t> peak, clipped;
    explicit Scratch(std::size_t lanes);
    [[nodiscard]] LaneSums at(std::size_t lane);
  };

  [[nodiscard]] static Lanes lanes_of(PixelFormat format);
  [[nodiscard]] Stretch stretch(const LensTable& lens, Lanes lanes, int first, int end) const;
  void plan_lens(int lens, const PhotometricCalibration& photometry);
  void plan_block(int lens, std::size_t block, BlockWeight& out) const;
  void plan_weights(int lens, int block_row, Run& run);
  void round_weights(int lens, std::size_t block, Lanes lanes, const Stretch& s, std::uint8_t* weights);
  void sum_run(const View& view, const LensPlan& plan, int top, int rows, const Run& run);
  void keep_worths();
  void finish_run(const View& view, const LensPlan& plan, int top, int rows, const Run& run, float radiance_per_linear,
                  BlockSums& out);
  /// Fills codes_ with the first `blocks` blocks from lane `begin` on. `columns`: of a block's sums of a channel.
  template <Lanes lanes>
  void take_codes(const LensPlan& plan, int rows, std::size_t begin, std::size_t columns, std::size_t blocks,
                  unsigned clipped_from);

  const RigTable& table_;
  const BlockLayout& layout_;
  std::vector<LensPlan> lenses_;
  std::vector<BlockWeight> planned_;  ///< Empty once all is planned.
  Worths worths_;
  Codes codes_;
  std::vector<std::uint8_t> weights_;
  /// Sums of up to three groups of lanes: the planes of YCbCr, or the even and the odd rows of a mosaic.
  std::vector<Scratch> groups_;
  std::vector<std::uint8_t> planes_;
};

}  // namespace lightwell::estimate
