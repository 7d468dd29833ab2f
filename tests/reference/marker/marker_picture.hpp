// What a camera sees of a MarkerScene: radiance pixel by pixel, and where things are in the picture.
//   pinhole_lens    an ordinary camera
//   MarkerCamera    a lens with its rays; where a point, a tag's corners are
//   RadiancePicture, render
//   SurfacePicture, see_surfaces   which surface each pixel shows, and what shades it
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/camera_model.hpp"
#include "reference/marker/marker_scene.hpp"

namespace lightwell::reference {

/// Linear, r g b a pixel, rows from the top.
struct RadiancePicture {
  int width = 0, height = 0;
  std::vector<float> rgb;

  [[nodiscard]] Rgb at(int x, int y) const;
};

/// mei with xi = 0, no distortion, square pixels, the axis in the picture's middle, axes the probe's: looks along -Z.
[[nodiscard]] LensParameters pinhole_lens(int width, int height, double focal_px);

/// A lens by its own model and pose. Directions are worked out once, at the corners of pixels, and interpolated
/// between: exact for a pinhole, to 1 / (8 focal length) px otherwise.
class MarkerCamera {
 public:
  /// `lens` has passed RigParameters::validate().
  explicit MarkerCamera(const LensParameters& lens);

  [[nodiscard]] int width() const { return lens_.width; }
  [[nodiscard]] int height() const { return lens_.height; }
  [[nodiscard]] const LensParameters& lens() const { return lens_; }
  /// The pixel of a point of the probe's frame; nothing where the lens cannot see. May lie outside of the picture.
  [[nodiscard]] std::optional<PixelPosition> pixel_of(Vec3d point) const;
  /// Where rays start, probe's frame.
  [[nodiscard]] Vec3d centre() const { return lens_.pose_cv.translation; }
  /// Towards (column + u, row + v), u and v 0 to 1 from the pixel's left and top edge; probe's frame, any length.
  [[nodiscard]] std::optional<Vec3d> ray(int column, int row, double u, double v) const;

 private:
  LensParameters lens_;
  CameraModel model_;
  std::vector<std::optional<Vec3d>> rays_;  ///< (width + 1) (height + 1).
};

struct RenderOptions {
  /// A pixel is first the mean of samples² rays on a grid from edge to edge of its square, 2 or more. What is smaller
  /// than 1 / (samples - 1) px may slip through.
  int samples = 3;
  /// Where those differ by more than a part of 200 it is the mean of so many (the next Fibonacci number) on a lattice
  /// that has no rows: a pixel knows how much of it is on which side of an upright edge to 1 / edge_rays, of any edge
  /// to 0.5 / sqrt(edge_rays), and neighbours err independently. Nine rays alone would put a slanted tag's corners 0.3
  /// px off.
  int edge_rays = 89;
  double blur_px = 0;  ///< Standard deviation of a Gaussian, afterwards. Borders repeat.
  int threads = 1;     ///< Rows are shared out; the picture is the same.
};

[[nodiscard]] RadiancePicture render(const MarkerScene& scene, const MarkerCamera& camera,
                                     const RenderOptions& options = {});

/// What the rays through pixels' centres meet, rows from the top.
struct SurfacePicture {
  int width = 0, height = 0;
  std::vector<Surface> surfaces;
  /// Bit k: something hides lamp k there, all or a part of it. A surface that is turned away is not hidden.
  std::vector<std::uint32_t> shaded;

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

[[nodiscard]] SurfacePicture see_surfaces(const MarkerScene& scene, const MarkerCamera& camera);

/// Pixels of a face's tag corners as TagDetection has them: bottom left, bottom right, top right, top left. Nothing
/// where the face is turned away or a corner has no pixel; what hides them is not asked.
[[nodiscard]] std::optional<std::array<PixelPosition, 4>> tag_corners(const MarkerScene& scene,
                                                                      const MarkerCamera& camera, std::size_t face);
/// Of any outline of a face, likewise.
[[nodiscard]] std::optional<std::vector<PixelPosition>> outline_pixels(const MarkerScene& scene,
                                                                       const MarkerCamera& camera, std::size_t face,
                                                                       const FaceOutline& outline);

}  // namespace lightwell::reference
