// The pass over brackets of integer codes: exposures are merged pixel by pixel by their noise, and where something
// moved between them, only those are that tell of one moment.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/lens_table.hpp"
#include "camera/frame.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/kernels/bracket_rows.hpp"

namespace lightwell::estimate {

/// Fills the same BlockSums as BlockPass, many times faster, and looks for motion besides.
///
/// Motion: exposures are put in order, shortest first, and each is held against the next longer one, block by block:
/// what the two tell of the luminance of the pixels that both tell may differ by three deviations of a pixel each and 2
/// %; and what is saturated in the longer one must be half as bright in the shorter one at least. A block takes the
/// exposures up to the first that contradicts the one before. The shortest is always among them, as it alone tells of
/// what gives most of the light: so all lamps are seen at one moment, and none twice or not at all.
class BracketPass {
 public:
  /// `blocks` knows the middles of the blocks of `layout`; all must live as long as this.
  BracketPass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout, const BlockPass& blocks);

  /// Two exposures or more of one format of codes, wide enough for vectors. Others go through BlockPass.
  [[nodiscard]] bool supports(std::span<const Frame> bracket) const;
  /// The bracket has passed RowReader::bind().
  void run(std::span<const Frame> bracket, BlockSums& out);

 private:
  struct LensPlan {
    CodeLut lut8, lut10, lut12;
    std::array<float, 3> white{1, 1, 1};
    bool linear = false;                 ///< Codes are.
    bool seen = false;                   ///< By the bracket at hand.
    std::array<View, kMaxBracket> view;  ///< Shortest first.
  };
  /// Columns of pixels of one lens that are worked on together: whole blocks.
  struct Chunk {
    int lens, top, rows, begin, end;
  };

  [[nodiscard]] const CodeLut& lut_for(int lens) const;
  void sort(std::span<const Frame> bracket);
  void run_chunk(const Chunk& chunk, BlockSums& out);
  /// The chunk's sums of the `count` shortest exposures.
  void sum(const Chunk& chunk, int count);
  /// From row y of a chunk to what is needed after it, where rows and pixels are so far apart.
  [[nodiscard]] std::ptrdiff_t ahead_of(const Chunk& chunk, int y, std::ptrdiff_t row, std::ptrdiff_t pixel) const;
  [[nodiscard]] RowSpan span_of(const LensTable& lens, int y) const;
  void point_at_row(const Chunk& chunk, int y, int begin, int end, BracketRow& row);
  void point_at_planes(const Chunk& chunk, int y, int begin, int end, std::size_t k, ExposureRow& out);
  /// How many exposures the block whose sums are at `at` takes; `dispute`: by how much the first that it does not take
  /// differs, of pixels.
  [[nodiscard]] int consistent_exposures(std::size_t at, float& disagreement) const;
  void finish_block(const Chunk& chunk, std::size_t block, std::size_t at, BlockSums& out) const;

  const RigTable& table_;
  const BlockLayout& layout_;
  const BlockPass& blocks_;
  std::vector<float> pixel_sr_;  ///< By block, of a pixel: the mean.
  std::vector<LensPlan> lenses_;
  PixelFormat format_ = PixelFormat::rgb8;
  int count_ = 0;
  std::array<float, kMaxBracket> scale_{};  ///< Shortest first, of the longest exposure's 1.
  float unit_ = 1;                          ///< Radiance per linear value of the longest.
  std::vector<float> sums_;
  std::size_t column_stride_;
  BracketColumns columns_{};
  FoldedColumns folded_{};
  std::vector<float> disagreement_;        ///< By block of a chunk: the light by which its exposures differ.
  std::vector<std::uint8_t> planes_;  ///< Rows of YCbCr as codes of r, g, b, by exposure.
};

}  // namespace lightwell::estimate
