// Pictures of the figurine in direct light: rays by Embree, shading in double.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "reference/image_object/figurine.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// A light of the rig: uniform over a cap. Directions are in the frame of the rig: the camera at +Z, +Y up.
struct RigLight {
  V3 towards;                     ///< Unit.
  double angular_radius_rad = 0;  ///< 0: a point light.
};

/// Position `degrees` of the semicircle of lights: 0 is on the right of the camera, 90 above and behind it, 180 left.
[[nodiscard]] V3 arc_direction(double degrees);

/// How a pixel's samples are lit by one light.
enum class PixelLight : std::uint8_t {
  dark,       ///< None is lit.
  lit,        ///< All are lit, and the mirror reflection is at most 5 % of the reflected light.
  highlight,  ///< All are lit, and it is more.
  edge,       ///< Some are lit, or are lit in part: the edge of a shadow, or of the lit side.
};

struct LitPicture {
  /// Linear, times the share of the pixel that the object covers. A white matte surface that faces the light has 0.8.
  std::vector<std::array<float, 3>> rgb;
  std::vector<PixelLight> light;
};

struct RigView {
  double turn_rad = 0;  ///< Of the turntable, right-handed about +Y.
  int side = 256;       ///< Pixels of the square picture.
  int samples = 4;      ///< A pixel has samples x samples rays, stratified.
};

class ObjectRenderer {
 public:
  ObjectRenderer();
  ~ObjectRenderer();
  ObjectRenderer(const ObjectRenderer&) = delete;
  ObjectRenderer& operator=(const ObjectRenderer&) = delete;

  struct View {
    std::vector<float> coverage;                ///< Share of each pixel that the object covers.
    std::vector<float> depth;                   ///< Mean distance from the camera along its axis; 0: no object.
    std::vector<std::array<float, 3>> ambient;  ///< In light of the same radiance from everywhere, 64 directions.
    std::vector<LitPicture> pictures;           ///< One for each light.
  };
  /// One thread. Lights with a radius: each sample of a pixel sees one point of the cap.
  [[nodiscard]] View render(const RigView& view, const std::vector<RigLight>& lights) const;

  /// Distance of the camera from the axis of the turntable; half the width of what it sees there.
  static constexpr double kCameraDistance = 6, kHalfWidth = 1.12;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace lightwell::reference
