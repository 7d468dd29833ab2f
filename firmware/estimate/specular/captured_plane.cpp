#include "estimate/specular/captured_plane.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>

#include <lightwell/specular_brdf.hpp>

namespace lightwell::specular {
namespace {

/// Negative radiance becomes 0. NaN stays, and is refused by the encoder.
float positive(float v) { return v < 0 ? 0 : v; }
Radiance sent(Radiance v, float scale) { return {positive(v.r * scale), positive(v.g * scale), positive(v.b * scale)}; }

void fill_texture(const PlaneTexels& texels, const TexelImage& diffuse, float scale, PlaneTexture& out) {
  out.edge = texels.edge;
  out.radiance.resize(out.count());
  out.state.resize(out.count());
  for (std::size_t k = 0; k < out.count(); ++k) {
    const TexelRadiance& texel = diffuse[k];
    out.radiance[k] = texel.seen() ? sent(texel.radiance(), scale) : Radiance{};
    out.state[k] = texel.measured() ? SampleState::measured : texel.seen() ? SampleState::clipped : SampleState::unseen;
  }
}

void fill_lumisphere(const Lumisphere& specular, const GlossEstimate* gloss, float scale, PlaneLumisphere& out) {
  const int levels = specular.grid.levels();
  const std::size_t step = levels > kMaxSentLevels && levels % 2 == 0 ? 2 : 1;
  out.grid = HemisphereGrid(levels / static_cast<int>(step));
  out.radiance.resize(out.grid.size());
  out.state.resize(out.grid.size());
  std::size_t node = 0;
  for (int level = 0; level <= out.grid.levels(); ++level) {
    const std::size_t first = HemisphereGrid::first_of(level * static_cast<int>(step));
    for (int k = 0; k < HemisphereGrid::nodes_of(level); ++k, ++node) {
      const std::size_t from = first + step * static_cast<std::size_t>(k);
      const bool seen = specular.weight[from] > 0;
      std::optional<Radiance> predicted;
      if (!seen && gloss != nullptr) predicted = gloss->predicted(vec_cast<float>(specular.grid.direction(from)));
      out.radiance[node] = sent(predicted.value_or(specular.value[from]), scale);
      out.state[node] = !seen                         ? SampleState::unseen
                        : specular.clipped[from] != 0 ? SampleState::clipped
                                                      : SampleState::measured;
    }
  }
}

}  // namespace

void fill_captured_plane(const PlaneCapture& capture, const GlossEstimate* gloss, float scale, CapturedPlane& out) {
  const SurfaceLightField& light_field = capture.light_field();
  fill_texture(light_field.texels(), capture.separation().diffuse(), scale, out.texture);
  fill_lumisphere(capture.separation().specular(), gloss, scale, out.lumisphere);
  out.coverage.grid = light_field.grid();
  out.coverage.seen.assign(light_field.visited().begin(), light_field.visited().end());
  out.info.size_m = light_field.texels().size_m;
  const TextureAlignment alignment = capture.alignment();
  const double size = 1 + alignment.scale;
  out.info.texture_to_plane = {size * alignment.x_m, size * alignment.y_m, alignment.rotation_rad, size};
  out.info.gloss_alpha.reset();
  out.info.f0.reset();
  if (gloss == nullptr || !gloss->glossy) return;
  // The estimate assumes the default reflectance.
  out.info.gloss_alpha = static_cast<float>(gloss->alpha);
  out.info.f0 = SpecularBrdf{}.f0;
}

}  // namespace lightwell::specular
