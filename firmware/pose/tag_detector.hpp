// Detects AprilTags in a grey picture and refines their corners.
//
//   picture ──AprilTag──> quads with ids ──> corner_refiner ──> corners to hundredths of a pixel, with covariance
//      └──rectified views──AprilTag──┘       (always in the picture itself)
//
// AprilTag (Wang & Olson 2016) assumes straight edges. Through a fisheye lens the edges of a large tag are curved:
// given a camera model, the detector also searches pinhole views of the outer field and maps their corners back. An
// approximate model is sufficient if it makes the edges straight, because the corners are refined in the picture.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/model/camera_model.hpp"
#include "pose/grey_view.hpp"
#include "pose/tag_board.hpp"

struct apriltag_detector;  // Of the AprilTag library.

namespace lightwell {

/// Covariance of a corner's position, px².
struct PixelCovariance {
  double xx = 0, xy = 0, yy = 0;
};

struct TagDetection {
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  /// Bottom left, bottom right, top right, top left of the upright tag (tag_board.hpp), px. The centre of the top left
  /// pixel is (0, 0), unlike (0.5, 0.5) in AprilTag.
  std::array<PixelPosition, 4> corners{};
  /// Covariance of each corner. The correlation between neighbours, which share an edge, is not given.
  std::array<PixelCovariance, 4> covariance{};
  int hamming = 0;             ///< Number of corrected bits.
  double decision_margin = 0;  ///< Mean difference of a cell from the threshold, 0 to 255: below 20 is unreliable.
  bool refined = false;        ///< Whether all four corners are refined; unrefined ones are accurate to half a pixel.
  bool rectified = false;      ///< Detected in a rectified view, or refined from there.
  /// Standard deviation of the blur across the tag's edges in the direction in which it is larger, px; nullopt where it
  /// was not measured (CornerRefinement::none, no edge with enough contrast).
  std::optional<double> blur_px;
};

/// Refinement of AprilTag's corners.
enum class CornerRefinement : std::uint8_t {
  none,         ///< No refinement: accurate to half a pixel, to one pixel in a decimated picture.
  edge_search,  ///< Steepest gradient along the edges: hundredths of a pixel for sharp straight edges, 0.04 ms per tag.
  edge_fit,     ///< Fit of a blurred-edge model: hundredths of a pixel, 1 to 3 ms per tag.
};

/// Angle from the axis beyond which rectified views are searched, rad: two to five times the time of the picture.
inline constexpr double kRectifyBeyond_rad = 0.7;

/// Orientation and intrinsics of a square pinhole view.
struct ViewAxes {
  Vec3d right, down, forward;  ///< Unit vectors in the lens's _cv frame.
  double focal_px = 0;
  int size = 0;  ///< Pixels per side; the principal point is the centre.
};

/// Pinhole views of a fisheye picture, in which straight edges are straight. Together they cover the centre of a lens
/// and its field from `beyond_rad` (angle from the axis) outwards, each with about the resolution of the picture there.
/// Neighbours overlap by 35 degrees, so that a narrower tag is complete in one of them. Empty if the picture, whatever
/// the model's range, does not extend to `beyond_rad`.
[[nodiscard]] std::vector<ViewAxes> views_of(const CameraModel& lens, int width, int height, double beyond_rad);

struct TagDetectorOptions {
  std::vector<TagFamily> families = {TagFamily::tag36h11};
  CornerRefinement corners = CornerRefinement::edge_fit;
  /// Linear intensity for each of the 256 pixel values (linear_table() of calibration/model/response.hpp); empty: the
  /// values are linear. In an encoded picture (sRGB), the centre of a blurred edge is not half way between the values:
  /// without this table every tag appears up to half a pixel larger or smaller.
  std::vector<float> linear;

  [[nodiscard]] Status validate() const;
};

/// A rectangle of pixels: columns [x, x + width) of rows [y, y + height).
struct PixelRegion {
  int x = 0, y = 0, width = 0, height = 0;

  friend bool operator==(const PixelRegion&, const PixelRegion&) = default;
};

/// DetectionWindow::decimate of a picture that is enlarged.
inline constexpr double kEnlarged = 0.5;

/// How pixel values are presented to AprilTag, which separates black from white half way between a tile's extremes.
enum class Tones : std::uint8_t {
  unchanged,
  /// The logarithm of the linear intensity: a shadow across a tag is nearer to white than to ink. Amplifies noise.
  logarithmic,
};

/// The part of a picture to search, with its own search parameters.
struct DetectionWindow {
  PixelRegion region;  ///< Clipped to the picture.
  /// Reduction of the picture in which quads are searched, 1 to 8. 2: a third of the time, but no tags below 20 px.
  /// kEnlarged: the picture is enlarged twice, for cells below 2.5 px; four times the pixels.
  double decimate = 1;
  /// Tiles whose values differ by less are ignored, 1 to 255. Slow if less than contrast_above_noise().
  int min_contrast = 5;
  Tones tones = Tones::unchanged;

  [[nodiscard]] Status validate() const;
};

/// Not thread-safe: one call at a time. Can be moved, not assigned.
class TagDetector {
 public:
  /// invalid_argument: options that do not validate.
  [[nodiscard]] static Result<TagDetector> make(const TagDetectorOptions& options = {});
  // No assignment: AprilTag's detector must be destroyed before its families.
  TagDetector(TagDetector&&) = default;

  /// All tags in the picture, sorted by family and id; an id may occur several times. With `lens`, rectified views are
  /// searched, too. A tag across the seam of an equirectangular picture is not found. invalid_argument: a picture that
  /// does not validate.
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const GreyPicture& picture, const CameraModel* lens = nullptr);

  /// Tags in a part of the picture, without rectified views, sorted as by detect(); none if the window lies outside the
  /// picture. The tag and its white rim must lie inside the window. The corners are refined in the whole picture and in
  /// its coordinates. invalid_argument: a picture or a window that does not validate.
  [[nodiscard]] Result<std::vector<TagDetection>> detect_in(const GreyPicture& picture, const DetectionWindow& window);

 private:
  TagDetector() = default;
  /// AprilTag's detections, not refined, in the pixel convention of TagDetection.
  [[nodiscard]] std::vector<TagDetection> detect_coarse(const GreyPicture& picture,
                                                        const DetectionWindow& search = {}) const;
  /// The same in the picture enlarged twice; search.decimate is ignored.
  [[nodiscard]] std::vector<TagDetection> detect_enlarged(const GreyPicture& picture, DetectionWindow search) const;
  void refine(const GreyPicture& picture, TagDetection& tag, double decimate = 1) const;

  TagDetectorOptions options_;
  std::vector<std::pair<TagFamily, ApriltagFamily>> families_;
  std::unique_ptr<apriltag_detector, void (*)(apriltag_detector*)> detector_{nullptr, nullptr};
};

}  // namespace lightwell
