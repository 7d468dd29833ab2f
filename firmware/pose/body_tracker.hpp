// Pose of a body with tags on it, from the corners of all its tags together: the method of mounting.hpp, with the body
// frame as the world frame and T_body_face as the poses of the tags.
//
// Tracks a body through a sequence of pictures: searches the predicted region of each picture for its tags. Each call
// allocates memory: in AprilTag, in Ceres and here.
//
//   picture ──> predicted region ──AprilTag, once──> tags ──> find_body_pose ──> pose
//                   ^   the whole picture without a prediction                     │
//                   └──────── BodyMotion: time, velocity, covariance <─────────────┘
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "pose/grey_view.hpp"
#include "pose/mounting.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {

/// The tags of the body, in the body frame. invalid_argument: an unknown tag family.
[[nodiscard]] Result<std::vector<WorldTag>> tags_of(const MarkerBody& body);

/// A prior pose: saves the search for a start, and resolves the ambiguity of a planar target.
struct BodyPrediction {
  UncertainPose probe_body;  ///< Finite covariance.
  /// False if the last pose was ambiguous: then the prediction does not resolve an ambiguity.
  bool attitude_known = true;
};

/// Errors that are the same in every frame: they are part of the pose's covariance, but do not weight the corners.
struct BodyPoseOptions : MountingOptions {
  /// Relative standard deviation of the calibrated focal length.
  double focal_sigma = 0.01;
  /// Standard deviations of a folded and glued body's faces from their places, about and along each axis of a face.
  /// Larger errors show in chi², which multiplies them, except where a single tag is seen.
  double face_turn_sigma_rad = 0.009, face_shift_sigma_m = 0.25e-3;

  [[nodiscard]] Status validate() const;
};

/// The prediction, too, may decide between probe_body and `alternative`.
/// `chi_square` is that of the corners' noise alone. The covariance is multiplied by the ratio of the squared residuals
/// to those that noise and the faces' errors let expect, where it is above 1.
struct BodyPose : PoseFit {
  UncertainPose probe_body;
  int used = 0;  ///< Number of tags used.
  /// Median of TagDetection::blur_px over the tags used; nullopt: measured on none.
  std::optional<double> blur_px;
  /// Derivative of the six parameters of probe_body with respect to the relative focal length error (rad and m per
  /// 100 %). The covariance contains it, scaled with focal_sigma; it is common to all frames with a similar view.
  std::array<double, 6> focal_jacobian{};
  /// The part of the covariance that is due to the faces' errors; common to all frames with a similar view.
  PoseCovariance face_covariance{};
};

/// `rig` (a RigParameters converts, see PosedLenses) and `body` have passed validate(). The same tag id may be observed
/// several times. Rejected, with the reason in `tags`: an id that the body does not have; a tag that is on edge,
/// mirrored, outside the field of view, or facing away in the result; an outlier (partly occluded, or on another body).
/// not_found: no tag of the body is left. failed_precondition: no majority of the tags agrees on a pose and the
/// prediction does not decide; the corners determine no pose. invalid_argument: NaN, a covariance that is not positive
/// definite, a lens that the rig does not have, options that do not validate.
[[nodiscard]] Result<BodyPose> find_body_pose(const PosedLenses& rig, const MarkerBody& body,
                                              std::span<const TagObservation> observations,
                                              const std::optional<BodyPrediction>& prediction = std::nullopt,
                                              const BodyPoseOptions& options = {});

struct BodyTrackerOptions {
  BodyPoseOptions pose;
  /// Decimation of a search of the whole picture, 1 to 8: 1.5 takes half of the time and misses tags below 20 px. With
  /// 1, a picture in which nothing is found is also searched enlarged and by its logarithm: the first one without the
  /// body and every eighth after it.
  double search_decimate = 1;
  /// Decimation in the predicted region, 1 to 8; 0: chosen from the predicted size of the tags.
  double decimate = 0;
  /// Number of pictures without the body after which the prediction is discarded, 1 to 1,000.
  int lost_after = 5;
  CornerRefinement corners = CornerRefinement::edge_search;
  /// As TagDetectorOptions::linear; needed where the picture is encoded (sRGB).
  std::vector<float> linear;

  [[nodiscard]] Status validate() const;
};

struct BodyObservation {
  std::optional<BodyPose> pose;
  std::string failure_reason;      ///< Why there is no pose; empty otherwise.
  std::vector<TagDetection> tags;  ///< All detected tags, of the body or not, in pixels of the whole picture.
  bool predicted = false;          ///< Whether only the predicted region was searched.
  PixelRegion region;              ///< The region that was searched.
  double decimate = 1;             ///< DetectionWindow::decimate of the search.
  int min_contrast = 5;            ///< Contrast threshold of the search, from contrast_above_noise().
};

/// Not thread-safe: one call at a time. Movable.
class BodyTracker {
 public:
  /// invalid_argument: `body`, `rig` or `options` do not validate.
  [[nodiscard]] static Result<BodyTracker> make(const MarkerBody& body, const RigParameters& rig,
                                                const BodyTrackerOptions& options = {});
  BodyTracker(BodyTracker&&) noexcept;
  BodyTracker& operator=(BodyTracker&&) noexcept;
  ~BodyTracker();

  /// Searches the predicted region if the last picture of this lens showed the body, otherwise the whole picture. A
  /// picture without the body is no error. A time before the last one restarts the motion filter.
  /// invalid_argument: a picture that does not validate or does not have the lens's size, a lens that the rig does not
  /// have.
  [[nodiscard]] Result<BodyObservation> track(const GreyPicture& picture, ProbeTime mid_exposure, int lens = 0);
  /// Changes the options of these names, in the same ranges; the prediction is kept.
  void set_decimation(double search_decimate, double decimate);
  /// Discards the prediction: the next picture is searched as a whole.
  void reset();

 private:
  struct Impl;
  explicit BodyTracker(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
