// A body in a stream of pictures: where it is in each, found where it is expected.
//
//   picture ──> the part where the body should be ──AprilTag, once──> tags ──> find_body_pose ──> pose
//                      ^   all of it, where nothing is expected                        │
//                      └────────────── BodyMotion: time, velocity, doubt <─────────────┘
//
// AprilTag allocates memory in each call, and so do Ceres and this.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "pose/body_motion.hpp"
#include "pose/body_pose.hpp"
#include "pose/grey_picture.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {

struct BodyTrackerOptions {
  BodyPoseOptions pose;
  MotionOptions motion;
  /// How much smaller the whole picture is made when it is searched, 1 to 8: 2 takes two thirds of the time and loses
  /// tags below 20 px.
  double search_decimate = 1.5;
  /// The same in the predicted part; 0: from how large the tags should be.
  double decimate = 0;
  /// After so many pictures without it the body is lost: nothing is expected any more.
  int lost_after = 5;
  /// What becomes of corners: see CornerRefinement.
  CornerRefinement corners = CornerRefinement::edge_search;
  /// As TagDetectorOptions::linear: give it where the picture is encoded (sRGB).
  std::vector<float> linear;

  [[nodiscard]] Status validate() const;
};

struct BodyObservation {
  std::optional<BodyPose> pose;
  std::string failure_reason;             ///< Where there is none.
  std::vector<TagDetection> tags;  ///< All that were found, of the body or not, in pixels of the whole picture.
  bool predicted = false;          ///< Whether only a part of the picture was looked at, where the body was expected.
  PixelRegion region;              ///< The part that was looked at.
  double decimate = 1;             ///< How much smaller it was made.
  int min_contrast = 5;          ///< What was taken for noise, see contrast_above_noise().
};

/// Not thread-safe: one call at a time. Movable.
class BodyTracker {
 public:
  /// invalid_argument: a body, a rig or options that do not validate.
  [[nodiscard]] static Result<BodyTracker> make(const MarkerBody& body, const RigParameters& rig,
                                                const BodyTrackerOptions& options = {});
  BodyTracker(BodyTracker&&) noexcept;
  BodyTracker& operator=(BodyTracker&&) noexcept;
  ~BodyTracker();

  /// A picture that does not show the body is no error. The predicted part is looked at where the last picture of this
  /// lens showed it; all of the picture otherwise. Times that go back are taken for a new beginning.
  /// invalid_argument: a picture that does not validate or is not of the lens's size, a lens that the rig does not
  /// have.
  [[nodiscard]] Result<BodyObservation> track(const GreyPicture& picture, ProbeTime mid_exposure, int lens = 0);
  /// As the options of these names, in their ranges; what is followed stays so.
  void set_decimation(double search_decimate, double decimate);
  /// Nothing is expected any more.
  void reset();

 private:
  struct Impl;
  explicit BodyTracker(std::unique_ptr<Impl> inside);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
