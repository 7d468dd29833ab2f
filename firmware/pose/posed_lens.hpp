// The lenses of a rig, prepared for repeated use: camera model and pose on the probe.
#pragma once

#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/camera_model.hpp"

namespace lightwell {

struct PosedLens {
  int width = 0, height = 0;
  Pose probe_lens;  ///< T_probe_lens, lens axes _cv, the rotation normalised.
  CameraModel model;
  std::optional<PixelPosition> axis;  ///< The principal point; an equirectangular picture has none.

  explicit PosedLens(const LensParameters& lens)
      : width(lens.width),
        height(lens.height),
        probe_lens{lens.pose_cv.rotation.normalized(), lens.pose_cv.translation},
        model(lens) {
    std::visit(
        [&](const auto& p) {
          if constexpr (requires { p.cx; }) axis = PixelPosition{p.cx, p.cy};
        },
        lens.model);
  }
};

/// Made from a rig that has passed validate(). Construction takes about a millisecond per lens, because the model
/// computes the limit of its projection: callers that process a video keep one. Converts implicitly from a rig.
struct PosedLenses {
  std::vector<PosedLens> lenses;

  PosedLenses(const RigParameters& rig) {  // NOLINT: implicit by intention
    for (const LensParameters& lens : rig.lenses) lenses.emplace_back(lens);
  }
  [[nodiscard]] bool has(int lens) const { return lens >= 0 && static_cast<std::size_t>(lens) < lenses.size(); }
  [[nodiscard]] const PosedLens& at(int lens) const { return lenses[static_cast<std::size_t>(lens)]; }
};

}  // namespace lightwell
