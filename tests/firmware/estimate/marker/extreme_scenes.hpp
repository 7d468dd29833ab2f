// Difficult or invalid images of a marker, and the evaluation of the estimator's results on them.
//   ExtremeCase, extreme_cases     scene and camera, and the estimator's assumptions about camera and body
//   ExtremePicture                 one case, rendered once; noisy frames of it
//   evaluate_extreme               refused, flagged, right, or wrong
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/marker_body.hpp>

#include "estimate/marker/marker_estimator.hpp"
#include "measure/shots.hpp"
#include "reference/marker/marker_picture.hpp"
#include "reference/marker/marker_scene.hpp"

namespace lightwell::marker::test {

/// Damage to a frame's bytes or floats before the estimator receives it.
enum class Harm : std::uint8_t { none, mirrored, noise_alone, some_not_numbers, all_not_numbers };

struct ExtremeCase {
  std::string name;
  reference::MarkerScene scene;  ///< One lamp.
  int width = 640, height = 480;
  double focal_px = 700;
  double blur_px = 0.5;
  PixelFormat format = PixelFormat::rgb8;
  /// 1: the picture's brightest pixel is at 0.8 of full scale. Several: a bracket.
  std::vector<double> exposures{1};
  /// Relative power of the lamp in successive frames; exposure is not adapted to it.
  std::vector<double> brightness{1};
  Harm harm = Harm::none;
  double believed_focal = 1;                ///< Focal length of the estimator's calibration / true focal length.
  std::optional<MarkerBody> believed_body;  ///< Body given to the estimator, where it differs from the scene's.
  /// The result must be right; `flagged` is a failure.
  bool easy = false;
};

/// All cases. `bodies_folder`: firmware/estimate/marker/bodies. Throws std::runtime_error where a body cannot be read.
[[nodiscard]] std::vector<ExtremeCase> extreme_cases(const std::string& bodies_folder);

enum class Outcome : std::uint8_t { refused, flagged, right, wrong };
[[nodiscard]] const char* name_of(Outcome outcome);

struct Evaluation {
  Outcome outcome = Outcome::refused;
  std::string why;                      ///< The error message, the flags, or the reason for `wrong`.
  std::optional<Vec3d> direction;       ///< Of the strongest estimated light.
  double error_deg = 0, sigma_deg = 0;  ///< Of that light; sigma along the error.
  double squared_mahalanobis = 0;       ///< Of the error; two degrees of freedom.
  Descriptor descriptor;                ///< The estimator's descriptor and report.
  MarkerReport report;
};

class ExtremePicture {
 public:
  explicit ExtremePicture(ExtremeCase what);

  [[nodiscard]] const ExtremeCase& what() const { return case_; }
  /// Creates a finder and an estimator, and evaluates all frames of the sequence. `seed`: of the noise.
  [[nodiscard]] std::vector<Evaluation> evaluate_frames(std::uint64_t seed) const;
  /// The worst evaluation of a frame, in the order wrong, right, flagged, refused; then the larger error.
  [[nodiscard]] Evaluation worst(std::uint64_t seed) const;

 private:
  ExtremeCase case_;
  RigParameters rig_;
  measure::LensRadiance radiance_;
  double exposure_ = 1;
  Vec3d truth_;
};

/// Refused: not_found or invalid_argument, with a message. Flagged: unsure or dark; or clipped, with an error within
/// three sigma. Right: no such flag, the strongest light within three sigma and 10 degrees of `truth`. Wrong:
/// everything else, including other errors, numbers that are not finite, and descriptors that cannot be encoded.
[[nodiscard]] Evaluation evaluate_extreme(const Status& status, const Descriptor& made, Vec3d truth);

}  // namespace lightwell::marker::test
