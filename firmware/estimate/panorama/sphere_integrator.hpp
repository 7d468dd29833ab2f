// Integrates a bracket of frames over the sphere: sums of blocks and their projection onto spherical harmonics.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/time.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bracket_pass.hpp"
#include "estimate/panorama/code_pass.hpp"
#include "estimate/panorama/row_sampling.hpp"
#include "estimate/panorama/run_rotation.hpp"
#include "estimate/panorama/shared_chroma.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

/// Two kinds of directions are unobserved: those that no lens of the rig sees, which get cells of their own here, and
/// the blocks of a lens whose camera is missing in the bracket.
class UnseenLight {
 public:
  UnseenLight(const RigParameters& rig, const RigTable& table, const BlockLayout& layout, const CellGrid& grid);

  /// Cells of the directions that no lens of the rig sees; empty where the rig sees the whole sphere.
  [[nodiscard]] const CellGrid& cells() const { return cells_; }

  /// Fills the unobserved blocks and cells; returns whether any was. `present`: bit mask of the lenses in the bracket.
  /// `blocks`: sums of all blocks, zero for missing lenses. `unseen`: sums of cells(), all of which are set. Time
  /// averages use observed blocks alone.
  bool fill(UnseenFill mode, unsigned present, ProbeTime time, std::span<CellSum> blocks, std::span<CellSum> unseen);

 private:
  static constexpr std::uint32_t kNoBlock = 0xFFFFFFFF;

  [[nodiscard]] std::uint32_t block_seeing(Vec3d direction, unsigned lenses) const;
  void update_mean(unsigned present, ProbeTime time, std::span<const CellSum> blocks);

  const RigTable& table_;
  const BlockLayout& layout_;
  const CellGrid& grid_;
  struct Lens {
    CameraModel model;
    Quat from_probe;
  };
  std::vector<Lens> lenses_;
  CellGrid cells_;
  std::vector<std::uint32_t> mirror_of_cell_;
  std::vector<std::vector<std::uint32_t>> mirror_of_block_;  ///< By missing lens, for each block.
  std::vector<CellSum> mean_;
  std::vector<std::uint8_t> has_mean_;  ///< By lens, whether its blocks have a mean.
  ProbeTime last_;
};

/// What a bracket reads of its frames, where CodePass or BracketPass supports it; otherwise all.
struct Reading {
  /// Brackets in which the whole picture is read once (RunRotation), where no lens is missing. The first bracket with
  /// another number of exposures than the last is read whole.
  int interleave = 1;
  /// Largest possible error of a block that is read in part (RowSampling), relative to the luminance of all; 0: every
  /// row is read.
  double max_row_error = 0;
};

/// Holds the blocks of a rig and all memory for their sums. Not thread-safe.
class SphereIntegrator {
 public:
  /// `edge`: of a block, pixels; a power of two. Refers to `table`.
  SphereIntegrator(const RigParameters& rig, const RigTable& table, int edge);
  SphereIntegrator(const SphereIntegrator&) = delete;
  SphereIntegrator& operator=(const SphereIntegrator&) = delete;

  /// The result is valid until the next call. `reader` must be bound to `bracket`; where exposures were excluded from
  /// blocks because of motion, it reads without them until the next bind(). `fill`: what replaces unobserved light.
  const FrameIntegral& integrate(RowReader& reader, std::span<const Frame> bracket, UnseenFill fill,
                                 const Reading& reading);
  /// After integrate(): what the next one reads again; see RunRotation::watch().
  void watch(std::span<const std::uint32_t> blocks, double unread) { rotation_.watch(blocks, unread); }

  [[nodiscard]] const BlockLayout& layout() const { return layout_; }
  /// Block k is cell k.
  [[nodiscard]] const CellGrid& grid() const { return grid_; }

  /// Directions and solid angles, sr, of all cells: the blocks, then those that no lens sees. For environment maps.
  [[nodiscard]] std::vector<Vec3f> cell_directions() const;
  [[nodiscard]] std::vector<float> cell_solid_angles() const;

 private:
  /// A position between four pixels: the upper left one, offsets of the right and lower neighbours (or 0), and weights.
  struct BilinearSample {
    const Vec3f* at;
    int right, down;
    float x, y;
  };

  /// Sums of the blocks of `read` (empty: all) by CodePass or BracketPass.
  void sum_codes(const RowReader& reader, std::span<const Frame> bracket, std::span<const std::uint8_t> read,
                 double max_row_error);
  /// The first block of a lens, and the one after its last.
  [[nodiscard]] std::pair<std::size_t, std::size_t> blocks_of(int lens) const;
  /// Sets the blocks of missing lenses to zero. `present`: bit mask of the lenses in the bracket.
  void clear_missing(unsigned present);
  /// Sets what integral_ holds about the observed blocks. Returns the integral of their luminance.
  double sum_observed(unsigned present);
  /// Fills centroid_overrides_ for those blocks from `begin` to before `end` whose centroid offset matters most;
  /// returns the sum of the others (FrameIntegral::centroid_offset). `luminance`: of all blocks.
  double correct_centroids(std::size_t begin, std::size_t end, double luminance);
  /// Position of the centroid of a block's light.
  [[nodiscard]] BilinearSample bilinear_sample_of(std::size_t block) const;
  [[nodiscard]] static Vec3d direction_at(const BilinearSample& sample);

  const RigTable& table_;
  BlockLayout layout_;
  CellGrid grid_;
  BlockPass block_pass_;
  CodePass code_pass_;
  BracketPass bracket_pass_;
  RowSampling row_sampling_;
  RunRotation rotation_;
  SharedChroma shared_chroma_;
  UnseenLight unseen_;
  FrameIntegral integral_;
  Projection unseen_projection_;
  double pixel_rad_;
  std::size_t exposure_count_ = 0;                ///< Of the last bracket.
  std::vector<double> lens_sr_;                   ///< By lens, solid angle of its blocks.
  std::vector<float> offset_luminance_;           ///< By block, luminance times pixels from the middle.
  std::vector<std::uint32_t> offset_blocks_;      ///< Blocks with centroid correction, and one unused element.
  std::vector<BilinearSample> bilinear_samples_;  ///< Of these blocks.
  std::vector<CellGrid::CentroidOverride> centroid_overrides_;
};

}  // namespace lightwell::estimate
