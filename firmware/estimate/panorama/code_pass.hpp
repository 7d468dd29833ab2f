// The pass over pictures of integer codes, one exposure: rows of a block are summed for all lanes at once, in integers,
// and what a pixel weighs (solid angle, vignetting) is put on the sums.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "calibration/lens_table.hpp"
#include "camera/frame.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/code_weights.hpp"
#include "estimate/panorama/kernels/block_light.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// Fills the same BlockSums as BlockPass, many times faster.
///
/// Within a block the weight of a pixel, solid angle over vignetting, is a plane over x and y, fitted once: then sums
/// and first moments of bare codes give the weighted sum. Where it is not (at the rim of a lens, where two lenses share
/// what they see) each pixel has its own weight, in 8 bits.
class CodePass {
 public:
  CodePass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout);

  /// One exposure, a format of codes, wide enough for vectors, rows that lie within the data. Others go through
  /// BlockPass.
  [[nodiscard]] bool supports(std::span<const Frame> bracket) const;
  /// The frame has passed RowReader::bind().
  void run(const Frame& frame, BlockSums& out);

 private:
  /// A run's sums, taken apart by colour.
  struct Codes {
    std::array<std::vector<float>, 3> sum, across, down, top;
    std::vector<float> clipped;
    void resize(std::size_t blocks);
    [[nodiscard]] BlockCodes at_first();
  };
  struct LensPlan {
    CodeTable16 linear16;
    std::vector<float> step8;  ///< By linear value in 1/4095: how far apart its neighbouring codes are.
    float linear_from = 0,
          linear_unit = 0;  ///< Linear value of code 0 and, per unit of linear16 over 65535, of the rest.
    bool identity = false;  ///< Codes are linear: no table is needed.
    unsigned clipped8 = 256, clipped10 = 1024, clipped12 = 4096;
    float read2 = 0, shot = 0, cut_noise = 0;
    float white[3] = {1, 1, 1};
  };
  struct Scratch {
    std::vector<std::uint32_t> sum, early, across;
    std::vector<std::uint16_t> peak, clipped;
    explicit Scratch(std::size_t lanes);
    [[nodiscard]] LaneSums at(std::size_t lane);
  };

  void plan_lens(const PhotometricCalibration& photometry);
  void sum_run(const View& view, const LensPlan& plan, int top, int rows, const WeightRun& run);
  void finish_run(const View& view, const LensPlan& plan, int top, int rows, const WeightRun& run,
                  float radiance_per_linear, BlockSums& out);
  /// Fills codes_ with the first `blocks` blocks from lane `begin` on. `columns`: of a block's sums of a channel.
  template <Lanes lanes>
  void take_codes(const LensPlan& plan, int rows, std::size_t begin, std::size_t columns, std::size_t blocks,
                  unsigned clipped_from);

  const BlockLayout& layout_;
  CodeWeights weights_;
  std::vector<LensPlan> lenses_;
  Codes codes_;
  /// Sums of up to three groups of lanes: the planes of YCbCr, or the even and the odd rows of a mosaic.
  std::vector<Scratch> groups_;
  std::vector<std::uint8_t> planes_;
};

}  // namespace lightwell::estimate
