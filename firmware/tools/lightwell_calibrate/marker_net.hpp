// The net (unfolding) of a paper body: connected faces on each page, folds, and glue tabs.
//
// Sheet coordinates as in sheets.hpp: mm from the top left, y downwards. Rotations are counter-clockwise, seen from the
// printed side.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "tools/lightwell_calibrate/sheets.hpp"

namespace lightwell::calibrate {

/// Two faces (indices of MarkerBody::faces) and their common edge. Edge i is from point i of the outline to the next.
struct SharedEdge {
  std::size_t a = 0, edge_a = 0;
  std::size_t b = 0, edge_b = 0;
};

/// All pairs of edges of two faces that coincide in space, within a micrometre.
[[nodiscard]] std::vector<SharedEdge> shared_edges(const MarkerBody& body);

/// A face on a sheet: position of the tag's centre, and rotation from upright.
struct NetFace {
  std::size_t face = 0;
  PagePoint center;
  double turn_rad = 0;

  /// Maps a point of the face's frame, m, to the sheet, mm.
  [[nodiscard]] PagePoint on_sheet(FacePoint p) const;
};

/// A fold between two faces of a sheet.
struct NetFold {
  std::size_t a = 0, b = 0;
  PagePoint from, to;
};

/// A tab of the face `on` that is glued beneath the face `under`.
struct NetTab {
  std::size_t on = 0, under = 0;
  std::vector<PagePoint> outline;  ///< Its first and last point are the ends of the edge.
};

/// What lies on a sheet.
struct NetParts {
  std::vector<NetFace> faces;
  std::vector<NetFold> folds;
  std::vector<NetTab> tabs;
  /// Edges of faces that are cut and have no tab.
  std::vector<std::array<PagePoint, 2>> cuts;
};

struct NetPage : NetParts {
  double width = 0, height = 0;
  bool landscape = false;
};

struct Net {
  std::vector<NetPage> pages;
};

/// Height of the space below the net for text and ruler, mm.
inline constexpr double kNetFooter = 31;

/// The net with the fewest pieces that fit: a cube in one or two, other solids in an upper and a lower half, otherwise
/// single faces. Each edge is a fold or has one tab. Pieces on a page do not touch. invalid_argument: not even a single
/// face fits.
[[nodiscard]] Result<Net> make_net(const MarkerBody& body, const Paper& paper);

/// The largest factor by which the body can be scaled so that it still fits, rounded down to a thousandth.
[[nodiscard]] double largest_scale(const MarkerBody& body, const Paper& paper);

/// The picture value, 0 to 1, that prints an albedo on paper of kPaperAlbedo: the sRGB encoding of their ratio.
[[nodiscard]] double printed_grey(double albedo);

/// One page for each page of the net. Cut lines are solid, fold lines dashed, both 0.15 mm wide, centred on the edge.
/// The white rim below and to the left of a tag has the number of the face, a tab that of the face above it; both are
/// tag ids. invalid_argument: a family or a tag that does not exist.
[[nodiscard]] Result<std::vector<Page>> draw_net(const MarkerBody& body, const Net& net);

}  // namespace lightwell::calibrate
