// The pass for brackets of integer codes: merges exposures per pixel by inverse variance, without those after motion.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/kernels/block_scan.hpp"
#include "estimate/panorama/kernels/bracket_rows.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

/// Fills the same BlockSums as BlockPass, many times faster, and detects motion (estimate/README.md, Brackets).
class BracketPass {
 public:
  /// Refers to `table` and `layout`.
  BracketPass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout);

  /// Whether the bracket has two or more exposures in one format of integer codes, wide enough for vectors.
  [[nodiscard]] bool supports(std::span<const Frame> bracket) const;
  /// `bracket` must have passed RowReader::bind(). `read`, `rows`: as in CodePass::run(); a block is read in every
  /// exposure.
  void run(std::span<const Frame> bracket, std::span<const std::uint8_t> read, const SampledRows& rows, BlockSums& out);

 private:
  struct LensPlan {
    std::array<CodeLut, kCodeBits.size()> luts;
    std::array<float, 3> white{1, 1, 1};
    bool linear = false;                 ///< Codes are linear.
    bool present = false;                ///< The current bracket contains the lens.
    std::array<View, kMaxBracket> view;  ///< Shortest first.
  };
  /// Part of a row of blocks of one lens that is processed at once: columns [begin, end) of pixels, whole blocks.
  struct Chunk {
    int lens;
    const LensTable& table;
    const LensPlan& plan;
    const CodeLut& lut;
    int top, rows, begin, end;
    const SampledRows& sampled;
  };

  void sort(std::span<const Frame> bracket);
  void run_chunk(const Chunk& chunk, BlockSums& out);
  /// Computes columns_ and folded_ of a chunk from the `count` shortest exposures.
  void sum(const Chunk& chunk, int count);
  /// Distance from row y of a chunk to the data needed after it. `row`, `pixel`: distances of rows and of pixels.
  [[nodiscard]] std::ptrdiff_t prefetch_distance(const Chunk& chunk, int y, std::ptrdiff_t row,
                                                 std::ptrdiff_t pixel) const;
  [[nodiscard]] RowSpan span_of(const LensTable& lens, int y) const;
  void set_row_pointers(const Chunk& chunk, int y, int begin, int end, BracketRow& row);
  void convert_to_planes(const Chunk& chunk, int y, int begin, int end, std::size_t k, ExposureRow& out);
  /// Number of consistent exposures of the block at index `at`. `disagreement`: difference of the first excluded, or 0.
  [[nodiscard]] int consistent_exposures(std::size_t at, float& disagreement) const;
  void finish_block(const Chunk& chunk, std::size_t block, std::size_t at, BlockSums& out) const;

  const RigTable& table_;
  const BlockLayout& layout_;
  std::vector<LensPlan> lenses_;
  PixelFormat format_ = PixelFormat::rgb8;
  int count_ = 0;
  std::array<float, kMaxBracket> scale_{};  ///< Longest exposure / exposure, shortest exposure first.
  float unit_ = 1;                          ///< Radiance per linear value of the longest exposure.
  std::vector<float> sums_;
  std::size_t column_stride_;
  BracketColumns columns_{};
  FoldedColumns folded_{};
  std::vector<float> disagreement_;   ///< By block of a chunk, see consistent_exposures().
  std::vector<std::uint8_t> planes_;  ///< By exposure, rows of YCbCr converted to codes of r, g, b.
};

}  // namespace lightwell::estimate
