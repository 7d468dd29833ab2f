// Interface to the tag detector: what an estimator needs to know of a body with tags in a frame. The application
// connects it with pose.
#pragma once

#include <optional>

#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "imaging/frame.hpp"

namespace lightwell {

struct DetectedBody {
  UncertainPose probe_body;  ///< T_probe_body.
  int tags = 0;              ///< Number of tags that agree with the pose.
  bool ambiguous = false;    ///< Another attitude explains the tags nearly as well.
  /// Standard deviation of the image's blur at the tags' edges, px; nullopt: not measured, taken as sharp.
  std::optional<double> blur_px;
};

/// Decimation of the image before tags are detected.
struct FinderDecimation {
  double full_search = 1.5;  ///< Of the whole image, 1 to 8.
  double tracked = 0;        ///< Of the part where the body is expected, 1 to 8; 0: depends on the size of the tags.
};

/// Interface to the tag detector: finds the body's pose in a frame. Takes all frames, in order. Not thread-safe.
class BodyFinder {
 public:
  virtual ~BodyFinder() = default;

  /// Takes effect with the next frame. The values must be in range.
  virtual void set_decimation(const FinderDecimation& decimation) = 0;

  /// nullopt where the body is not in the image. Returns invalid_argument where the frame cannot be read.
  [[nodiscard]] virtual Result<std::optional<DetectedBody>> find(const View& view, const FrameInfo& info) = 0;
};

}  // namespace lightwell
