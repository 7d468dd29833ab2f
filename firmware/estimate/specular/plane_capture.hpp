// Captures the surface light field of a plane from frames with approximate poses: refines each pose, stores the
// samples, and separates diffuse from specular radiance meanwhile.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <lightwell/uncertain_pose.hpp>

#include "estimate/specular/light_change.hpp"
#include "estimate/specular/plane_warp.hpp"
#include "estimate/specular/pose_refiner.hpp"
#include "estimate/specular/reflectance_separation.hpp"
#include "estimate/specular/surface_light_field.hpp"

namespace lightwell::specular {

struct CaptureOptions {
  PlaneTexels texels;
  int levels = 60;                      ///< Of the light field's hemisphere. More need more memory: about the square.
  int lumisphere_levels = 120;          ///< Of the specular part. More need more frames to be filled.
  std::size_t max_bytes = 148U << 20U;  ///< Of the light field. All else of an estimator has 28 to 44 MB.
  bool refine_pose = true;  ///< Costs half of the time of add(); without it errors of the tag's pose blur the texture.
  RefinerOptions refiner;
  /// Samples that the separation processes after each frame. Fewer take less time and let the prediction lag behind.
  std::size_t separation_samples = 20'000;
};

/// A similarity of the plane: x -> (1 + scale) (x + rotation × x + translation), first order. Maps positions in the
/// captured texture to positions on the plane that the tags define.
struct TextureAlignment {
  double x_m = 0, y_m = 0, rotation_rad = 0, scale = 0;

  [[nodiscard]] Vec3d texture_point(Vec3d plane_point) const {
    const Vec3d p = plane_point * (1 / (1 + scale));
    return {p.x - x_m + rotation_rad * p.y, p.y - y_m - rotation_rad * p.x, 0};
  }
  /// T_probe_texture from T_probe_plane: a scale becomes a distance from the lens. `lens`: in the plane's frame, m.
  [[nodiscard]] Pose texture_pose(const Pose& probe_plane, Vec3d lens) const;
};

struct CapturedFrame {
  bool visible = false;  ///< The plane is in the picture.
  bool stored = false;   ///< False where it does not agree with the texture: wrong pose, another object in front.
  RefinedPose pose;
  std::size_t new_samples = 0;  ///< Texels in a direction from which they had not been seen.
};

/// Takes frames in order. Not thread-safe.
class PlaneCapture {
 public:
  /// Refers to `rig`.
  PlaneCapture(const RigParameters& rig, const CaptureOptions& options);

  /// `reader` must be bound to the frame. Radiance is stored in the reader's units times `scale`. `tag_pose`:
  /// T_probe_plane. `frame` must not decrease.
  CapturedFrame add(estimate::RowReader& reader, int lens, const UncertainPose& tag_pose, std::uint32_t frame,
                    double scale);
  /// Sweeps of the separation over all samples.
  void solve(int sweeps) { separation_.solve(light_field_, sweeps); }

  /// How often the capture began again because the light had changed. The texture's place and its diffuse part, in the
  /// new light, are kept.
  [[nodiscard]] int restarts() const { return restarts_; }

  [[nodiscard]] const SurfaceLightField& light_field() const { return light_field_; }
  [[nodiscard]] const ReflectanceSeparation& separation() const { return separation_; }
  /// Refined poses are relative to the texture, whose place is that of the first frames. This is the weighted
  /// least-squares estimate from all tag poses.
  [[nodiscard]] TextureAlignment alignment() const;

 private:
  /// Of the frame that was loaded last, at a pose (T_probe_plane).
  [[nodiscard]] ViewPoint view_from(const Pose& probe_plane) const {
    return {warp_.lens_in_plane(probe_plane), warp_.pixel_rad(probe_plane)};
  }
  void add_to_alignment(const UncertainPose& tag_pose, const RefinedPose& refined);
  /// Pose of the texture in this frame at the velocity of the last two refined poses.
  [[nodiscard]] std::optional<Pose> extrapolated(std::uint32_t frame) const;
  /// Whether a frame of this relative error is stored. Updates usual_error_ and rejected_.
  [[nodiscard]] bool agrees(const RefinedPose& pose);
  void restart(const LightChange::Change& change);

  CaptureOptions options_;
  PlaneWarp warp_;
  PoseRefiner refiner_;
  SurfaceLightField light_field_;
  ReflectanceSeparation separation_;
  LightChange light_change_;
  int restarts_ = 0;
  TexelImage predicted_, image_;
  /// Normal equations of the alignment and of a tilt that all refined poses share, right-hand side last.
  std::array<std::array<double, 7>, 6> normal_{};
  struct Tracked {
    Pose pose;
    std::uint32_t frame = 0;
    bool valid = false;
  };
  std::array<Tracked, 2> track_;  ///< The last two refined poses, older one first.
  double usual_error_ = 0;        ///< Running mean of RefinedPose::error_after of stored frames; 0: none yet.
  int rejected_ = 0;              ///< Frames since the last stored one.
};

}  // namespace lightwell::specular
