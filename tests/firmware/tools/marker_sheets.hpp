// Bodies and nets for the tests of marker-sheet.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "firmware/tools/printed_tags.hpp"
#include "pose/marker_bodies.hpp"
#include "pose/tag_board.hpp"
#include "tools/lightwell_calibrate/marker_net.hpp"

namespace lightwell::test {

inline MarkerBody marker_body(const std::string& solid, double size_m, PaperKind paper = PaperKind::grey,
                              TagFamily family = TagFamily::tag36h11, int first_id = 0) {
  const SolidOptions options{size_m, paper, family, first_id, 0};
  const Result<MarkerBody> body = solid == "cube"          ? make_cube(options)
                                  : solid == "icosahedron" ? make_icosahedron(options)
                                                           : make_dodecahedron(options);
  EXPECT_TRUE(body.ok()) << body.status().message();
  return *body;
}

/// Largest distance of a detected tag corner from its position in the net, mm. Expects exactly the tags of the page.
inline double worst_printed(const std::string& picture, const MarkerBody& body, const calibrate::NetPage& page,
                            double dpi) {
  const auto tags = printed_tags(picture, *parse_tag_family(body.tag_family), dpi);
  EXPECT_EQ(tags.size(), page.faces.size());
  double worst = 0;
  for (const calibrate::NetFace& placed : page.faces) {
    const auto found = tags.find(body.faces[placed.face].tag_id);
    if (found == tags.end()) {
      ADD_FAILURE() << "tag " << body.faces[placed.face].tag_id << " is not on its page";
      continue;
    }
    const auto corners = tag_corners(body.tag_size_m);
    const double c = std::cos(placed.turn_rad), s = std::sin(placed.turn_rad);
    for (std::size_t k = 0; k < 4; ++k) {
      const double x = placed.center.x + 1000 * (c * corners[k].x - s * corners[k].y);
      const double y = placed.center.y - 1000 * (s * corners[k].x + c * corners[k].y);
      worst = std::max(worst, std::hypot(found->second[k].x - x, found->second[k].y - y));
    }
  }
  return worst;
}

}  // namespace lightwell::test
