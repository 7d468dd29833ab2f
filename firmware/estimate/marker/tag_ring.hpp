// Whether a face is really what the lens sees where it should be: its tag's black ring lies in a white rim.
//   look_for_ring
#pragma once

#include <cstdint>

#include <lightwell/marker_body.hpp>

#include "estimate/common/row_reader.hpp"
#include "estimate/marker/marker_geometry.hpp"

namespace lightwell::marker {

enum class Ring : std::uint8_t {
  there,
  missing,      ///< Another object is before the face, or the body is another one.
  cannot_tell,  ///< Too small, too dark, saturated, out of the picture, or a family whose ring is not known.
};

/// The reader is bound. `row`: of any width.
[[nodiscard]] Ring look_for_ring(estimate::RowReader& reader, estimate::LinearRow& row, int lens, int width, int height,
                                 const MarkerBody& body, const MarkerFace& face, const PlacedBody& placed);

}  // namespace lightwell::marker
