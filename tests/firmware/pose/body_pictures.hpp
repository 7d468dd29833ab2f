// Pictures of a dodecahedron in front of clutter, by the reference renderer.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "firmware/pose/bodies_in_view.hpp"
#include "reference/marker/marker_exposure.hpp"
#include "reference/marker/marker_picture.hpp"

namespace lightwell::test {

struct BodyShot {
  Pose probe_body;
  /// For motion blur: the pose when the shutter closes; probe_body is then the pose when it opens.
  std::optional<Pose> closing_pose;
  double blur_px = 0.6;       ///< Standard deviation of the lens blur.
  double exposure = 1;        ///< 1: the brightest face is at 0.7 of full scale.
  double electrons = 10'000;  ///< Full scale at exposure 1.
  double read_noise_electrons = 3;
  bool srgb = false;  ///< Encoded as sRGB; otherwise linear.
  bool mirrored = false;
  std::optional<reference::SphereOccluder> occluder;
  std::uint64_t seed = 1;
};

class BodyCamera {
 public:
  BodyCamera(const RigParameters& rig, const MarkerBody& body, std::uint64_t clutter_seed = 7);

  [[nodiscard]] reference::GreyBytes take(const BodyShot& shot) const { return expose(radiance(shot), shot); }
  [[nodiscard]] reference::GreyBytes take(const Pose& probe_body, std::uint64_t seed = 1) const;

  /// Linear radiance without lens blur, one value per pixel; takes most of the time of take().
  [[nodiscard]] std::vector<float> radiance(const BodyShot& shot) const;
  /// Lens blur, exposure and noise of `shot`.
  [[nodiscard]] reference::GreyBytes expose(std::vector<float> radiance, const BodyShot& shot) const;

 private:
  [[nodiscard]] std::vector<float> radiance_at(const Pose& probe_body, const BodyShot& shot) const;

  reference::MarkerCamera camera_;
  reference::MarkerScene scene_;
  std::vector<float> clutter_;
};

}  // namespace lightwell::test
