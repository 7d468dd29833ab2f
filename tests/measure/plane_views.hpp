// Views of a captured plane, re-rendered and compared with the true ones.
#pragma once

#include <vector>

#include "estimate/specular/gloss_estimate.hpp"
#include "estimate/specular/plane_capture.hpp"
#include "measure/specular_sequences.hpp"

namespace lightwell::measure {

/// What is needed to re-render a plane: radiance L(x, v) = texture(x) + specular(v), normalised intensity.
struct PlaneAppearance {
  specular::PlaneTexels texels;
  specular::TexelImage texture;
  specular::TextureAlignment alignment;
  specular::Lumisphere specular;
  bool interpolate = true;  ///< Between the nodes of the lumisphere; false: the nearest one.
};

/// Of the capture's separation: sharpened texture, interpolated lumisphere. `gloss`: the estimate from it, which
/// predicts directions that no frame saw, as in captured planes; null: they have their neighbours' mean.
[[nodiscard]] PlaneAppearance appearance_of(const specular::PlaneCapture& capture,
                                            const specular::GlossEstimate* gloss = nullptr);

/// As published (Jachnik et al. 2012): running medians as texture; the mean over all texels of sample minus median in
/// each direction of the light field as specular part, nearest direction on reading. Nothing where no direction was
/// seen.
[[nodiscard]] PlaneAppearance published_appearance(const specular::PlaneCapture& capture);

/// A true view and its pose.
struct HeldOutView {
  Pose probe_plane;
  reference::GlossyView truth;
};
[[nodiscard]] std::vector<HeldOutView> held_out_views(const SpecularSequence& sequence);

/// Of all views together, over the pixels that are wholly on the plane, intensities clipped at 1 on both sides.
struct ViewErrors {
  double rmse = 0;       ///< Over pixels and channels.
  double rmse_seen = 0;  ///< Without pixels whose direction no frame saw.
  /// Largest difference of the gradient (central differences of luminance, per pixel).
  double max_gradient_difference = 0;
  double saturated = 0;  ///< Share of pixels with a channel above 1 in the truth.
  double unseen = 0;     ///< Share of pixels whose direction no frame saw: there the specular part is a guess.
};
[[nodiscard]] ViewErrors view_errors(const SpecularSequence& sequence, const std::vector<HeldOutView>& views,
                                     const PlaneAppearance& appearance);

/// A frame of a sequence, and its refined pose (T_probe_texture).
struct RefinedFrame {
  int frame = 0;
  specular::RefinedPose pose;
};

/// What the true poses say of refined ones.
struct RefinementTruth {
  /// Where the captured texture lies on the plane: least squares of where the frames above 20 degrees of elevation see
  /// four of its points.
  specular::TextureAlignment alignment;
  /// Of the frames below 40 degrees: error of the pose as a squared distance by RefinedPose::information, divided by
  /// its six dimensions, median. 1 if the information was right.
  double variance_factor = 0;
};
[[nodiscard]] RefinementTruth refinement_truth(const SpecularSequence& sequence,
                                               const std::vector<RefinedFrame>& frames);

/// Distance between two alignments at the middle of the texture, mm.
[[nodiscard]] double distance_mm(const specular::TextureAlignment& a, const specular::TextureAlignment& b);

}  // namespace lightwell::measure
