// C ABI of the environment map.
#include <algorithm>
#include <optional>
#include <span>

#include <lightwell/environment.hpp>
#include <lightwell/lighting.hpp>

#include "c/call.hpp"
#include "c/sized.hpp"

namespace lightwell::c {
namespace {

lw_environment as_c(const EnvironmentView& view) {
  lw_environment out{};
  out.size = sizeof out;
  out.level_count = static_cast<std::uint32_t>(view.map.levels.size());
  out.sequence = view.sequence;
  out.older_by_ns = view.older_by.ns;
  out.rotation[0] = view.rotation.x;
  out.rotation[1] = view.rotation.y;
  out.rotation[2] = view.rotation.z;
  out.rotation[3] = view.rotation.w;
  out.key = view.map.key;
  out.exponent = view.map.exponent;
  for (std::size_t k = 0; k < view.map.levels.size(); ++k) {
    out.edge[k] = static_cast<std::uint32_t>(view.map.levels[k].edge);
    out.roughness[k] = view.map.levels[k].roughness;
  }
  return out;
}

/// Writes the texels of a level into `out`, which has room for `capacity` numbers; `each` numbers per texel.
template <class T, class Write>
Status write_level(const Lighting& lighting, std::uint32_t level, T* out, std::size_t capacity, std::size_t each,
                   const Write& write) {
  const std::optional<EnvironmentView> view = lighting.environment();
  const std::size_t levels = view ? view->map.levels.size() : 0;
  if (level >= levels)
    return invalid("unknown level " + std::to_string(level) + ": the map has " + std::to_string(levels));
  const std::span<const EnvironmentLevel> all = view->map.levels;
  const std::size_t first = texel_count(all.first(level)), count = texel_count(all.subspan(level, 1));
  if (out == nullptr || capacity < each * count)
    return invalid("this level needs room for " + std::to_string(each * count) + " numbers");
  for (std::size_t i = 0; i < count; ++i) write(view->map.texels[first + i], view->map.exponent, out + each * i);
  return {};
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_lighting_environment(const lw_lighting* lighting, lw_environment* out) {
  return with_lighting(lighting, [&](const Lighting& l) {
    const std::optional<EnvironmentView> view = l.environment();
    lw_environment none{};
    none.rotation[3] = 1;
    return write_sized(view ? as_c(*view) : none, "lw_environment", out);
  });
}

lw_status lw_lighting_environment_radiance(const lw_lighting* lighting, uint32_t level, float* rgb, size_t capacity) {
  return with_lighting(lighting, [&](const Lighting& l) {
    return write_level(l, level, rgb, capacity, 3, [](std::uint32_t texel, int exponent, float* to) {
      const Radiance r = texel_radiance(texel, exponent);
      for (int k = 0; k < 3; ++k) to[k] = r[k];
    });
  });
}

lw_status lw_lighting_environment_texels(const lw_lighting* lighting, uint32_t level, uint32_t* texels,
                                         size_t capacity) {
  return with_lighting(lighting, [&](const Lighting& l) {
    return write_level(l, level, texels, capacity, 1, [](std::uint32_t texel, int, std::uint32_t* to) { *to = texel; });
  });
}

}  // extern "C"
