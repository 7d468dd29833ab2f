// Peer: "Real-Time Inverse Lighting for Augmented Reality Using a Dodecahedral Marker" (G. K. Straughn, Oklahoma State
// University, 2018), its chapter 3, as it is written: one light's direction from faces that are lit and faces that are
// not.
//   straughn_marker           the seed's files of sample points, made from a body file
//   straughn_face_pose        a tag's corners to the face's pose (the seed has that from ARToolkit)
//   straughn_sample           3.2.2 and 3.3: poses, visible faces, a luminance of each
//   straughn_light            3.4: lit and shadowed faces to a direction, an intensity and the ambient
//   straughn_best_threshold   the one threshold that is best for a whole set of frames
//
// Where the text is silent or can be read in two ways:
//   threshold      "Set ahead of time in the program's configuration files", no value. 0.5 is implied: the ambient is
//   capped at
//                  0.5 because a face above that is taken for lit. Comparisons take the best fixed one instead, which
//                  favours the seed.
//   visible face   "Cosine above a predetermined threshold", no value. 0.3: viewed straight, "six faces visible" at two
//   feet,
//                  the ring about the one in front at cosines of 0.38; turned, four at 0.5 and more and the next ones
//                  at 0.
//   view vector    Towards the eye, from the centre of the face.
//   perspective    "The normal is retrieved after the perspective matrix is applied to the pose so that it is
//   orthogonal to the
//                  face as it is perceived". A perspective matrix does not map normals to normals. By default the
//                  pose's own normal is taken, which is the face's in the camera's axes and the best that the sentence
//                  can mean. To the letter (StraughnOptions::Normals::letter) x and y of it are stretched by twice the focal
//                  length over the picture's size.
//   which face     P_DM = F_C F_DM^-1 "from one of the faces", not which: the one whose tag is largest in the picture.
//   sample points  How many there are and where is not said: one at the centroid of each of the deepest patches of each
//   quadrant. reference      "Color sample from a reference image of the marker": the patch's albedo by that of the
//   body's whitest,
//                  encoded as the camera's picture is.
//   faces alone    "Sides adjacent": only sides that were sampled have a luminance, so only those count.
//   to the light   The text says both "pointing to" the light and "in the direction that it is shining"; its vectors
//   point to it.
// What ARToolkit does is not repeated: bench/straughn2018_tags.hpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>

namespace lightwell::bench {

/// Rows from the top, bytes as they are: the seed linearises nothing.
struct StraughnPicture {
  int width = 0, height = 0;
  int channels = 3;  ///< 3: r, g, b; 1: grey.
  std::span<const std::uint8_t> data;
  std::size_t stride = 0;
};

/// A pinhole. Pixels as the house's: the centre of the top left one is (0, 0).
struct StraughnCamera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// How the bytes of the picture mean light, and with them those of the reference image.
enum class StraughnEncoding : std::uint8_t { linear, srgb };

struct StraughnPoint {
  FacePoint at;              ///< In the face's frame, m; the seed's -1 to 1 times half of its image's width.
  double max_luminance = 0;  ///< Eq. 3.13 of the reference image there.
};

struct StraughnFace {
  int tag_id = 0;
  Pose body_face;  ///< F_DM.
  std::vector<StraughnPoint> points;
  std::vector<std::size_t> adjacent;  ///< Faces that share an edge with it.
};

struct StraughnMarker {
  double tag_size_m = 0;
  std::vector<StraughnFace> faces;
};

/// `body` has passed validate(). Faces are adjacent whose normals are as near to each other as any two of the body's,
/// which is so of every regular body. Of a white body all points are white, of a grey one they lie in its four
/// quadrants.
[[nodiscard]] StraughnMarker straughn_marker(const MarkerBody& body, StraughnEncoding encoding, std::size_t points_per_quadrant = 2);

/// A tag's corners in the picture: bottom left, bottom right, top right, top left of the tag upright.
struct StraughnTag {
  int id = 0;
  std::array<FacePoint, 4> corners_px{};
};

struct StraughnOptions {
  enum class Normals : std::uint8_t { pose, letter };
  Normals normals = Normals::pose;
  double threshold = 0.5;  ///< A face of this average luminance or more is lit.
  double visible_cosine =
      0.3;                    ///< Of the angle between normal and view vector; only of faces whose tags were not found.
  double max_ambient = 0.5;  ///< Of a lowest luminance above this it is assumed that no unlit face is seen;
  double default_ambient = 0.3;  ///< the ambient is then this.
};

/// F_C of one face from its own tag, axes _cv (x right, y down, z forward); nothing where no pose fits. OpenCV's IPPE
/// for squares, the attitude of the smaller error.
[[nodiscard]] std::optional<Pose> straughn_face_pose(const StraughnTag& tag, const StraughnCamera& camera, double tag_size_m);

/// A face that was sampled.
struct StraughnView {
  std::size_t face = 0;  ///< In StraughnMarker::faces.
  bool direct = false;   ///< Its tag was found; otherwise it was projected.
  Vec3d normal_cv;       ///< Unit.
  double luminance = 0;  ///< Average over its points of luminance by maximum luminance.
};

/// Eq. 3.1 to 3.13. Nothing where no tag was found. A point outside of the picture is not viable, nor is a face without
/// points. Of a number that was found twice the larger tag counts.
[[nodiscard]] std::vector<StraughnView> straughn_sample(const StraughnPicture& picture, const StraughnCamera& camera, const StraughnMarker& marker,
                                            std::span<const StraughnTag> tags, const StraughnOptions& options = {});

struct StraughnLight {
  bool known = false;  ///< False where no face was seen, or where the vectors cancel.
  Vec3d direction;     ///< Towards the light, the camera's axes as the house has them (x right, y up, z back). Unit.
  double intensity = 0;
  double ambient = 0;
};

/// Section 3.4, with eq. 3.14.
[[nodiscard]] StraughnLight straughn_light(const StraughnMarker& marker, std::span<const StraughnView> seen, const StraughnOptions& options = {});

/// A frame of which the truth is known.
struct StraughnCase {
  const StraughnMarker* marker = nullptr;
  std::vector<StraughnView> seen;
  Vec3d truth;  ///< Towards the light, the camera's axes as the house has them.
};

struct StraughnThreshold {
  double threshold = 0;
  double mean_error_rad = 0;
};

/// Of 0, 1/256 ... 1, the threshold with the least mean error over all cases that have an answer; the middle one of
/// neighbours that are equally good. `options.threshold` is not read. Nothing where no case has an answer.
[[nodiscard]] std::optional<StraughnThreshold> straughn_best_threshold(std::span<const StraughnCase> cases, StraughnOptions options = {});

}  // namespace lightwell::bench
