// Pictures of a dodecahedron in front of a room's clutter, by the oracle's renderer, and where it really is.
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
  /// Where the body is when the shutter closes, had it been at probe_body when it opened.
  std::optional<Pose> closing;
  double blur_px = 0.6;       ///< Of the lens, standard deviation.
  double exposure = 1;        ///< 1: the brightest face is at 0.7 of full scale.
  double electrons = 10'000;  ///< Of full scale, exposure 1.
  double read_noise_electrons = 3;
  bool mirrored = false;
  std::optional<reference::SphereOccluder> cover;
  std::uint64_t seed = 1;
};

class BodyCamera {
 public:
  BodyCamera(const RigParameters& rig, const MarkerBody& body, std::uint64_t clutter_seed = 7);

  [[nodiscard]] reference::GreyBytes take(const BodyShot& shot) const;
  [[nodiscard]] reference::GreyBytes take(const Pose& probe_body, std::uint64_t seed = 1) const;

 private:
  /// Linear, one value a pixel.
  [[nodiscard]] std::vector<float> light(const Pose& probe_body, const BodyShot& shot) const;

  reference::MarkerCamera camera_;
  reference::MarkerScene scene_;
  std::vector<float> clutter_;
};

}  // namespace lightwell::test
