// What a plane mirrors of a mesh towards an eye, as surfels in a tree.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::core {

/// All lengths in widths of a texel's column: x along columns, y along rows upwards, z above the plane; the origin is
/// the corner of the grid at -X, -Y.
struct MirrorVertex {
  Vec3f position;
  Radiance radiance;
};

/// A part of the line in which the object crosses the plane; all are oriented alike to the object's inside.
struct SectionEdge {
  float from_x = 0, from_y = 0, to_x = 0, to_y = 0;
};

/// What is rendered. The spans must remain until the last call of MirrorImage::texel().
struct MirrorScene {
  std::span<const MirrorVertex> vertices;  ///< Finite, not below the plane.
  std::span<const std::array<std::uint32_t, 3>> triangles;
  std::span<const SectionEdge> section;
  Vec3f eye;  ///< z > 0.
  int columns = 0, rows = 0;
  float row_height = 1;
};

/// A part of the object that the mirrored eye sees.
struct Surfel {
  Vec3f position;              ///< Mean over its area.
  float radius = 0;            ///< Of a ball around `position` that contains it.
  Vec3f area;                  ///< Vector area, towards the mirrored eye.
  float weight = 0;            ///< Area across the ray from the mirrored eye.
  Radiance radiance;           ///< Mean.
  std::uint32_t children = 0;  ///< 1 + index of the group into which it divides; 0: a pixel.
};

/// Up to four surfels of one part; those that are absent have no area and no children. Arrays, so that loops over the
/// four vectorise.
struct SurfelGroup {
  std::array<float, 4> x{}, y{}, z{}, radius2{};
  std::array<float, 4> area_x{}, area_y{}, area_z{};
  std::array<float, 4> red{}, green{}, blue{};
  std::array<std::uint32_t, 4> children{};

  void set(std::size_t k, const Surfel& surfel);
};

/// The mirror image within one texel.
struct MirrorTexel {
  Radiance radiance;   ///< Of what covers it, times the share.
  float covered = 0;   ///< Share of the texel, 0 to 1.
  float distance = 0;  ///< Mean distance from the texel to what covers it, texels; 0: nothing does.
};

/// One axis of the image: pixels of equal size within the grid, and of geometrically growing size outside.
class ImageAxis {
 public:
  /// Texels of the grid, the length of each, and the interval in which pixels are wanted.
  void build(int texels, float texel, float low, float high);
  [[nodiscard]] int size() const { return static_cast<int>(centre_.size()); }
  [[nodiscard]] float centre(int i) const { return centre_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] float width(int i) const { return width_[static_cast<std::size_t>(i)]; }
  /// First pixel whose centre is not below x; size() if none.
  [[nodiscard]] int first_from(float x) const;
  /// The pixels of a texel of the grid, one or two: `first` to `last`, of which some may be outside of 0 to size().
  struct Range {
    int first = 0, last = 0;
  };
  [[nodiscard]] Range of_texel(int texel) const;

 private:
  std::vector<float> centre_, width_;
  int origin_ = 0;     ///< Index of the pixel that begins at 0; may be outside of 0 to size().
  int per_texel_ = 2;  ///< Pixels of a texel.
};

class MirrorImage {
 public:
  /// Allocates only if more is seen than before.
  void build(const MirrorScene& scene);

  /// The tree of what is seen; the last group is the root. Empty if nothing is seen.
  [[nodiscard]] std::span<const SurfelGroup> groups() const { return groups_; }
  /// Column from -X, row from -Y.
  [[nodiscard]] MirrorTexel texel(int column, int row) const;

 private:
  struct Projected {
    float x = 0, y = 0;  ///< Where the plane mirrors the vertex to the eye, texels.
    float depth = 0;     ///< eye.z z / (eye.z + z): linear in the image, grows with the height z.
  };
  struct Pixel {
    float depth = 0;
    std::uint32_t triangle = 0;  ///< 1 + index; 0: nothing is seen.
  };
  struct Sample {
    Vec3f position;
    Radiance radiance;
  };

  void rasterize(std::uint32_t triangle);
  void find_inside();
  [[nodiscard]] Sample sample(const Pixel& pixel, float x, float y) const;
  [[nodiscard]] Surfel leaf(int i, int j) const;
  bool gather(int level, int i, int j, Surfel& out);
  [[nodiscard]] const Pixel& pixel(int i, int j) const {
    return pixels_[static_cast<std::size_t>(j) * static_cast<std::size_t>(x_.size()) + static_cast<std::size_t>(i)];
  }

  MirrorScene scene_;
  std::vector<Projected> projected_;
  ImageAxis x_, y_;
  std::vector<Pixel> pixels_;
  std::vector<std::int32_t> winding_;  ///< Of the section around each pixel; empty if there is no section.
  std::vector<SurfelGroup> groups_;
};

}  // namespace lightwell::core
