// The pages of a body to print, cut and fold, drawn: greys, tags, lines, numbers, words and a ruler.
#pragma once

#include <vector>

#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "tools/lightwell_calibrate/marker_net.hpp"

namespace lightwell::calibrate {

/// The picture value that a printer is given for an albedo on paper of kPaperAlbedo: sRGB of their ratio.
[[nodiscard]] double printed_grey(double albedo);

/// One page of paper for each of the net's. Cut lines are solid, fold lines dashed, both 0.15 mm around the true edge.
/// A face's number stands in the white rim below and to the left of its tag, a tab bears the number of the face that it
/// is glued beneath: both are tag numbers. invalid_argument: a family or a tag that does not exist.
[[nodiscard]] Result<std::vector<Page>> draw_net(const MarkerBody& body, const Net& net);

}  // namespace lightwell::calibrate
