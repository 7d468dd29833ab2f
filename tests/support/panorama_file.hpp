// Makes small panoramas with known light and writes them as OpenEXR files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::test {

/// Equirectangular, rows from the top, three floats per pixel.
struct PanoramaPixels {
  int width = 0, height = 0;
  std::vector<float> rgb;
};

/// A disc of constant radiance that covers the background.
struct Lamp {
  Vec3d direction;
  double radius_rad = 0;
  Radiance radiance;
};

/// The background radiance `rest`, evaluated at the pixel centres, covered by lamps; pixels at a lamp's rim are blended
/// by their coverage.
[[nodiscard]] PanoramaPixels room(int width, const std::function<Radiance(Vec3d)>& rest,
                                  const std::vector<Lamp>& lamps);

/// 128x64: dim walls, lighter above, and one lamp at +X with a radius of 6 degrees.
[[nodiscard]] PanoramaPixels room_with_lamp_at_plus_x();

/// A 32-bit OpenEXR file.
void write_exr(const std::string& path, const PanoramaPixels& pixels);

}  // namespace lightwell::test
