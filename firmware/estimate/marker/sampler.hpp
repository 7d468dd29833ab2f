// From a picture and the body's place in it to what the marker shows of the light.
//   sample_marker     mean radiance over the inside of every patch, and of the table around
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/marker_body.hpp>

#include "estimate/common/row_reader.hpp"
#include "estimate/marker/convex_hull_2d.hpp"
#include "estimate/marker/marker_geometry.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

struct SamplerOptions {
  /// Pixels next to a patch's edge that are left to its neighbour: blur, and what the pose may be off.
  double margin_px = 1.5;
  /// Faces seen flatter than this are not looked at: cosine of the angle to their normal.
  double min_view_cosine = 0.12;
  /// Only so many faces are sampled, those that face the lens most; 0: all that it sees. The table is sampled either
  /// way. Fewer take less time, and tell less: light that falls along one face alone has no direction of its own.
  int max_faces = 0;
  /// Pixels that a patch must have left.
  int min_pixels = 12;
  /// What stands over a patch in part (a shadow's edge, another object) makes it uneven: left out from this share of
  /// its mean on.
  double uneven = 0.10;
  /// Samples of the table.
  int ground_samples = 400;
  Vec3d up{0, 1, 0};  ///< Probe frame: which of the faces that are not seen it stands on.
};

/// What sampling found besides.
struct SampleCounts {
  int patches = 0;            ///< On faces that the lens sees and that were asked for.
  int clipped = 0;            ///< Left out for saturated pixels.
  int uneven = 0;             ///< Left out because something lies over a part of them.
  int small = 0;              ///< Left out because too few pixels are inside.
  int faces = 0;              ///< With a sample.
  std::uint64_t cleaned = 0;  ///< Pixels that were read and are no number, or negative.
  int covered = 0;            ///< Left out with their face, whose tag is not where it should be.
  double darkest = 0,
         brightest = 0;  ///< Mean luminance of a patch's radiance, least and largest, clipped ones included.
  /// Mean luminance of what rounding and noise may hide near black, over patches.
  double hidden = 0;
};

/// A surface of the body that the lens sees. It receives light from the hemisphere of directions above it.
struct VisibleSurface {
  Vec3d normal;
  bool saturated = false;  ///< None of its patches is anything but saturated.
};

/// Shares as the descriptor has them: `coverage` of the sphere, directions above at least one surface; `saturated` of
/// the covered directions, those above saturated surfaces alone.
struct SphereCoverage {
  double coverage = 0, saturated = 0;
};
/// Summed over 2,048 directions: within 0.002.
[[nodiscard]] SphereCoverage sphere_coverage(std::span<const VisibleSurface> surfaces);

/// The reader is bound to the frames. Radiance is in the reader's units times `scale`. Holds memory from frame to
/// frame.
class MarkerSampler {
 public:
  MarkerSampler(int widest, const SamplerOptions& options);

  /// As SamplerOptions::max_faces.
  void set_max_faces(int most) { options_.max_faces = most; }
  /// Of the last picture.
  [[nodiscard]] const std::vector<VisibleSurface>& surfaces() const { return surfaces_; }
  /// Fills `out`. `channels`: 1 where the camera is grey.
  SampleCounts sample(estimate::RowReader& reader, int lens, int width, int height, const MarkerBody& body,
                      const PosedBody& placed, double scale, int channels, Shading& out);

 private:
  struct Patch {
    std::vector<Vec3d> corners;  // relative to the body's centre
    Vec3d normal;
    Rgb albedo;
    int surface = 0;
  };
  struct VisibleFace {
    std::size_t number = 0;
    double facing = 0;  // cosine of the angle between its normal and the way to the lens
  };
  /// Fills faces_, in the body's order. Faces whose tag is not where it should be are counted as covered; the next
  /// takes their place.
  void choose_faces(const MarkerBody& body);
  /// Notes a surface of which samples or saturated patches have come since there were so many.
  void record_surface(Vec3d normal, std::size_t samples, int clipped, const Shading& out);
  void sample_patch(const Patch& patch, Shading& out);
  void sample_ball(const MarkerBody& body, const PosedBody& placed, Shading& out);
  void sample_ground(Shading& out);

  SamplerOptions options_;
  estimate::LinearRow row_;
  estimate::ReadStatistics reading_;
  ConvexHull2d outline_;
  Patch patch_;
  std::vector<VisibleFace> faces_;
  std::vector<VisibleSurface> surfaces_;
  // Of the frame at hand.
  estimate::RowReader* reader_ = nullptr;
  const PosedBody* placed_ = nullptr;
  int lens_ = 0, width_ = 0, height_ = 0;
  double scale_ = 1;
  SampleCounts counts_;
};

}  // namespace lightwell::marker
