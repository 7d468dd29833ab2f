// Rendered views of the image-based object's reference data, kept in files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/image_object_encoder.hpp>
#include <lightwell/result.hpp>

#include "reference/image_object/object_renderer.hpp"

namespace lightwell::measure {

/// The sampling of the seed of the method: a view every 4 degrees of turn, a light every 3 degrees of arc.
inline constexpr int kViews = 8, kLights = 61, kBetween = 12;
inline constexpr double kTurnStepDeg = 4, kLightStepDeg = 3;

/// Index of the captured light before between-light j; the truth is midway to the next one.
[[nodiscard]] constexpr int light_before(int j) { return 5 * j + 2; }

struct RenderedSet {
  int view = 0;
  int side = 256;
  int samples = 4;                ///< A pixel has samples x samples.
  double angular_radius_deg = 0;  ///< Of all lights.
};

/// One view under the captured lights, then under those between.
struct RenderedView {
  std::vector<std::uint8_t> coverage;  ///< 0 to 255.
  std::vector<Radiance> ambient;
  std::vector<std::vector<Radiance>> lit;
  std::vector<std::vector<reference::PixelLight>> light;

  [[nodiscard]] std::size_t pixels() const { return coverage.size(); }
  /// Whether a pixel belongs to the object: at least half of it is covered.
  [[nodiscard]] bool is_object(std::size_t pixel) const { return coverage[pixel] >= 128; }
  /// The captured lights alone.
  [[nodiscard]] ViewPictures pictures() const;
};

/// Positions of the captured lights.
[[nodiscard]] ObjectRig reference_rig(int side);

/// The direction of between-light j, in the frame of the rig.
[[nodiscard]] Vec3f between_direction(int j);

/// Reads the view from `folder`, or renders it there: file names contain a checksum of a small picture, so that another
/// scene has other files. An empty folder name: nothing is kept.
[[nodiscard]] Result<RenderedView> rendered_view(const reference::ObjectRenderer& renderer, const RenderedSet& set,
                                                 const std::string& folder);

}  // namespace lightwell::measure
