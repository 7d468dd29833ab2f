// Shadows that image-based objects (image_object.hpp) cast on a plane.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/image_object.hpp>
#include <lightwell/result.hpp>
#include <lightwell/shadows.hpp>

namespace lightwell {

/// A rectangle of a plane. Its frame: origin in the middle, +Z the normal of the lit side, +X right, +Y up.
struct ObjectShadowPlane {
  Pose T_object_plane;  ///< In the object's frame.
  double width_m = 0, height_m = 0;
  int columns = 256, rows = 256;  ///< Texels; row 0 is on the side of +Y.

  static constexpr int kMaxSide = 4096;

  /// invalid_argument, naming the member.
  [[nodiscard]] Status validate() const;
};

/// Casts shadows from the silhouettes of the views, as the CyberMirage paper does (section 3.2): the silhouette seen
/// from the light is that of the view nearest to the light's azimuth, or the mirrored one of the view from behind. It
/// stands on a board through the axis of the turntable, upright and across the light. One thread; a call allocates
/// nothing.
class ObjectShadowCaster {
 public:
  /// Decodes the coverage of all views. As ImageObject::view().
  [[nodiscard]] static Result<ObjectShadowCaster> make(const ImageObject& object);

  struct Summary {
    int lights = 0;  ///< Lights that reach the plane.
    /// Largest angle between the azimuth of such a light and that of the silhouette that stands for it, rad.
    float outside_rad = 0;
  };

  /// Fills ratios[row * columns + column]: irradiance of the texel's centre with the object divided by that without,
  /// per channel, 0 to 1; 1 where a channel has no light. Each light is sampled over its angular radius by kSamples
  /// directions. Lights are distant. invalid_argument, and nothing written, for a plane as validate(), a span of
  /// another size, and lights as ObjectRelighter::relight() or with a radius that is not 0 to pi / 2.
  [[nodiscard]] Result<Summary> cast(std::span<const ObjectLight> lights, const ObjectShadowPlane& plane,
                                     std::span<LightRatio> ratios) const;

  static constexpr int kSamples = 32;

 private:
  struct Silhouette {
    double azimuth_rad = 0;  ///< Direction from the axis to the camera, about +Y from +Z.
    std::vector<std::uint8_t> coverage;
  };
  int columns_ = 0, rows_ = 0;
  double half_width_m_ = 0;
  std::vector<Silhouette> silhouettes_;
};

}  // namespace lightwell
