// What stands in for directions that no pixel sees: nothing, the mirrored light, or what was seen there before.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/config.hpp>
#include <lightwell/time.hpp>

#include "calibration/camera_model.hpp"
#include "calibration/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"

namespace lightwell::estimate {

/// Two kinds of directions are not seen: those that no lens of the rig sees, which get cells of their own here, and the
/// blocks of a lens whose camera is gone.
class UnseenLight {
 public:
  UnseenLight(const RigParameters& rig, const RigTable& table, const BlockLayout& layout, const CellGrid& grid);

  /// Directions that no lens ever sees; no cell where the rig sees the whole sphere.
  [[nodiscard]] const CellGrid& cells() const { return cells_; }
  /// Their light, as fill() left it.
  [[nodiscard]] std::span<const CellSum> sums() const { return sums_; }

  /// `blocks`: light of all blocks, zero where its lens is not among `present` (a bit each); these are filled. Returns
  /// whether anything was. Means are taken of what was seen alone, so that nothing that was filled in comes back.
  bool fill(UnseenFill choice, unsigned present, ProbeTime time, std::span<CellSum> blocks);

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
  std::vector<CellSum> sums_;
  std::vector<std::uint32_t> mirror_of_cell_;
  std::vector<std::vector<std::uint32_t>> mirror_of_block_;  ///< By lens that is gone, entries of all blocks.
  std::vector<CellSum> mean_;
  std::vector<std::uint8_t> known_;  ///< By lens: its blocks have a mean.
  ProbeTime last_;
};

}  // namespace lightwell::estimate
