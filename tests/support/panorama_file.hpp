// Small panoramas, written on the spot: what a test needs to know of its light, it has made itself.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::test {

/// Equirectangular, rows from the top, r g b a pixel.
struct PanoramaPixels {
  int width = 0, height = 0;
  std::vector<float> rgb;
};

/// A lamp: a disc of radiance before whatever else is there.
struct Lamp {
  Vec3d direction;
  double radius_rad = 0;
  Radiance radiance;
};

/// `rest` at the pixel centres, and the lamps before it; pixels at a lamp's rim hold their share.
[[nodiscard]] PanoramaPixels room(int width, const std::function<Radiance(Vec3d)>& rest,
                                  const std::vector<Lamp>& lamps);

/// 128x64: dim walls, lighter above, and one lamp at +X with a radius of 6 degrees.
[[nodiscard]] PanoramaPixels room_with_lamp_at_plus_x();

/// A 32-bit OpenEXR file.
void write_exr(const std::string& path, const PanoramaPixels& pixels);

}  // namespace lightwell::test
