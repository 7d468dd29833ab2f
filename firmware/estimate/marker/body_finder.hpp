// Where the body is, as a value: what the estimator asks of whoever knows AprilTags.
#pragma once

#include <optional>

#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "camera/frame.hpp"

namespace lightwell {

struct DetectedBody {
  UncertainPose probe_body;  ///< T_probe_body.
  int tags = 0;              ///< That agree with it.
  bool ambiguous = false;    ///< Another attitude explains the tags nearly as well.
};

/// By how much pictures are decimated before tags are detected.
struct FinderDecimation {
  double searched = 1.5;  ///< Of the whole picture, 1 to 8.
  double followed = 0;    ///< Of the part where the body is expected, 1 to 8; 0: from the size of the tags.
};

/// Hypothesis of every picture in the order of time. One thread.
class BodyFinder {
 public:
  virtual ~BodyFinder() = default;

  /// Takes effect with the next picture. Values are in their ranges.
  virtual void set_decimation(const FinderDecimation& decimation) = 0;

  /// Nothing where the body is not in the picture. invalid_argument: a picture that cannot be read.
  [[nodiscard]] virtual Result<std::optional<DetectedBody>> find(const View& view, const FrameInfo& info) = 0;
};

}  // namespace lightwell
