// The look of an object: a weighted sum of the reflection models of CubeMap360 (Alhakamy & Tuceryan 2019, section
// III-C) and a metal-rough material as of glTF 2.0.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace lightwell::viewer {

/// Where the reflection models are evaluated; in between they are interpolated linearly.
enum class LightingRate : std::uint8_t { fragment, vertex };

/// A model with weight 0 does not take part; the others are added. Weights are 0 to 1.
struct Material {
  std::array<float, 3> base_color{0.8F, 0.8F, 0.8F};  ///< Linear; albedo, and colour of metal and of refracted light.

  float lambert = 1;  ///< Weight of base_color / pi times the irradiance.

  float blinn_phong = 0;  ///< Weight of the lights' highlight (Blinn 1977), normalised by (shininess + 8) / (8 pi).
  float shininess = 64;   ///< 1 to 10000.

  float anisotropic = 0;      ///< Weight of the lights' highlight of Ashikhmin & Shirley 2000, eq. 4.
  float n_u = 10, n_v = 400;  ///< Its exponents along tangent and bitangent, 0 to 10000.

  float reflection = 0;  ///< Weight of radiance(mirrored eye, roughness), lights included.
  float refraction = 0;  ///< Weight of base_color times radiance(refracted eye, roughness), one interface.
  float ior = 1.5F;      ///< Index of refraction, 1 to 4.
  /// 0: reflection and refraction have their weights; 1: these are multiplied by F and 1 - F of the dielectric (Schlick
  /// 1994, with fresnel_power in place of 5); in between: mixed.
  float fresnel = 0;
  float fresnel_power = 5;  ///< 1 to 10. Smaller: a wider bright rim.

  float metal_rough = 0;  ///< Weight of the metal-rough model (glTF 2.0, appendix B).
  float metallic = 0;     ///< 0 to 1.
  float roughness = 0;    ///< Perceptual roughness of reflection, refraction and metal-rough, 0 to 1.

  std::string texture;     ///< Picture (sRGB) that multiplies base_color; empty: none.
  std::string normal_map;  ///< Tangent-space normals, picture as glTF's; empty: none.
  float normal_scale = 1;  ///< Of x and y of the normal map, 0 to 10.
  LightingRate lighting = LightingRate::fragment;
};

/// matte, plastic, mirror, chrome, gold, brushed, glass, water.
[[nodiscard]] std::span<const std::string_view> material_presets();
/// nullopt for a name that is none of material_presets().
[[nodiscard]] std::optional<Material> material_preset(std::string_view name);

}  // namespace lightwell::viewer
