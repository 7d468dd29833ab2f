// Direct photometric alignment of a picture of the plane with the radiance that is predicted for its texels.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <lightwell/uncertain_pose.hpp>

#include "estimate/specular/plane_warp.hpp"

namespace lightwell::specular {

struct RefinerOptions {
  /// Gauss-Newton steps with means over tiles (they converge from farther away), then with single texels or, in
  /// views whose pixels are longer, with means over 2x2 or a tile. Each costs a warp of the whole plane. The first must
  /// be at least 1.
  int tile_steps = 3, texel_steps = 2;
};

struct RefinedPose {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Pose probe_plane;
  /// Mean absolute difference of the detail (value minus mean of the neighbours) of tiles and of their prediction,
  /// relative to the prediction's detail, before and after; infinite where nothing can be compared.
  double error_before = kInfinity, error_after = kInfinity;
  int texels = 0;  ///< That were compared in the last step.
  /// Inverse covariance of the pose, as a motion in the plane's frame (plane_motion.hpp; 1/rad², 1/m²), by these texels
  /// alone, without the prior. Zero where nothing was compared.
  PoseCovariance information{};
  /// False: the error grew, or the pose contradicts the prior. The pose is that from which the refinement started.
  bool aligned = false;
};

/// Efficient second-order minimisation (Benhimane & Malis 2004, "Real-time image-based tracking of planes using
/// efficient second-order minimization") over the six parameters of a rigid motion, with Tukey weights and the tag's
/// pose as prior. Reuses its memory.
class PoseRefiner {
 public:
  PoseRefiner(const PlaneTexels& texels, const RefinerOptions& options) : texels_(texels), options_(options) {}

  /// `warp` must be loaded. Starts from the pose of `prior` or from `other`, whichever agrees better with the picture,
  /// but not from one that contradicts the prior's covariance. `predicted`: texels that are not measured() are ignored.
  /// `image` receives the texels at the returned pose.
  [[nodiscard]] RefinedPose refine(PlaneWarp& warp, const UncertainPose& prior, const std::optional<Pose>& other,
                                   const TexelImage& predicted, TexelImage& image);

 private:
  struct Step;
  /// One linearisation at cells of `cell` texels: of observed_ and predicted_.
  [[nodiscard]] Step step(int cell, Vec3d lens) const;
  /// Fills predicted_ with the means over cells of predicted_texels_.
  void reduce(int cell);

  PlaneTexels texels_;
  RefinerOptions options_;
  std::vector<float> predicted_texels_;  ///< Luminance by texel; NaN where not measured.
  std::vector<float> predicted_, observed_;
};

}  // namespace lightwell::specular
