// Who finds light in frames of a marker, side by side: each looks at every frame once and answers afterwards, because
// the seed's one threshold is chosen over all of them.
//   MarkerMethod       the interface
//   make_straughn_method       bench/s1_dodecahedron with our tag detector
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
  bool given = false;    ///< Whether a light was answered.
  bool flagged = false;  ///< Whether the answer says of itself that it is not to be trusted.
  Vec3d direction;       ///< Towards the strongest light from the body's centre, probe's frame.
};

/// One answer a frame, in the order of look().
struct MarkerColumn {
  std::string name;
  std::vector<MarkerAnswer> answers;
  double setting = 0;  ///< What was chosen over all frames, where the method has that; else 0.
};

class MarkerMethod {
 public:
  virtual ~MarkerMethod() = default;

  /// `shot` holds one frame of `rig`, which sees `body`. Shots of one picture come in a row, 1/30 s apart; of the next
  /// picture's time nothing is said. Frames whose group is "grid" are those that a setting may be chosen over.
  [[nodiscard]] virtual Status process(const TracedFrame& frame, const RigParameters& rig, const MarkerBody& body,
                                    const Shot& shot) = 0;
  [[nodiscard]] virtual std::vector<MarkerColumn> columns() const = 0;
};

/// Columns, all of the same tags:
///   seed           the one threshold that is best for the grid
///   seed_letter    the same with its perspective matrix to the letter
///   seed_half      a threshold of 0.5, which the text implies
///   seed_each      for every frame the threshold that is best for it, which nobody can know: a lower limit
[[nodiscard]] Result<std::unique_ptr<MarkerMethod>> make_straughn_method(bool srgb);

/// One column, ours: flagged where the descriptor says unsure.
[[nodiscard]] std::unique_ptr<MarkerMethod> make_estimator_method();

}  // namespace lightwell::measure
