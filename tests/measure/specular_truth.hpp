// What an estimate of the light on a rendered glossy plane is compared with.
#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/glossy_plane.hpp>

#include "estimate/frames/body_finder.hpp"
#include "measure/specular_sequences.hpp"
#include "reference/panorama.hpp"

namespace lightwell::measure {

/// Gives the poses of a sequence's tags, frame by frame. `sequence` must outlive it.
[[nodiscard]] std::unique_ptr<BodyFinder> make_sequence_finder(const SpecularSequence& sequence);

/// Of all sequences; its tag is never searched for.
[[nodiscard]] GlossyPlane plane_of_sequence();

/// What surrounds the middle of the plane in frame k, world axes: the environment above, the plane's mean diffuse
/// radiance below.
[[nodiscard]] reference::Panorama surroundings(const SpecularSequence& sequence, int k);

/// A direction in the world's axes, in the probe's axes of the descriptor, and back.
[[nodiscard]] Vec3f in_probe(const Descriptor& d, const reference::V3& world);
[[nodiscard]] reference::V3 in_world(const Descriptor& d, Vec3f probe);

/// Irradiance at normals (world axes).
struct IrradianceTruth {
  std::vector<reference::V3> normals;
  std::vector<reference::Rgb> irradiance;

  /// At 256 normals.
  [[nodiscard]] static IrradianceTruth of(const reference::Panorama& surroundings);
  /// RMS error of a descriptor's irradiance over normals and channels, relative to the RMS of the truth.
  [[nodiscard]] double error(const Descriptor& d) const;
};

/// A light as the plane shows it, blurred by its lobe.
struct TrueLight {
  reference::V3 direction;  ///< World axes.
  double irradiance = 0;    ///< Luminance, of a receiver that faces it.
};
/// Bright regions in the order of their peaks, without those nearer than two lobe widths to a brighter one (the slopes
/// of its blur are regions, too); those above a tenth of the strongest, strongest first.
[[nodiscard]] std::vector<TrueLight> true_lights(const reference::Panorama& blurred, double lobe_width_rad);
/// Least sine of the elevation that the plane can mirror: the circle of Jachnik et al. 2012, figure 8.
inline const double kLowestMirrored = std::sin(reference::pi / 18);
/// The part of the sphere that the plane can mirror. The rest is black.
template <class RadianceOf>
[[nodiscard]] reference::Panorama mirrored_part(int width, int height, const RadianceOf& radiance) {
  reference::Panorama out{width, height, {}};
  out.rgb.resize(static_cast<std::size_t>(3 * width * height));
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const reference::V3 d = reference::pixel_direction(i, j, width, height);
      reference::set_pixel(out, i, j, d.y > kLowestMirrored ? radiance(d) : reference::Rgb{});
    }
  return out;
}

}  // namespace lightwell::measure
