// Renders a MarkerScene: radiance per pixel, and image positions of points and tags.
//   pinhole_lens    an ordinary camera
//   MarkerCamera    a lens with its rays; projects points and tag corners
//   RadiancePicture, render
//   SurfacePicture, see_surfaces   the visible surface of each pixel, and the lamps occluded there
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/camera_model.hpp"
#include "reference/marker/marker_scene.hpp"

namespace lightwell::reference {

/// Linear radiance, three floats per pixel, rows from the top.
struct RadiancePicture {
  int width = 0, height = 0;
  std::vector<float> rgb;

  [[nodiscard]] Rgb at(int x, int y) const;
};

/// Model mei with xi = 0: no distortion, square pixels, principal point at the image centre; looks along the probe's
/// -Z.
[[nodiscard]] LensParameters pinhole_lens(int width, int height, double focal_px);

/// A lens by its model and pose. Directions are computed once at the corners of pixels and interpolated: exact for a
/// pinhole, otherwise to 1 / (8 focal length) px.
class MarkerCamera {
 public:
  /// `lens` must have passed RigParameters::validate().
  explicit MarkerCamera(const LensParameters& lens);

  [[nodiscard]] int width() const { return lens_.width; }
  [[nodiscard]] int height() const { return lens_.height; }
  [[nodiscard]] const LensParameters& lens() const { return lens_; }
  /// Projects a point (probe frame); std::nullopt outside the lens's field. The pixel may be outside the image.
  [[nodiscard]] std::optional<PixelPosition> pixel_of(Vec3d point) const;
  /// Centre of projection, probe frame.
  [[nodiscard]] Vec3d centre() const { return lens_.pose_cv.translation; }
  /// Direction through (column + u, row + v), u and v from 0 to 1 from the pixel's left and top edge; probe frame, any
  /// length.
  [[nodiscard]] std::optional<Vec3d> ray(int column, int row, double u, double v) const;

 private:
  LensParameters lens_;
  CameraModel model_;
  std::vector<std::optional<Vec3d>> rays_;  ///< Size (width + 1) (height + 1).
};

struct RenderOptions {
  /// Each pixel is first sampled by samples² rays (samples >= 2) on a grid that includes its edges. Details smaller
  /// than 1 / (samples - 1) px may be missed.
  int samples = 3;
  /// Pixels whose samples differ by more than 1/200 are sampled by this many rays (the next Fibonacci number) on a
  /// Fibonacci lattice: the coverage by a vertical edge is accurate to 1 / edge_rays, by any edge to 0.5 /
  /// sqrt(edge_rays), and errors of neighbours are independent. Nine rays would move a slanted tag's corners by 0.3 px.
  int edge_rays = 89;
  double blur_px = 0;  ///< Standard deviation of a Gaussian blur applied afterwards; borders are replicated.
  int threads = 1;     ///< Number of threads; does not change the result.
};

[[nodiscard]] RadiancePicture render(const MarkerScene& scene, const MarkerCamera& camera,
                                     const RenderOptions& options = {});

/// The surfaces hit by rays through pixel centres, rows from the top.
struct SurfacePicture {
  int width = 0, height = 0;
  std::vector<Surface> surfaces;
  /// Bit k: lamp k is partly or fully occluded there. A surface that faces away from a lamp does not count as occluded.
  std::vector<std::uint32_t> shaded;

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

[[nodiscard]] SurfacePicture see_surfaces(const MarkerScene& scene, const MarkerCamera& camera);

/// Pixels of the corners of a face's tag in the order of TagDetection: bottom left, bottom right, top right, top left.
/// std::nullopt if the face is turned away or a corner has no pixel; occlusion is ignored.
[[nodiscard]] std::optional<std::array<PixelPosition, 4>> tag_corners(const MarkerScene& scene,
                                                                      const MarkerCamera& camera, std::size_t face);
/// As tag_corners(), for any outline on a face.
[[nodiscard]] std::optional<std::vector<PixelPosition>> outline_pixels(const MarkerScene& scene,
                                                                       const MarkerCamera& camera, std::size_t face,
                                                                       const FaceOutline& outline);

}  // namespace lightwell::reference
