// Tells whether the light on a body and on the ground plane has changed between frames. While lamps and body stay where
// they are, the light that falls onto a patch of the body or a place of the plane is the same, whatever the camera
// does.
#pragma once

#include <array>
#include <map>
#include <span>

#include <lightwell/geometry.hpp>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

class ShadingChange {
 public:
  /// Whether a face's irradiance, or the ground plane's radiance at the same places, differs by more than its errors
  /// from the last frame that showed it, or from the first one since the last change. False for the first frame, and
  /// where nothing was seen before. If it has changed, and after clear(), this frame is the first one. The plane counts
  /// while the lens rests: otherwise its samples are at other places. `probe_body`: rotation of T_probe_body. `view`:
  /// unit vector from the body's centre to the lens, body axes.
  [[nodiscard]] bool update(const Shading& shading, Quat probe_body, Vec3d view);
  void clear();

 private:
  /// Of two frames; normals in the body's axes.
  struct Patch {
    SurfaceSample first, last;
  };
  struct Place {
    Vec3d position;  ///< Body axes, from the body's centre, m.
    double radiance = 0, sigma = 0;
  };
  using Places = std::map<std::array<int, 3>, Place>;

  [[nodiscard]] static Places places_of(const Shading& shading, Quat probe_body);
  /// Whether a face deviates from its samples `before`. `samples`: normals in the body's axes. `sigma`: of the ratio of
  /// a face's irradiances in two frames, in addition to the samples' own errors.
  [[nodiscard]] bool faces_differ(std::span<const SurfaceSample> samples, SurfaceSample Patch::*before,
                                  double sigma) const;

  std::map<int, Patch> patches_;  // by SurfaceSample::patch
  Places first_, last_;           // of the ground plane, of two frames
  Vec3d first_view_;
};

}  // namespace lightwell::marker
