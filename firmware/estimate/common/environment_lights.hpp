// Takes the lights of a descriptor out of a map that contains them: readers add every light to the map as a cap.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "estimate/common/environment_updates.hpp"

namespace lightwell::estimate {

/// A light wider than a texel is subtracted as readers draw it: a cap of uniform radiance. What the cap does not
/// explain of a region of another shape stays in the map, so that map and cap add up to the region. Where the cap is
/// brighter than the region the difference is negative: levels of roughness above 0 are means of it, and level 0, which
/// holds no negative radiance, is then too bright by it.
///
/// A light narrower than a texel may be anywhere in it, and a small error of its direction would leave a bright texel
/// beside a negative one. Of the texels that it reaches, the radiance above that of the texels around them is reduced
/// by the light's irradiance, in proportion. Between one and two texels both results are blended, so that a light whose
/// radius varies does not change the map abruptly.
class LightSubtraction {
 public:
  /// Refers to `grid`.
  explicit LightSubtraction(const OctahedralGrid& grid);

  struct Removal {
    std::uint32_t texel;
    float angle;                   ///< Between its centre and the light, rad.
    std::array<float, 3> removed;  ///< Radiance to subtract, in units of the texels; may exceed theirs.
  };

  /// What to subtract for a light. `texels`: mean radiance of each texel of the grid, this light and weaker ones
  /// included. `radiance_per_unit`: radiance of `texels` per radiance of the light. Valid until the next call.
  /// Allocates nothing.
  [[nodiscard]] std::span<const Removal> removal(const Light& light, float radiance_per_unit,
                                                 std::span<const Rgbx> texels);

  static void subtract(std::span<const Removal> removal, std::span<Rgbx> texels);

 private:
  void find_near(Vec3f direction, float reach_rad);
  void remove_excess(const Light& light, float radiance_per_unit, float share, std::span<const Rgbx> texels);
  void remove_cap(const Light& light, float radiance_per_unit, float share);

  const OctahedralGrid& grid_;
  float texel_rad_;            ///< Edge of a square with a texel's mean solid angle.
  std::vector<Vec3f> centre_;  ///< By texel.
  std::vector<Removal> near_;  ///< Texels around the current light.
};

}  // namespace lightwell::estimate
