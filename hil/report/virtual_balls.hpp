// Virtual balls on a real plane, drawn into a picture of it.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include <lightwell/plane_appearance.hpp>
#include <lightwell/shadows.hpp>

#include "report/page.hpp"

namespace lightwell::hil {

struct VirtualBall {
  Vec3d centre;  ///< m, plane's frame.
  double radius_m = 0;
  bool glossy = false;  ///< A metal of roughness kBallRoughness; otherwise matte white.
};
inline constexpr float kBallRoughness = 0.3F;

/// Light at the middle of the plane as a function; directions are unit vectors in the plane's frame.
struct LightFunctions {
  std::function<Irradiance(Vec3d normal)> irradiance;
  std::function<Radiance(Vec3d direction, float perceptual_roughness)> radiance;
};

/// Shadow ratios of a square of the plane, `edge` x `edge`, row 0 at +Y.
struct ShadowTexture {
  double side_m = 0;
  int edge = 0;
  std::vector<LightRatio> ratios;

  [[nodiscard]] LightRatio at(double x, double y) const;  ///< 1 outside of the square.
};

/// By ShadowCaster, of the lighting in the plane's frame.
[[nodiscard]] Result<ShadowTexture> cast_shadows(const Lighting& in_plane, std::span<const VirtualBall> balls,
                                                 double side_m, int edge);

/// `real`: what the camera sees, the plane's radiance D + S; `diffuse`: D. The shadow dims D alone: real - D (1 -
/// ratio). `camera` has twice the size of the pictures; its pixels are averaged.
[[nodiscard]] LinearPicture draw_balls(const PlaneCamera& camera, const LinearPicture& real,
                                       const LinearPicture& diffuse, std::span<const VirtualBall> balls,
                                       const LightFunctions& light, const ShadowTexture& shadows);

}  // namespace lightwell::hil
