// Peer: "Real-Time Inverse Lighting for Augmented Reality Using a Dodecahedral Marker" (G. K. Straughn, Oklahoma State
// University, 2018; "the thesis" below), chapter 3: the direction of one light from lit and unlit faces.
//   straughn_marker           the thesis's files of sample points, made from a body file
//   straughn_face_pose        pose of a face from the corners of its tag (ARToolkit in the thesis)
//   straughn_sample           3.2.2 and 3.3: poses, visible faces, the luminance of each
//   straughn_light            3.4: direction, intensity and ambient from lit and shadowed faces
//   straughn_best_threshold   the single threshold that is best for a set of frames
//
// Choices where the text is silent or ambiguous:
//   threshold      "Set ahead of time in the program's configuration files", no value. 0.5 is implied: the ambient is
//                  capped at 0.5 because a face above that is considered lit. Comparisons use the best fixed threshold
//                  instead, which favours the thesis.
//   visible face   "Cosine above a predetermined threshold", no value. 0.3, from "six faces visible" at two feet:
//                  viewed straight, the ring around the front face has cosines of 0.38; turned, four faces have 0.5 or
//                  more and the next ones 0.
//   view vector    From the centre of the face towards the camera.
//   perspective    "The normal is retrieved after the perspective matrix is applied to the pose so that it is
//                  orthogonal to the face as it is perceived". A perspective matrix does not map normals to normals. By
//                  default the normal of the pose in the camera's axes is used, the best possible meaning. Literally
//                  (StraughnOptions::Normals::letter) its x and y are scaled by twice the focal length over the image
//                  size.
//   which face     P_DM = F_C F_DM^-1 "from one of the faces", not which: the one whose tag is largest in the image.
//   sample points  Number and positions are not given: one at the centroid of each of the deepest patches of each
//                  quadrant.
//   reference      "Color sample from a reference image of the marker": the patch's albedo relative to the body's
//                  whitest, encoded as the camera's image.
//   adjacent sides "Sides adjacent": only sampled sides have a luminance, so only those count.
//   to the light   The text says both "pointing to" the light and "in the direction that it is shining"; its vectors
//                  point to the light.
// ARToolkit is not reimplemented: bench/straughn2018_tags.hpp.
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

/// An image with rows from the top. Its bytes are used as they are: the thesis does not linearize.
struct StraughnPicture {
  int width = 0, height = 0;
  int channels = 3;  ///< 3: r, g, b; 1: grey.
  std::span<const std::uint8_t> data;
  std::size_t stride = 0;
};

/// A pinhole. The centre of the top left pixel is (0, 0).
struct StraughnCamera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// Encoding of the image's bytes, and so of the reference image's.
enum class StraughnEncoding : std::uint8_t { linear, srgb };

struct StraughnPoint {
  FacePoint at;              ///< Face frame, m; in the thesis -1 to 1, times half of its image's width.
  double max_luminance = 0;  ///< Eq. 3.13 of the reference image there.
};

struct StraughnFace {
  int tag_id = 0;
  Pose body_face;  ///< F_DM.
  std::vector<StraughnPoint> points;
  std::vector<std::size_t> adjacent;  ///< Indices of faces that share an edge with it.
};

struct StraughnMarker {
  double tag_size_m = 0;
  std::vector<StraughnFace> faces;
};

/// `body` must have passed validate(). Faces are adjacent if the angle between their normals is the smallest of the
/// body, which holds for every regular body. Points of a white body are all white; those of a grey one are in its four
/// quadrants.
[[nodiscard]] StraughnMarker straughn_marker(const MarkerBody& body, StraughnEncoding encoding,
                                             std::size_t points_per_quadrant = 2);

/// Corners of a tag in the image: bottom left, bottom right, top right, top left of the upright tag.
struct StraughnTag {
  int id = 0;
  std::array<FacePoint, 4> corners_px{};
};

struct StraughnOptions {
  enum class Normals : std::uint8_t { pose, letter };
  Normals normals = Normals::pose;
  double threshold = 0.5;  ///< A face with at least this average luminance is lit.
  double visible_cosine =
      0.3;                   ///< Minimum cosine between normal and view vector for faces whose tags were not detected.
  double max_ambient = 0.5;  ///< If the lowest luminance exceeds this, no unlit face is assumed to be visible,
  double default_ambient = 0.3;  ///< and this is the ambient.
};

/// F_C of a face from its tag, axes _cv (x right, y down, z forward); std::nullopt if no pose fits. OpenCV's
/// IPPE_SQUARE (Collins & Bartoli 2014), the solution with the smaller reprojection error.
[[nodiscard]] std::optional<Pose> straughn_face_pose(const StraughnTag& tag, const StraughnCamera& camera,
                                                     double tag_size_m);

/// A face that was sampled.
struct StraughnView {
  std::size_t face = 0;  ///< In StraughnMarker::faces.
  bool direct = false;   ///< Its own tag was detected; otherwise its pose was derived from another tag.
  Vec3d normal_cv;       ///< Unit.
  double luminance = 0;  ///< Average over its points of luminance divided by maximum luminance.
};

/// Eq. 3.1 to 3.13. Empty without tags. Points outside the image are ignored, and faces without points. If a tag number
/// was detected twice, the larger tag counts.
[[nodiscard]] std::vector<StraughnView> straughn_sample(const StraughnPicture& picture, const StraughnCamera& camera,
                                                        const StraughnMarker& marker, std::span<const StraughnTag> tags,
                                                        const StraughnOptions& options = {});

struct StraughnLight {
  bool known = false;  ///< False if no face was sampled or the vectors cancel.
  Vec3d direction;     ///< Towards the light, camera axes x right, y up, z back. Unit.
  double intensity = 0;
  double ambient = 0;
};

/// Section 3.4, with eq. 3.14.
[[nodiscard]] StraughnLight straughn_light(const StraughnMarker& marker, std::span<const StraughnView> seen,
                                           const StraughnOptions& options = {});

/// A frame with ground truth.
struct StraughnCase {
  const StraughnMarker* marker = nullptr;
  std::vector<StraughnView> seen;
  Vec3d truth;  ///< Towards the light, camera axes x right, y up, z back.
};

struct StraughnThreshold {
  double threshold = 0;
  double mean_error_rad = 0;
};

/// The threshold among 0, 1/256 ... 1 with the smallest mean error over all cases with an estimate; of equally good
/// neighbours the middle one. `options.threshold` is ignored. std::nullopt if no case has an estimate.
[[nodiscard]] std::optional<StraughnThreshold> straughn_best_threshold(std::span<const StraughnCase> cases,
                                                                       StraughnOptions options = {});

}  // namespace lightwell::bench
