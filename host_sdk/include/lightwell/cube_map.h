/* The light around the probe as a cube map, for C: cube_map.hpp through the C ABI, with the rules of lightwell.h.
 * Meanings are documented at the types of the same names in cube_map.hpp. All: since LW_ABI_VERSION 0x00010005.
 */
#ifndef LIGHTWELL_CUBE_MAP_H
#define LIGHTWELL_CUBE_MAP_H

#include <lightwell/lightwell.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LW_MAX_CUBE_EDGE 64

typedef int32_t lw_cube_format; /* As CubeFormat: 8, 16 and 4 bytes a texel. */
enum { LW_CUBE_RGBA16F = 0, LW_CUBE_RGBA32F = 1, LW_CUBE_RGB9E5 = 2 };

typedef int32_t lw_cube_lights; /* Of the discrete lights. */
enum { LW_CUBE_WITH_LIGHTS = 0, LW_CUBE_WITHOUT_LIGHTS = 1 };

/* As CubeMapOptions. 0 in a field is the default. */
typedef struct lw_cube_map_options {
  uint32_t size;
  int32_t edge; /* Texels along an edge of a face, 1 to LW_MAX_CUBE_EDGE. Default: 64. */
  lw_cube_format format;
  lw_cube_lights lights;
  float scale; /* Texel value = scale * radiance, above 0. Default: 1. */
  uint32_t reserved;
} lw_cube_map_options;

/* As the answer of cube_map(). */
typedef struct lw_cube_map_summary {
  uint32_t size;
  lw_validity validity; /* Of the lighting. */
  int64_t age_ns;       /* As lw_lighting_info. */
  const char* reason;   /* As lw_lighting_info. */
  float error_bound;    /* As lw_answer. */
  uint32_t flags;       /* LW_FLAG_*. */
  uint64_t clamped;     /* Texels with a channel above the largest value of the format, which they have instead. */
} lw_cube_map_summary;

/* As cube_map(): faces +X, -X, +Y, -Y, +Z, -Z with the orientation of OpenGL, Vulkan and WebGPU, rows from t = 0, no
 * padding. options: NULL for the defaults. LW_INVALID_ARGUMENT if `capacity` (bytes) is less than 6 edge² texels take.
 * `summary` may be NULL. Takes milliseconds, does not allocate. */
LW_API lw_status lw_lighting_cube_map(const lw_lighting* lighting, const lw_cube_map_options* options, void* texels,
                                      size_t capacity, lw_cube_map_summary* summary);

#ifdef __cplusplus
}
#endif
#endif
