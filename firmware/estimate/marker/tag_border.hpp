// Whether a face is really what the lens sees where it should be: its tag's black ring lies in a white rim.
//   detect_tag_border
#pragma once

#include <cstdint>

#include <lightwell/marker_body.hpp>

#include "estimate/common/row_reader.hpp"
#include "estimate/marker/marker_geometry.hpp"

namespace lightwell::marker {

enum class TagBorder : std::uint8_t {
  present,
  absent,      ///< Another object is before the face, or the body is another one.
  indeterminate,  ///< Too small, too dark, saturated, out of the picture, or a family whose ring is not known.
};

/// The reader is bound. `row`: of any width.
[[nodiscard]] TagBorder detect_tag_border(estimate::RowReader& reader, estimate::LinearRow& row, int lens, int width, int height,
                                 const MarkerBody& body, const MarkerFace& face, const PosedBody& placed);

}  // namespace lightwell::marker
