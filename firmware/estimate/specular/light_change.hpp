// Notices that the light on a plane has changed, from the contrast of its texture.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimate/specular/plane_texels.hpp"
#include "estimate/specular/surface_light_field.hpp"

namespace lightwell::specular {

/// A mirror image is smooth, so the detail of the texture in 16 x 16 cells (a cell minus the mean of its neighbours) is
/// that of the diffuse part: its ratio to the known one is the irradiance now, relative to that of the capture. It
/// does not need the mirror image, which is unknown in directions that no frame has seen. A hand, a wrong pose or a
/// strong highlight changes the pattern, too: then the details do not correlate.
class LightChange {
 public:
  explicit LightChange(const PlaneTexels& texels);

  struct Change {
    std::uint32_t since = 0;  ///< The first frame of the new light.
    double gain = 1;          ///< Irradiance relative to before.
  };
  /// A frame at its refined pose, and the diffuse part as captured. Returns a change after kFrames successive
  /// usable frames have shown it; a frame is usable if its detail correlates with the texture. nullopt also where there
  /// is too little texture, too little of it seen, or where the view is so grazing that a pixel is longer than a third
  /// of a cell.
  std::optional<Change> add(const TexelImage& image, const ViewPoint& from, const TexelImage& diffuse,
                            std::uint32_t frame);

  /// Smallest change of the irradiance that is noticed, as the absolute value of its logarithm: 18 % less, 22 % more.
  /// Grazing views, whose pixels are longer than texels, lose up to 14 % of the contrast.
  static constexpr double kMinChange = 0.2;
  static constexpr int kFrames = 8;

 private:
  struct Contrast {
    double gain = 1, correlation = 0;
  };
  /// nullopt where there is too little of it.
  [[nodiscard]] std::optional<Contrast> contrast_of(const TexelImage& image, const TexelImage& diffuse);

  PlaneTexels texels_;
  int cells_;                                 ///< Along a side.
  std::vector<float> of_image_, of_diffuse_;  ///< Mean luminance by cell; NaN: not known.
  std::optional<std::uint32_t> since_;
  std::vector<double> gains_;  ///< Of the frames since then.
};

}  // namespace lightwell::specular
