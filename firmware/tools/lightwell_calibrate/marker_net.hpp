// A body of paper laid flat: which faces hang together on which page, where to fold, and where tabs are glued.
//   shared_edges   which faces of a body meet where
//   make_net       the body on sheets of one kind of paper
//
// A sheet's millimetres are page.hpp's: from the top left, y downwards. Turns are counter-clockwise as one looks at the
// print.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "tools/lightwell_calibrate/sheet_parts.hpp"

namespace lightwell::calibrate {

/// Edge i of a face is from point i of its outline to the next. Faces by their place in MarkerBody::faces.
struct SharedEdge {
  std::size_t a = 0, edge_a = 0;
  std::size_t b = 0, edge_b = 0;
};

/// Pairs of edges of two faces that are the same in space, to a micrometre.
[[nodiscard]] std::vector<SharedEdge> shared_edges(const MarkerBody& body);

/// A face on a sheet: the tag's centre, and how far it is turned from upright.
struct NetFace {
  std::size_t face = 0;
  PagePoint center;
  double turn_rad = 0;

  /// A point of the face's frame, m, on the sheet.
  [[nodiscard]] PagePoint on_sheet(FacePoint p) const;
};

/// Where two faces of a sheet hang together.
struct NetFold {
  std::size_t a = 0, b = 0;
  PagePoint from, to;
};

/// A tab hangs on one face and is glued beneath another, whose edge the fold then is.
struct NetTab {
  std::size_t on = 0, under = 0;
  std::vector<PagePoint> outline;  ///< Its first and last point are those of the edge.
};

struct NetPage {
  double width = 0, height = 0;
  bool landscape = false;
  std::vector<NetFace> faces;
  std::vector<NetFold> folds;
  std::vector<NetTab> tabs;
  /// Edges of faces to be cut that bear no tab.
  std::vector<std::array<PagePoint, 2>> cuts;
};

struct Net {
  std::vector<NetPage> pages;
};

/// Below the net, for words and ruler, mm.
inline constexpr double kNetFooter = 31;

/// The body in as few pieces as fit: a cube in one or two, others with an upper and a lower half, at last each face by
/// itself. Each edge is a fold, or cut with one tab. Pieces of a page do not touch. invalid_argument where not even one
/// face fits.
[[nodiscard]] Result<Net> make_net(const MarkerBody& body, const Paper& paper);

/// The largest number by which all lengths of the body may be multiplied and still fit, to a thousandth, downwards.
[[nodiscard]] double largest_scale(const MarkerBody& body, const Paper& paper);

}  // namespace lightwell::calibrate
