// Chooses how a mirror shows each light: as a cap of uniform radiance, or as the texels of the map.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/common/environment_lights.hpp"
#include "estimate/common/environment_updates.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/row_reader.hpp"

namespace lightwell::estimate {

/// A cap shows a lamp or the sun, which is narrower than a texel, more exactly than texels do; texels show a window, or
/// another region that is no uniform disc, more exactly than a cap does. Both are compared with the pixels around the
/// light, as a reader would draw them: a cap is chosen where its squared error is smaller, of radiance, which counts
/// for what the mirror lights, and of the square root of radiance, which is nearer to what a display shows of it.
class LightTexels {
 public:
  /// Most texels in which lights may be shown; limits the size of a message. Others stay caps.
  static constexpr std::size_t kMaxTexels = 1024;

  /// Refers to its arguments but `edge`, the edge of the map's first level: that of `grid` or half of it.
  LightTexels(const RigTable& table, const BlockLayout& layout, const CellGrid& cells, const OctahedralGrid& grid,
              int edge);

  /// Begins a map. `texels`: mean radiance by texel of the grid, lights included.
  void begin(std::span<const Rgbx> texels);

  /// Adds a light whose removal from the texels is `removal`. Reads the pixels around it. `radiance_per_unit`: radiance
  /// of the texels per radiance of the light. A light keeps its last choice until the other one is clearly better.
  void add(const Light& light, float radiance_per_unit, std::span<const LightSubtraction::Removal> removal,
           RowReader& reader);

  /// The lights that texels show. Valid until the next begin().
  [[nodiscard]] LightsInTexels chosen();

 private:
  /// Integrals over the surroundings of a light.
  struct SquaredErrors {
    double radiance = 0, root = 0;
    void add(float sr, float pixel, float shown);
    [[nodiscard]] bool below(const SquaredErrors& other, double factor) const {
      return radiance < factor * other.radiance && root < factor * other.root;
    }
  };
  [[nodiscard]] std::size_t level_texel(std::size_t grid_texel) const;
  /// Whether the errors of a cap are below `factor` times those of texels.
  [[nodiscard]] bool cap_is_better(const Light& light, float radiance_per_unit, double factor, RowReader& reader);

  const RigTable& table_;
  const BlockLayout& layout_;
  const CellGrid& cells_;
  const OctahedralGrid& grid_;
  int edge_;
  float pixel_rad_, block_rad_;
  std::vector<double> solid_angle_;  ///< Of the first level's texels, sr.
  std::vector<Rgbx> with_;           ///< Texels of the first level with all lights.
  std::vector<Rgbx> without_;        ///< Without the light that is compared.
  std::vector<std::uint32_t> near_;  ///< Texels in which these two differ.
  std::vector<Rgbx> added_;          ///< By texel of the grid, the radiance of the chosen lights.
  std::vector<std::uint8_t> used_;   ///< By texel of the first level, whether a chosen light is in it.
  std::size_t used_count_ = 0;
  std::vector<std::uint32_t> tracks_, caps_;            ///< Tracks of lights as texels, and of those as caps.
  std::vector<std::uint32_t> last_tracks_, last_caps_;  ///< Those of the last map.
  LinearRow row_;
};

}  // namespace lightwell::estimate
