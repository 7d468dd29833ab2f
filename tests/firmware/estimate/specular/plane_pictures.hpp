// Pictures of a plane by a pinhole camera, as float frames, from a function of the plane's point.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "imaging/frame.hpp"

namespace lightwell::specular {

inline constexpr int kWidth = 320, kHeight = 240;
inline constexpr double kFocal_px = 300;

[[nodiscard]] inline RigParameters pinhole_rig() {
  LensParameters lens;
  lens.width = kWidth, lens.height = kHeight;
  lens.model = MeiParameters{kFocal_px, kFocal_px, (kWidth - 1) / 2.0, (kHeight - 1) / 2.0, 0, 0, 0, 0, 0};
  lens.max_angle_rad = 0.7;
  lens.pose_cv = {upright_lens_cv(), {}};
  RigParameters rig;
  rig.lenses = {lens};
  return rig;
}

/// T_probe_plane of a camera that looks at the plane's origin. `azimuth_rad` from +X of the plane.
[[nodiscard]] inline Pose looking_at_plane(double elevation_rad, double azimuth_rad, double distance_m) {
  const Vec3d eye = Vec3d{std::cos(elevation_rad) * std::cos(azimuth_rad),
                          std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad)} *
                    distance_m;
  // Probe axes in the plane's frame: +Z back from the origin, +X level.
  const Vec3d back = normalized(eye),
              right =
                  normalized(cross(Vec3d{-std::cos(azimuth_rad), -std::sin(azimuth_rad), 1e-6} + Vec3d{0, 0, 1}, back)),
              up = cross(back, right);
  const auto rotate_point = [&](Vec3d p) { return Vec3d{dot(right, p), dot(up, p), dot(back, p)}; };
  const Vec3d x = rotate_point({1, 0, 0}), y = rotate_point({0, 1, 0}), z = rotate_point({0, 0, 1});
  // The trace is above -1 for all views from above.
  const double w = std::sqrt(std::max(1e-12, 1 + x.x + y.y + z.z)) / 2;
  const Quat q = Quat{(y.z - z.y) / (4 * w), (z.x - x.z) / (4 * w), (x.y - y.x) / (4 * w), w}.normalized();
  return {q, -rotate(q, eye)};
}

/// Radiance by the plane's point (z = 0); the picture is black where the ray misses z = 0.
using PlaneRadiance = std::function<Vec3d(Vec3d point, Vec3d eye)>;

/// A frame of floats with exposure 1.
class PlanePicture {
 public:
  PlanePicture(const Pose& probe_plane, const PlaneRadiance& radiance)
      : pixels_(static_cast<std::size_t>(kWidth) * kHeight * 3) {
    const Pose plane_lens = inverse(compose(inverse(Pose{upright_lens_cv(), {}}), probe_plane));
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Vec3d ray = rotate(plane_lens.rotation,
                                 Vec3d{(x - (kWidth - 1) / 2.0) / kFocal_px, (y - (kHeight - 1) / 2.0) / kFocal_px, 1});
        const Vec3d eye = plane_lens.translation;
        if (!(ray.z < 0)) continue;
        const Vec3d v = radiance(eye - ray * (eye.z / ray.z), eye);
        float* out = &pixels_[static_cast<std::size_t>(y * kWidth + x) * 3];
        out[0] = static_cast<float>(v.x), out[1] = static_cast<float>(v.y), out[2] = static_cast<float>(v.z);
      }
    frame_.info.exposure_s = 1;
    frame_.add_view({0, PixelFormat::rgb_f32, kWidth, kHeight, sizeof(float) * 3 * kWidth,
                     std::as_bytes(std::span<const float>(pixels_))});
  }

  [[nodiscard]] std::span<const Frame> bracket() const { return {&frame_, 1}; }
  [[nodiscard]] std::vector<float>& pixels() { return pixels_; }

 private:
  std::vector<float> pixels_;
  Frame frame_;
};

/// A smooth texture with detail of 2 cm and more, 0.1 to 0.9.
[[nodiscard]] inline Vec3d smooth_texture(Vec3d p) {
  const double v = 0.5 + 0.2 * std::sin(170 * p.x + 40 * p.y) + 0.2 * std::sin(210 * p.y - 30 * p.x);
  return {v, 0.8 * v, 0.6 * v + 0.1 * std::sin(60 * p.x)};
}

}  // namespace lightwell::specular
