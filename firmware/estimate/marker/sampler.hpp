// Samples the shading of a marker from a frame, given the body's pose.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/marker_body.hpp>

#include "estimate/frames/row_reader.hpp"
#include "estimate/marker/convex_hull_2d.hpp"
#include "estimate/marker/ground_sheet.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

struct SamplerOptions {
  /// Largest number of faces to sample, those that face the lens most; 0: all visible ones. The ground plane is sampled
  /// in any case. Fewer faces take less time and determine the light less well.
  int max_faces = 0;
  /// Unit vector, probe frame; determines the face on which the body stands. nullopt: not known, the most likely face
  /// is chosen (PosedBody::face_below). Zero: no ground plane is sampled, except below a ball.
  std::optional<Vec3d> up;
};

/// Largest blur (standard deviation) for which the error model of the samples holds, px. The margins that exclude mixed
/// pixels grow with the blur. At this value a patch 12 px wide keeps 7.5 px, whose mean has 1.2 % of the difference
/// from the neighbours on both sides: with faces that differ by 40 %, the 0.5 % of kSampleRelativeSigma.
inline constexpr double kMaxBlur_px = 1.5;

/// Statistics of the sampled frame.
struct SampleCounts {
  int patches = 0;                   ///< On the visible faces that were considered.
  int clipped = 0;                   ///< Patches excluded for saturated pixels.
  int nonuniform = 0;                ///< Patches excluded because another object or a shadow's edge covers a part.
  int too_small = 0;                 ///< Patches excluded for too few pixels.
  int faces = 0;                     ///< Faces with at least one sample.
  std::uint64_t invalid_pixels = 0;  ///< Pixels that were read and are negative, NaN or infinite.
  int occluded = 0;                  ///< Patches excluded because the tag of their face is occluded.
  /// Largest mean luminance of a patch (radiance), clipped patches included.
  double brightest = 0;
  /// Mean over patches of the possible bias near black by rounding and noise (luminance of radiance).
  double near_black_bias = 0;
};

/// A surface of the body that the lens sees. It receives light from the hemisphere around its normal.
struct VisibleSurface {
  Vec3d normal;
  bool saturated = false;  ///< No patch is usable, and at least one is saturated.
};

/// Shares as in a descriptor. `coverage`: share of the sphere from which at least one surface receives light.
/// `saturated`: share of the covered directions from which only saturated surfaces do.
struct SphereCoverage {
  double coverage = 0, saturated = 0;
};
/// Sums over 2,048 directions; the error is below 0.002.
[[nodiscard]] SphereCoverage sphere_coverage(std::span<const VisibleSurface> surfaces);

/// Measures the mean radiance inside every patch, on the black border of each tag (family tag36h11), and of the ground
/// plane around the body. Reuses its memory.
class MarkerSampler {
 public:
  MarkerSampler(int max_image_width, const SamplerOptions& options) : options_(options), row_(max_image_width) {}

  /// As SamplerOptions::max_faces.
  void set_max_faces(int max_faces) { options_.max_faces = max_faces; }
  /// Visible surfaces of the last frame.
  [[nodiscard]] const std::vector<VisibleSurface>& surfaces() const { return surfaces_; }
  /// Fills `out`. `reader` must be bound to the frame. `width` and `height`: of the lens's image. Radiance is in the
  /// reader's units times `scale`. `blur_px`: standard deviation of the image's blur. `channels`: Shading::channels of
  /// `out`.
  SampleCounts sample(estimate::RowReader& reader, int lens, int width, int height, const MarkerBody& body,
                      const PosedBody& posed_body, double scale, double blur_px, int channels, Shading& out);

 private:
  struct Patch {
    std::vector<Vec3d> corners;  // relative to the body's centre
    Vec3d normal;
    Rgb albedo;
    int surface = 0;
    double occluder_radius = 0;  // as of SurfaceSample
    int number = 0;              // SurfaceSample::patch
  };
  struct VisibleFace {
    std::size_t number = 0;
    double view_cosine = 0;  // of the angle between its normal and the direction to the lens
  };
  /// Fills faces_, in the body's order. A face whose tag is occluded is counted, and the next face takes its place.
  void choose_faces(const MarkerBody& body);
  /// Appends to surfaces_ if the surface has added to the previous counts `samples` and `clipped`.
  void record_surface(Vec3d normal, std::size_t samples, int clipped, const Shading& out);
  /// Fills outline_ with the hull of the projected points; false where one has no pixel, or where its area is zero.
  bool project_outline(const std::vector<Vec3d>& points);
  struct PixelSums;
  /// Adds the pixels that are inside the hull of the projected points by at least `margin` px.
  void add_pixels(const std::vector<Vec3d>& corners, double margin, PixelSums& sums);
  void sample_patch(const Patch& patch, Shading& out);
  /// Samples the sides of the black border of a face's tag. Adds nothing where the family is not tag36h11, where the
  /// border has too few pixels, or where one is saturated.
  void sample_ink(const MarkerBody& body, const MarkerFace& face, int surface, Shading& out);
  void sample_ball(const MarkerBody& body, const PosedBody& posed_body, Shading& out);
  void sample_ground(const MarkerBody& body, Shading& out);
  /// The pixel that shows a point of the ground plane; nullopt where it is outside of the image, or the body hides it.
  [[nodiscard]] std::optional<PixelPosition> ground_pixel(Vec3d point) const;
  /// Number of samples of a square grid within `reach` of the body's foot, m, that are wholly seen.
  [[nodiscard]] int count_ground_samples(double reach, double step, const GroundPlane& ground) const;
  /// Samples that grid. `radius`: of the hull.
  void sample_ground_grid(const MarkerBody& body, double reach, double radius, double step, Shading& out);

  SamplerOptions options_;
  estimate::LinearRow row_;
  estimate::ReadStatistics reading_;
  ConvexHull2d outline_;
  Patch patch_;
  std::vector<VisibleFace> faces_;
  std::vector<VisibleSurface> surfaces_;
  std::vector<GroundCover> covers_;  // of the ground's samples
  // Of the current frame.
  estimate::RowReader* reader_ = nullptr;
  const PosedBody* posed_body_ = nullptr;
  int lens_ = 0, width_ = 0, height_ = 0;
  double scale_ = 1;
  double margin_factor_ = 1;  // of all margins
  SampleCounts counts_;
};

}  // namespace lightwell::marker
