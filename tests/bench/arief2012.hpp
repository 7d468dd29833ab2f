// Peer: "Realtime Estimation of Illumination Direction for Augmented Reality on Mobile Devices" (I. Arief, S. McCallum,
// J. Y. Hardeberg, Color and Imaging Conference 2012, pages 111-116): the direction of one light from the shadow of a
// reference object that is also the marker.
//   AriefView                the ground around the body in one picture
//   AriefView::light         the light's direction, for one threshold
//   arief_best_threshold     the single threshold that is best for a set of frames
//
// Only the abstract could be read. It says: the shadow of a reference object that doubles as a 3D marker is analysed;
// one strong light; a controlled environment with a uniform surface; a mean error below 0.038 rad. The rest is the
// plain reading of that, in favour of the method where there is a choice:
//   pose           From all tags together, by the caller.
//   ground         The plane of the body's face that is most probably below if the camera is upright and looks down by
//                  40 degrees; or the face that `up_cv` points away from.
//   segmentation   A pixel of the ground is in shadow if its value is below a threshold times the median of the ground
//                  around the body, out to `reach`. The bytes are used as they are: not linearized. The shadow is the
//                  largest dark region that touches the body in the picture. Comparisons use the best fixed threshold.
//   line           Azimuth: from the foot of the body's centre to the centroid of the visible shadow. Elevation: by the
//                  tip, the point of the shadow's edge that is furthest along this line; it is cast by the vertex of
//                  the body that requires the highest light.
//   contour        The direction whose shadow of the body has the edge nearest to the visible edge of the shadow, and
//                  covers no lit ground (mean of the distances, each limited), searched from the line's result. Points
//                  of the contour where the body, the picture's border or the reach cuts the shadow are not used.
//   light          Distant: the direction is the same at every point of the body.
// The paper's filtering over time is left out: each picture is estimated on its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>

#include "calibration/model/camera_model.hpp"
#include "pose/grey_view.hpp"

namespace lightwell::bench {

/// Published mean angular error, rad (abstract).
inline constexpr double kAriefPublished_rad = 0.038;

struct AriefOptions {
  std::optional<Vec3d> up_cv;  ///< Up, if known; axes _cv of the lens.
  double reach = 3;            ///< Radius of the ground that is searched, in heights of the body.
};

/// Towards the light, unit, axes _cv of the lens.
struct AriefLight {
  bool known = false;  ///< False without a shadow.
  Vec3d line, contour;
};

class AriefView {
 public:
  /// `body` has passed validate(); `lens_body` is T_lens_body, axes _cv. std::nullopt if no ground is in view, and for
  /// a body with a ball: its sheet covers the ground where the shadow falls, and is not uniform.
  [[nodiscard]] static std::optional<AriefView> make(const GreyPicture& picture, const CameraModel& lens,
                                                     const MarkerBody& body, const Pose& lens_body,
                                                     const AriefOptions& options = {});

  /// `threshold`: 0 to 1, relative to the ground's median.
  [[nodiscard]] AriefLight light(double threshold) const;

 private:
  struct Point {
    float x, y;
  };
  struct Vertex {
    double x, y, z;
  };
  /// Points of the ground: of the visible edge of the shadow, and beside the shadow.
  struct Observed {
    std::vector<Point> edge, lit;
  };
  AriefView() = default;
  [[nodiscard]] bool set_plane(const MarkerBody& body, const Pose& lens_body, const std::optional<Vec3d>& up_cv);
  [[nodiscard]] bool set_region(const GreyPicture& picture, const CameraModel& lens, double reach);
  [[nodiscard]] Vec3d direction_of(Point shift) const;
  [[nodiscard]] double mismatch(const Observed& seen, Point shift) const;
  [[nodiscard]] Point fitted(const Observed& seen, Point first) const;

  // The plane: lengths in heights of the body, origin at the foot of its centre.
  Vec3d foot_, right_, forward_, up_;  ///< Lens axes; the last three are unit.
  double height_m_ = 0;
  std::vector<Vertex> vertices_;
  // Pixels of the region of interest, row by row.
  int left_ = 0, top_ = 0, width_ = 0, height_ = 0;
  std::vector<std::uint8_t> grey_;    ///< Smoothed.
  std::vector<std::uint8_t> ground_;  ///< 255: ground that the body does not hide.
  std::vector<std::uint8_t> inner_;   ///< 255: only such ground near the pixel.
  std::vector<std::uint8_t> near_;    ///< 255: at the body's outline.
  std::vector<Point> plane_;          ///< Of each pixel of the ground.
  double level_ = 0;
  double body_px_ = 0;  ///< Area of the body's outline, px.
};

/// The thresholds that are compared: 1/20 to 19/20.
inline constexpr std::size_t kAriefThresholds = 19;
[[nodiscard]] constexpr double arief_threshold(std::size_t k) { return static_cast<double>(k + 1) / 20; }

/// A frame with ground truth: the light for each threshold.
struct AriefCase {
  std::array<AriefLight, kAriefThresholds> lights;
  Vec3d truth;  ///< Towards the light, axes _cv of the lens.
};

/// Index of the threshold with the smallest mean error of `which`. A frame without a light counts as 90 degrees, the
/// mean error of a guess: otherwise the best threshold would be one that answers in few frames.
[[nodiscard]] std::size_t arief_best_threshold(std::span<const AriefCase> cases, Vec3d AriefLight::*which);

}  // namespace lightwell::bench
