// Finds AprilTags in a grey picture, and where exactly their corners are.
//
//   picture ──AprilTag──> quads with numbers ──> corner_refiner ──> corners to hundredths of a pixel, with covariance
//      └──rectified views──AprilTag──┘           (always in the picture itself)
//
// AprilTag takes the edges of a tag for straight. Through a fisheye lens those of a large tag are not: where a camera
// model is given, the picture is looked at again through pinhole views that cover the outer part of the lens, and
// corners found there are mapped back. The model only has to be good enough for edges to be straight: what is measured
// comes from the picture.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "calibration/camera_model.hpp"
#include "pose/grey_picture.hpp"
#include "pose/tag_family.hpp"

namespace lightwell {

/// Of a corner's position, px².
struct PixelCovariance {
  double xx = 0, xy = 0, yy = 0;
};

struct TagDetection {
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  /// Bottom left, bottom right, top right, top left of the tag upright (tag_board.hpp). Pixels, the centre of the top
  /// left one is (0, 0); AprilTag's own, in which that is (0.5, 0.5), end here.
  std::array<PixelPosition, 4> corners{};
  /// Of each by itself. Neighbours share an edge, so their errors are not quite independent.
  std::array<PixelCovariance, 4> covariance{};
  int hamming = 0;             ///< Bits that had to be corrected.
  double decision_margin = 0;  ///< Mean difference of a cell from the threshold, 0 to 255: below 20 is doubtful.
  bool refined = false;    ///< Whether all four corners are from corner_refiner; AprilTag's are good to half a pixel.
  bool rectified = false;  ///< Found in a rectified view, or refined from there.
};

/// What becomes of AprilTag's corners.
enum class CornerRefinement : std::uint8_t {
  none,      ///< Kept: good to half a pixel, to one where the picture was made smaller.
  edge_search,  ///< Edges are followed, no light is fitted: to hundredths where they are sharp and straight, 0.04 ms a
             ///< tag.
  edge_fit,    ///< The blurred edges are fitted: to hundredths of a pixel, 1 to 3 ms a tag.
};

struct TagDetectorOptions {
  std::vector<TagFamily> families = {TagFamily::tag36h11};
  /// Edges are looked for in a picture that many times smaller: 2 takes a third of the time and loses tags below 20 px.
  double decimate = 1;
  /// Standard deviation of a blur before edges are looked for, px: 0.8 finds more in a noisy picture, fewer small ones.
  double blur_px = 0;
  /// Bits corrected, 0 to 2: more finds dirty tags, and tags that are none. 2 takes 100 MB for tagStandard41h12.
  int max_hamming = 1;
  /// Detections below are dropped.
  double min_decision_margin = 10;
  /// Parts of the picture whose values differ by less are taken for flat, 1 to 255. Where noise differs by more, edges
  /// are looked for in noise, which takes three to six times as long: see contrast_above_noise().
  int min_contrast = 5;
  CornerRefinement corners = CornerRefinement::edge_fit;
  /// Linear light for each of 256 picture values (linear_table() of calibration/response.hpp); empty: they are linear.
  /// Matters where the picture is encoded (sRGB): a blurred edge's middle is then not half way between the values, and
  /// every tag looks up to half a pixel larger or smaller.
  std::vector<float> linear;
  /// Half the angle from which on rectified views help, rad. Looking at them takes two to five times as long as at the
  /// picture.
  double rectify_beyond_rad = 0.7;
  int threads = 1;

  [[nodiscard]] Status validate() const;
};

/// A part of a picture: pixels [x, x + width) of rows [y, y + height).
struct PixelRegion {
  int x = 0, y = 0, width = 0, height = 0;

  friend bool operator==(const PixelRegion&, const PixelRegion&) = default;
};

/// Where and how a picture is looked at.
struct DetectionWindow {
  PixelRegion region;      ///< What it holds beyond the picture is left out.
  double decimate = 1;     ///< In place of the options'.
  int min_contrast = 5;  ///< In place of the options'.

  [[nodiscard]] Status validate() const;
};

/// Not thread-safe: one call at a time. Movable.
class TagDetector {
 public:
  /// invalid_argument: options that do not validate.
  [[nodiscard]] static Result<TagDetector> make(const TagDetectorOptions& options = {});
  TagDetector(TagDetector&&) noexcept;
  TagDetector& operator=(TagDetector&&) noexcept;
  ~TagDetector();

  /// All tags in the picture, by family and number; the same number twice where it is there twice. `lens`, where given,
  /// adds rectified views; a tag across the seam of a picture of the whole sphere is not found. invalid_argument: a
  /// picture that does not validate.
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const GreyPicture& picture, const CameraModel* lens = nullptr);

  /// Tags in a part of the picture, as plainly as that: no rectified views. A tag must lie inside with the white around
  /// it; its corners are places in the whole picture, and found there. invalid_argument: a picture or a look that does
  /// not validate.
  [[nodiscard]] Result<std::vector<TagDetection>> detect_in(const GreyPicture& picture, const DetectionWindow& look);

 private:
  struct Impl;
  explicit TagDetector(std::unique_ptr<Impl> inside);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
