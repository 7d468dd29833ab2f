// Methods that estimate a light from frames of a marker, behind one interface. Results are read after all frames,
// because the thresholds of published methods are chosen over all of them.
//   MarkerMethod           the interface
//   make_straughn_method   bench/straughn2018 with lightwell's tag detector
//   make_arief_method      bench/arief2012 with the body's pose by lightwell's tracker
//   make_estimator_method  lightwelld's estimator
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "measure/traced_frames.hpp"

namespace lightwell::measure {

struct MarkerAnswer {
  bool given = false;    ///< Whether a light was estimated.
  bool flagged = false;  ///< Whether the method flags the estimate as unreliable.
  Vec3d direction;       ///< From the body's centre towards the strongest light, probe frame.
};

/// One answer per frame, in the order of process().
struct MarkerColumn {
  std::string name;
  std::vector<MarkerAnswer> answers;
  double setting = 0;  ///< The value chosen over all frames, for methods that have one; otherwise 0.
};

class MarkerMethod {
 public:
  virtual ~MarkerMethod() = default;

  /// `shot` holds one frame of `rig`, which shows `body`. Shots of one image are consecutive, 1/30 s apart; times of
  /// different images are unrelated. A setting may only be chosen over frames of the group "grid".
  [[nodiscard]] virtual Status process(const TracedFrame& frame, const RigParameters& rig, const MarkerBody& body,
                                       const Shot& shot) = 0;
  [[nodiscard]] virtual std::vector<MarkerColumn> columns() const = 0;
};

/// Columns, all with the same tag detections:
///   seed           the single threshold that is best for the grid
///   seed_letter    the same with the perspective matrix as printed in the thesis
///   seed_half      a threshold of 0.5, which the text implies
///   seed_each      the best threshold for each frame, which needs the truth: a lower limit of the error
[[nodiscard]] Result<std::unique_ptr<MarkerMethod>> make_straughn_method(bool srgb);

/// Columns, all with the same poses; no answer where no shadow is found:
///   arief        light by the shadow's contour, the single threshold that is best for the grid
///   arief_line   the same by the shadow's line and tip
///   arief_each   `arief` with the best threshold for each frame, which needs the truth: a lower limit of the error
/// Of a TracedFrame, group and the first lamp's direction are used, to choose thresholds.
[[nodiscard]] std::unique_ptr<MarkerMethod> make_arief_method();

/// One column, "ours"; flagged if the descriptor has Flag::unsure.
[[nodiscard]] std::unique_ptr<MarkerMethod> make_estimator_method();

}  // namespace lightwell::measure
