// Draws the result picture of the demo of a glossy book.
#pragma once

#include <string>

#include "report/book_evaluation.hpp"

namespace lightwell::hil {

/// Writes an 8-bit sRGB PNG. First row: two frames of the camera; the directions from which the plane was seen, as the
/// paper's disc; the captured specular radiance by viewing direction beside the true one. Second row: a held-out view,
/// the SDK's drawing, their difference. Third row: the light above the plane, found and true; virtual balls lit by
/// both. The message of a failure names the file.
[[nodiscard]] Status draw_book_report(const std::string& path, const measure::SpecularSequence& sequence,
                                      const PlaneAppearance& plane, const Lighting& light,
                                      const BookEvaluation& evaluation);

}  // namespace lightwell::hil
