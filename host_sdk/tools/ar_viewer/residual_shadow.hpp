// Ambient occlusion of the objects on the real plane: what remains of the irradiance of the residual, which is the
// light without the discrete lights.
#pragma once

#include <optional>
#include <vector>

#include <lightwell/result.hpp>
#include <lightwell/shadows.hpp>

#include "ar_viewer/gl_objects.hpp"
#include "ar_viewer/light_state.hpp"
#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

/// The SDK's ShadowCaster, whose result is a texture over a square of the plane. Computed again only if the residual or
/// the objects have changed.
class ResidualShadow {
 public:
  /// Texels along the edge of the square, which is kReach times as wide as the objects are.
  static constexpr int kEdge = 96;
  static constexpr double kReach = 4;

  [[nodiscard]] static Result<ResidualShadow> make();

  struct Square {
    double centre_x = 0, centre_z = 0;  ///< In the plane's frame, m.
    double half_m = 0;                  ///< 0: nothing casts.
  };
  /// positions (world, m), indices: all objects. Binds the texture to Unit::residual.
  [[nodiscard]] Result<Square> update(const LightState& light, const Ground& ground, std::vector<Vec3f>& positions,
                                      const std::vector<std::uint32_t>& indices);

 private:
  explicit ResidualShadow(ShadowCaster caster);
  [[nodiscard]] bool unchanged(const LightState& light, const std::vector<Vec3f>& positions) const;

  ShadowCaster caster_;
  GlTexture texture_;
  std::vector<LightRatio> ratios_;
  std::vector<Vec3f> positions_;
  std::optional<RadianceSh> residual_;
  Square square_;
};

}  // namespace lightwell::viewer
