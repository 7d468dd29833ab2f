#include "ar_viewer/material.hpp"

#include <algorithm>

namespace lightwell::viewer {
namespace {

constexpr std::array<std::string_view, 8> kPresets = {"matte", "plastic", "mirror", "chrome",
                                                      "gold",  "brushed", "glass",  "water"};

Material metal(std::array<float, 3> color, float roughness) {
  Material m;
  m.base_color = color;
  m.lambert = 0;
  m.metal_rough = m.metallic = 1;
  m.roughness = roughness;
  return m;
}

Material dielectric(float ior, std::array<float, 3> color) {
  Material m;
  m.base_color = color;
  m.lambert = 0;
  m.reflection = m.refraction = m.fresnel = 1;
  m.ior = ior;
  return m;
}

}  // namespace

std::span<const std::string_view> material_presets() { return kPresets; }

std::optional<Material> material_preset(std::string_view name) {
  if (name == "matte") return Material{};
  if (name == "chrome") return metal({0.55F, 0.556F, 0.554F}, 0.1F);
  if (name == "gold") return metal({1.0F, 0.78F, 0.34F}, 0.3F);
  if (name == "glass") return dielectric(1.5F, {0.95F, 0.97F, 0.96F});
  if (name == "water") return dielectric(1.33F, {0.9F, 0.96F, 1.0F});
  Material m;
  if (name == "plastic") {
    m.base_color = {0.5F, 0.08F, 0.06F};
    m.reflection = m.fresnel = 1;
    m.roughness = 0.3F;
    return m;
  }
  if (name == "mirror") {
    m.lambert = 0;
    m.reflection = 1;
    return m;
  }
  if (name == "brushed") {
    m = metal({0.56F, 0.57F, 0.58F}, 0.55F);
    m.metal_rough = 0.5F;
    m.anisotropic = 0.5F;
    return m;
  }
  return std::nullopt;
}

}  // namespace lightwell::viewer
