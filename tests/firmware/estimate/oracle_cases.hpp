// Frames of random scenes, and block sums and coefficients of a double-precision oracle.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"
#include "imaging/frame.hpp"
#include "reference/block_light.hpp"
#include "reference/random_scene.hpp"

namespace lightwell::test {

/// A response curve for all lenses of a rig; as_it_comes: that of the rig.
enum class Curve { as_it_comes, linear, srgb, gamma, table, linear_black };
inline constexpr Curve kCurves[] = {Curve::linear, Curve::srgb, Curve::gamma, Curve::table, Curve::linear_black};
[[nodiscard]] std::string_view to_string(Curve curve);

/// Frames of a bracket and their memory.
struct Shot {
  std::vector<std::vector<std::byte>> pictures;
  std::vector<Frame> frames;
};

/// The oracle's result for a bracket: blocks of all lenses in order.
struct Truth {
  std::vector<reference::BlockLight> blocks;
  double clipped_sr = 0, noise = 0;
};

/// A rig of sim/sensor.hpp and its oracle. Caches what depends on the geometry alone.
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

  /// Sets every pixel to the scene's radiance at its middle, encoded to the nearest code. With an exposure of 1, the
  /// brightest pixel is at `fill` of saturation. Rows are padded by `padding` samples of arbitrary content.
  [[nodiscard]] Shot shoot(const reference::RandomScene& scene, std::span<const double> exposures, double fill = 0.95,
                           std::size_t padding = 0) const;
  /// A frame of random bytes.
  [[nodiscard]] Shot shoot_random_bytes(unsigned seed) const;

  [[nodiscard]] Truth truth(std::span<const Frame> bracket, int edge) const;
  /// Coefficients by the oracle's own harmonics of the blocks; least-squares fit where the grid uses one.
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

/// Largest difference of coefficients relative to the largest coefficient, over all bands and channels.
[[nodiscard]] double deviation(const estimate::Projection& got, std::span<const reference::Rgb> truth);

}  // namespace lightwell::test
