// Whether a face of the body is seen where the pose predicts it: the black border of its tag.
#pragma once

#include <cstdint>

#include <lightwell/marker_body.hpp>

#include "estimate/frames/row_reader.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

enum class TagBorder : std::uint8_t {
  present,
  absent,         ///< Another object occludes the face, or it is another body.
  indeterminate,  ///< Too small, too dark, saturated, outside of the image, or a tag family other than tag36h11.
};

/// Verifies that a face is visible where the pose predicts it, to 0.4 cells of its tag (folds, errors of the pose): the
/// tag's black border lies inside a white margin.
/// `reader` must be bound to the frame. `row`: a buffer of any width.
[[nodiscard]] TagBorder detect_tag_border(estimate::RowReader& reader, estimate::LinearRow& row, int lens, int width,
                                          int height, const MarkerBody& body, const MarkerFace& face,
                                          const PosedBody& posed_body);

}  // namespace lightwell::marker
