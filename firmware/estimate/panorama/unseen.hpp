// Fills directions that no pixel sees: with zero, the mirror image, or the time average of earlier frames.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/time.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"

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

}  // namespace lightwell::estimate
