// Detected corners of a body's tags in rendered pictures, compared with the true corners and the stated covariance.
// Scenes of measure_corners and corner_noise_test.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/pose/body_pictures.hpp"

namespace lightwell::test {

inline constexpr std::array<std::pair<CornerRefinement, std::string_view>, 3> kRefinements = {
    {{CornerRefinement::none, "none"},
     {CornerRefinement::edge_search, "edge_search"},
     {CornerRefinement::edge_fit, "edge_fit"}}};

/// One end of an edge: the error perpendicular to the edge, which the other edge of the corner does not affect.
struct EdgeEnd {
  double cell_px = 0;    ///< Width of a cell perpendicular to the edge.
  double length_px = 0;  ///< Of the edge.
  double error_px = 0;   ///< Outwards positive.
  double sigma_px = 0;   ///< Stated.
};

/// Poses, and how honest their flags are.
struct AttitudeCounts {
  int poses = 0, ambiguous = 0;
  /// Not flagged, and the attitude beyond the 3 sigma ellipsoid: e' C⁻¹ e of the three angles above 14.16, which 0.27 %
  /// of Gaussian errors exceed.
  int beyond_3_sigma = 0;
  int mistaken = 0;  ///< Of these: off by more than 5 degrees, as a mistaken second attitude is.

  AttitudeCounts& operator+=(const AttitudeCounts& other);
};

/// Sums over the pictures of a cell. "Normalized" is e' C⁻¹ e: its mean is the number of coordinates if the stated
/// covariance C is that of the error e.
struct CornerStatistics {
  int tags = 0, refined = 0;  ///< Detected tags of the body; those whose four corners are refined.
  double squares_px2 = 0;     ///< Of the corners' errors.
  double normalized = 0;      ///< Of the corners against the true ones.
  std::vector<EdgeEnd> ends;  ///< Eight per tag.

  int poses = 0, ambiguous = 0, confident = 0;  ///< Estimated; flagged; not flagged.
  std::array<AttitudeCounts, 3> by_tags{};      ///< Of poses from one tag, two tags, three or more.
  double cost = 0, freedom = 0;                 ///< Chi² of the corners after the fit, and its degrees of freedom.
  double pose_normalized = 0;                   ///< Of the six pose parameters that are not flagged.

  [[nodiscard]] const AttitudeCounts& three_tags() const { return by_tags[2]; }
  [[nodiscard]] AttitudeCounts all_tags() const;
  /// RMS error of a coordinate, px.
  [[nodiscard]] double rms_px() const { return std::sqrt(squares_px2 / (8 * tags)); }
  /// Chi² per degree of freedom: of the corners against the true ones, and after the fit of the pose.
  [[nodiscard]] double true_chi_square() const { return normalized / (8 * tags); }
  [[nodiscard]] double fitted_chi_square() const { return cost / freedom; }
};

/// Compression by 8x8 blocks as in JPEG, with Annex K's luminance table scaled to `quality`, 1 to 100 (libjpeg's
/// scale).
void compress_blocks(reference::GreyBytes& picture, int quality);

/// Conditions of a cell of the table.
struct CornerCell {
  double blur_px = 0.6;       ///< Standard deviation of the lens blur.
  double electrons = 10'000;  ///< At full scale: shot noise.
  double decimate = 1.5;      ///< DetectionWindow::decimate.
  double exposure = 1;        ///< BodyShot::exposure.
  bool srgb = false;          ///< BodyShot::srgb; the detector linearises the picture.
  int jpeg_quality = 0;       ///< compress_blocks(); 0: none.
};

/// A camera and a body that are known exactly.
[[nodiscard]] BodyPoseOptions exact_camera();

/// Random attitudes of a body that is `width_px` wide, in square pictures with a focal length of 550 px. Each picture
/// shows another body with `errors`.
class CornerScenes {
 public:
  CornerScenes(const MarkerBody& body, double width_px, int attitudes, std::uint64_t first_seed,
               const BuildErrors& errors = {});

  /// Detects the tags in one picture of each attitude and estimates the pose of `body`.
  [[nodiscard]] CornerStatistics measure(CornerRefinement refinement, const CornerCell& cell,
                                         const BodyPoseOptions& options = exact_camera()) const;

 private:
  struct Scene {
    BodyShot shot;
    std::vector<float> radiance;
    std::vector<TagObservation> truth;
  };
  RigParameters rig_;
  MarkerBody body_;
  BodyCamera camera_;
  std::vector<Scene> scenes_;
};

}  // namespace lightwell::test
