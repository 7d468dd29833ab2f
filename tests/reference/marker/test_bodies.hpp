// Bodies defined by hand for tests: a cube with round numbers, and a ball above a card.
//   cube_by_hand, ball_by_hand
#pragma once

#include <cmath>

#include <lightwell/marker_body.hpp>

#include "reference/vector.hpp"

namespace lightwell::reference {

/// A cube centred at the origin. Faces 0 to 3 have normals +Z, +X, -Z, -X and tags upright along +Y; 4 is the top, 5
/// the bottom. Each has a tag of three fifths of the edge, with patches of albedo 0.5 and (0.6, 0.4, 0.2) right and
/// left of it.
inline MarkerBody cube_by_hand(double edge_m = 0.06) {
  MarkerBody body;
  body.name = "cube by hand";
  body.tag_size_m = 0.6 * edge_m;
  const double h = edge_m / 2, rim = 0.75 * h;
  const double quarter = std::sqrt(0.5);
  const Quat turns[6] = {{0, 0, 0, 1},
                         {0, quarter, 0, quarter},
                         {0, 1, 0, 0},
                         {0, -quarter, 0, quarter},
                         {-quarter, 0, 0, quarter},
                         {quarter, 0, 0, quarter}};
  for (int i = 0; i < 6; ++i) {
    MarkerFace face;
    face.tag_id = i;
    face.body_face = {turns[i], rotate(turns[i], Vec3d{0, 0, h})};
    face.outline = {{-h, -h}, {h, -h}, {h, h}, {-h, h}};
    face.patches = {{{{rim, -h}, {h, -h}, {h, h}, {rim, h}}, {0.5, 0.5, 0.5}},
                    {{{-h, -h}, {-rim, -h}, {-rim, h}, {-h, h}}, {0.6, 0.4, 0.2}}};
    body.faces.push_back(face);
  }
  return body;
}

/// A card of 200 mm in the plane y = 0 facing up, with a tag at its centre and a ball of radius 20 mm on it at x =
/// 0.06.
inline MarkerBody ball_by_hand() {
  MarkerBody body;
  body.name = "ball by hand";
  body.tag_size_m = 0.04;
  const double quarter = std::sqrt(0.5);
  MarkerFace face;
  face.body_face = {{-quarter, 0, 0, quarter}, {}};
  face.outline = {{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}};
  body.faces.push_back(face);
  body.ball = MarkerBall{{0.06, 0.02, 0}, 0.02, {0.7, 0.7, 0.7}};
  return body;
}

}  // namespace lightwell::reference
