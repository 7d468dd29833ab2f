// Pictures of a marker that are hard, or no pictures of it at all, and what an answer to them is worth.
//   ExtremeCase, extreme_cases     what the camera sees, and what the estimator believes of camera and body
//   ExtremePicture                 one case, rendered once; noisy frames of it
//   judge_extreme                  refused, flagged, right, or wrong
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

/// What is done to a frame's bytes or floats before the estimator gets it.
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
  /// Of the lamp in each of successive frames; the camera does not know.
  std::vector<double> brightness{1};
  Harm harm = Harm::none;
  double believed_focal = 1;                ///< Of the calibration, in the true focal length.
  std::optional<MarkerBody> believed_body;  ///< Where it is not the scene's.
  /// Nothing keeps this picture from being answered well: flagged is not good enough.
  bool easy = false;
  /// Answered wrong as yet: figures show it, tests ask of it no more than numbers that are numbers.
  bool unsolved = false;
};

/// All of them. `bodies_folder`: firmware/estimate/marker/bodies. Throws std::runtime_error where a body cannot be
/// read.
[[nodiscard]] std::vector<ExtremeCase> extreme_cases(const std::string& bodies_folder);

enum class Outcome : std::uint8_t { refused, flagged, right, wrong };
[[nodiscard]] const char* name_of(Outcome outcome);

struct Evaluation {
  Outcome outcome = Outcome::refused;
  std::string why;                      ///< The refusal's message, the flags, or what is wrong.
  std::optional<Vec3d> direction;       ///< Of the strongest light that was answered.
  double error_deg = 0, sigma_deg = 0;  ///< Of it, where there is one; sigma along the error.
  double deviations2 = 0;               ///< The error's squared Mahalanobis distance (two numbers).
  MarkerReport report;                  ///< What the answer was made from.
};

class ExtremePicture {
 public:
  explicit ExtremePicture(ExtremeCase what);

  [[nodiscard]] const ExtremeCase& what() const { return case_; }
  /// Finder and estimator made anew, then all frames of the sequence, each judged. `seed`: another one is other noise.
  [[nodiscard]] std::vector<Evaluation> judged(std::uint64_t seed) const;
  /// The worst of them: wrong before right before flagged before refused, then the larger error.
  [[nodiscard]] Evaluation worst(std::uint64_t seed) const;

 private:
  ExtremeCase case_;
  RigParameters rig_;
  measure::LensRadiance radiance_;
  double exposure_ = 1;
  Vec3d truth_;
};

/// Refused: not_found or invalid_argument, with a message. Flagged: unsure or dark; or clipped and within three of its
/// deviations. Right: no such flag, the strongest light within three of its deviations of `truth` and within 10
/// degrees. Wrong: all else, another error, a number that is not finite, and what the wire does not take.
[[nodiscard]] Evaluation judge_extreme(const Status& status, const Descriptor& made, Vec3d truth);

}  // namespace lightwell::marker::test
