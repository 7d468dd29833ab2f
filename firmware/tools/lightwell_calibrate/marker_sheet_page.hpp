// Draws the pages of a body's net: greys, tags, lines, numbers, text and a ruler.
#pragma once

#include <vector>

#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "tools/lightwell_calibrate/marker_net.hpp"

namespace lightwell::calibrate {

/// The picture value, 0 to 1, that prints an albedo on paper of kPaperAlbedo: the sRGB encoding of their ratio.
[[nodiscard]] double printed_grey(double albedo);

/// One page for each page of the net. Cut lines are solid, fold lines dashed, both 0.15 mm wide, centred on the edge.
/// The white rim below and to the left of a tag has the number of the face, a tab that of the face above it; both are
/// tag ids. invalid_argument: a family or a tag that does not exist.
[[nodiscard]] Result<std::vector<Page>> draw_net(const MarkerBody& body, const Net& net);

}  // namespace lightwell::calibrate
