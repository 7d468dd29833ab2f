// C ABI of cube_map().
#include <cmath>
#include <cstddef>
#include <span>
#include <string>

#include <lightwell/cube_map.h>
#include <lightwell/cube_map.hpp>

#include "c/call.hpp"

namespace lightwell::c {
namespace {

static_assert(static_cast<int>(CubeFormat::rgba16f) == LW_CUBE_RGBA16F);
static_assert(static_cast<int>(CubeFormat::rgba32f) == LW_CUBE_RGBA32F);
static_assert(static_cast<int>(CubeFormat::rgb9e5) == LW_CUBE_RGB9E5);
static_assert(kMaxCubeEdge == LW_MAX_CUBE_EDGE);

Status parse(const lw_cube_map_options& given, CubeMapOptions& to) {
  if (given.edge < 0 || given.edge > kMaxCubeEdge)
    return invalid("edge is " + std::to_string(given.edge) + "; it is 1 to 64, or 0 for 64");
  if (given.format < LW_CUBE_RGBA16F || given.format > LW_CUBE_RGB9E5)
    return invalid("format is " + std::to_string(given.format) + "; it is one of LW_CUBE_RGBA16F, _RGBA32F, _RGB9E5");
  if (given.lights < LW_CUBE_WITH_LIGHTS || given.lights > LW_CUBE_WITHOUT_LIGHTS)
    return invalid("lights is " + std::to_string(given.lights) + "; it is LW_CUBE_WITH_LIGHTS or _WITHOUT_LIGHTS");
  if (!(given.scale >= 0) || !std::isfinite(given.scale))
    return invalid("scale is " + std::to_string(given.scale) + "; it is finite and above 0, or 0 for 1");
  if (given.edge != 0) to.edge = given.edge;
  to.format = static_cast<CubeFormat>(given.format);
  to.lights = given.lights == LW_CUBE_WITH_LIGHTS ? LightsIncluded::yes : LightsIncluded::no;
  if (given.scale != 0) to.scale = given.scale;
  return {};
}

lw_cube_map_summary as_c(const Answer<std::size_t>& answer) {
  auto out = start_answer<lw_cube_map_summary>(answer);
  out.clamped = answer.value;
  return out;
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" lw_status lw_lighting_cube_map(const lw_lighting* lighting, const lw_cube_map_options* options, void* texels,
                                          size_t capacity, lw_cube_map_summary* summary) {
  const lw_status status = with_handle(lighting, [&](const Lighting& light) -> Status {
    lw_cube_map_options given{};
    if (options != nullptr)
      if (Status s = read_sized(options, "lw_cube_map_options", given); !s.ok()) return s;
    std::uint32_t size = 0;
    if (summary != nullptr)
      if (Status s = size_of(summary, "lw_cube_map_summary", size); !s.ok()) return s;
    CubeMapOptions parsed;
    if (Status s = parse(given, parsed); !s.ok()) return s;
    const std::size_t bytes = cube_map_bytes(parsed.edge, parsed.format);
    if (texels == nullptr || capacity < bytes)
      return invalid("the texels need room for " + std::to_string(bytes) + " bytes");
    const Answer<std::size_t> answer = cube_map(light, parsed, std::span(static_cast<std::byte*>(texels), bytes));
    return summary == nullptr ? Status() : write_sized(as_c(answer), "lw_cube_map_summary", summary);
  });
  return write_failure(status, "lw_cube_map_summary", summary);
}
