// Equations 1 and 5: sums over photographs.
#include <algorithm>
#include <limits>
#include <string>

#include <lightwell/relight.hpp>

#include "relight/alpha.hpp"
#include "relight/subject.hpp"

namespace lightwell {
namespace {

/// 0 for values that are negative or not finite.
float clean(float v) { return v > 0 && v <= std::numeric_limits<float>::max() ? v : 0.0F; }

Status check(const relight::AlphaData& alpha, BasisPictures basis, std::span<Radiance> out) {
  if (basis.size() != alpha.weights.size())
    return invalid_argument("there are " + std::to_string(basis.size()) + " photographs, alpha has " +
                            std::to_string(alpha.weights.size()) + " basis lights");
  for (std::size_t i = 0; i < basis.size(); ++i)
    if (Status status = relight::check_size("photograph " + std::to_string(i), basis[i].size(), alpha.pixels);
        !status.ok())
      return status;
  return relight::check_size("the output", out.size(), alpha.pixels);
}

/// Adds weight L + alpha (L - I) of one photograph; `existing` may be empty.
void add(const RgbFactor& weight, const relight::AlphaMap& map, std::span<const Radiance> picture,
         std::span<const Radiance> existing, std::span<Radiance> out) {
  const std::size_t pixels = out.size();
  for (std::size_t p = 0; p < pixels; ++p)
    for (int c = 0; c < 3; ++c) {
      const float existing_light = clean(picture[p][c]);
      float value = weight[c] * existing_light;
      if (map.used) {
        const float direct = existing.empty() ? existing_light : std::max(existing_light - existing[p][c], 0.0F);
        value += map.planes[static_cast<std::size_t>(c) * pixels + p] * direct;
      }
      out[p][c] += value;
    }
}

bool is_black(const RgbFactor& f) { return f == RgbFactor{}; }

void add_modelled(const relight::AlphaData& alpha, std::span<Radiance> out) {
  for (std::size_t p = 0; p < alpha.modelled.size(); ++p) out[p] += alpha.modelled[p];
}

}  // namespace

Status relight_direct(const AlphaMaps& alpha, BasisPictures basis, std::span<Radiance> out) {
  const relight::AlphaData& data = alpha.data();
  if (Status status = check(data, basis, out); !status.ok()) return status;
  std::ranges::fill(out, Radiance{});
  for (std::size_t i = 0; i < basis.size(); ++i)
    if (data.maps[i].used || !is_black(data.weights[i])) add(data.weights[i], data.maps[i], basis[i], {}, out);
  add_modelled(data, out);
  return {};
}

Status relight_corrected(const AlphaMaps& alpha, BasisPictures basis, const IndirectLight& indirect,
                         std::span<Radiance> out) {
  const relight::AlphaData& data = alpha.data();
  if (Status status = check(data, basis, out); !status.ok()) return status;
  if (indirect.existing.size() != basis.size() || indirect.spatial.size() != data.pixels)
    return invalid_argument("the indirect light is that of another basis or picture: simulate it with this alpha");
  for (std::size_t i = 0; i < basis.size(); ++i)
    if (data.maps[i].used && indirect.existing[i].size() != data.pixels)
      return invalid_argument("the indirect light lacks basis light " + std::to_string(i) +
                              ": simulate it with this alpha");
  std::ranges::copy(indirect.spatial, out.begin());
  for (std::size_t i = 0; i < basis.size(); ++i)
    if (data.maps[i].used || !is_black(data.weights[i]))
      add(data.weights[i], data.maps[i], basis[i], indirect.existing[i], out);
  add_modelled(data, out);
  return {};
}

}  // namespace lightwell
