// Pictures of random scenes, what the passes make of them, and what the double oracle says.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/lens_table.hpp"
#include "camera/frame.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"
#include "reference/block_light.hpp"
#include "reference/random_scene.hpp"

namespace lightwell::test {

/// A response to put on a rig's lenses in place of the one they come with.
enum class Curve { as_it_comes, linear, srgb, gamma, table, linear_black };
inline constexpr Curve kCurves[] = {Curve::linear, Curve::srgb, Curve::gamma, Curve::table, Curve::linear_black};
[[nodiscard]] std::string_view to_string(Curve curve);

/// Frames of a bracket with the pictures that they lend.
struct Shot {
  std::vector<std::vector<std::byte>> pictures;
  std::vector<Frame> frames;
};

/// The oracle's words on a bracket, all lenses' blocks one after another.
struct Truth {
  std::vector<reference::BlockLight> blocks;
  double clipped_sr = 0, noise = 0;
};

/// A rig of sim/rigs.hpp and the oracle beside it. What depends on its geometry alone is worked out once.
class OracleCase {
 public:
  OracleCase(std::string_view kind, int width, int height, PixelFormat format, Curve curve);
  OracleCase(const OracleCase&) = delete;
  OracleCase& operator=(const OracleCase&) = delete;

  void set_curve(Curve curve);

  [[nodiscard]] const RigParameters& rig() const { return rig_; }
  [[nodiscard]] const RigTable& table() const { return table_; }
  [[nodiscard]] PixelFormat format() const { return format_; }
  [[nodiscard]] const estimate::BlockLayout& layout(int edge) { return geometry(edge).layout; }
  [[nodiscard]] const estimate::CellGrid& grid(int edge) { return geometry(edge).grid; }

  /// Every pixel holds the scene's radiance at its middle, encoded to the nearest code. An exposure of 1 takes the
  /// brightest pixel to `fill` of saturation. Rows are padded by `padding` bytes of rubbish (whole samples of it).
  [[nodiscard]] Shot shoot(const reference::RandomScene& scene, std::span<const double> exposures, double fill = 0.95,
                           std::size_t padding = 0) const;
  /// Pictures of bytes that mean nothing.
  [[nodiscard]] Shot shoot_noise(unsigned seed) const;

  [[nodiscard]] Truth truth(std::span<const Frame> bracket, int edge) const;
  /// By the oracle's own harmonics of the blocks. Fitted where the grid is.
  [[nodiscard]] std::vector<reference::Rgb> coefficients(const Truth& truth, int edge);

 private:
  struct Geometry {
    estimate::BlockLayout layout;
    estimate::CellGrid grid;
    std::vector<double> means;  ///< The oracle's harmonics of the blocks.
  };
  Geometry& geometry(int edge);

  RigParameters rig_;
  RigTable table_;
  PixelFormat format_;
  std::vector<reference::LensPixels> lenses_;
  std::map<int, Geometry> geometry_;
};

/// Largest difference of two sets of coefficients over the largest coefficient, all bands and channels of a Projection.
[[nodiscard]] double deviation(const estimate::Projection& got, std::span<const reference::Rgb> truth);

}  // namespace lightwell::test
