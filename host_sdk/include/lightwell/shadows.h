/* Soft shadows of a virtual object on a real plane, for C: shadows.hpp through the C ABI, with the rules of
 * lightwell.h. Meanings, limits and errors are documented at the types of the same names in shadows.hpp. All functions
 * and structs: since LW_ABI_VERSION 0x00010003.
 */
#ifndef LIGHTWELL_SHADOWS_H
#define LIGHTWELL_SHADOWS_H

#include <lightwell/lightwell.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Reused memory of shadow textures. One thread at a time uses a caster. */
typedef struct lw_shadow_caster lw_shadow_caster;

/* As ShadowOptions. 0 in a field is the default. */
typedef struct lw_shadow_options {
  uint32_t size;
  int32_t light_samples;       /* Most directions sampled of one light, 1 to 1024. Default: 40. */
  int32_t residual_directions; /* Directions sampled of the residual radiance, 1 to 1024. Default: 96. */
  int32_t residual_cell;       /* Texels along a cell of the residual's occlusion, 1 to 16. Default: 1. */
} lw_shadow_options;

/* As ShadowReceiver: a rectangle of a plane, +Z its normal, +X right, +Y up, row 0 at the top. */
typedef struct lw_shadow_receiver {
  uint32_t size;
  int32_t columns; /* 1 to 4096. 0: 256. */
  int32_t rows;    /* 1 to 4096. 0: 256. */
  int32_t reserved;
  double position[3];    /* Of the plane's pose in the lighting's frame, m. */
  double orientation[4]; /* x, y, z, w. All zero: the identity. */
  double width;          /* Along X, m. */
  double height;         /* Along Y, m. */
} lw_shadow_receiver;

/* As ShadowMesh. Memory is borrowed for the duration of a call. */
typedef struct lw_shadow_mesh {
  uint32_t size;
  uint32_t reserved;
  const void* positions;   /* Three floats for each vertex, m. */
  size_t position_stride;  /* Bytes from one vertex to the next: 0 (tightly packed) or at least 12. */
  size_t position_count;   /* Vertices. */
  const uint32_t* indices; /* Three for each triangle. */
  size_t index_count;
  double position[3];    /* Of the mesh's pose in the plane's frame, m. */
  double orientation[4]; /* x, y, z, w. All zero: the identity. */
} lw_shadow_mesh;

/* As Answer<ShadowSummary>. */
typedef struct lw_shadow_summary {
  uint32_t size;
  lw_validity validity; /* Of the lighting. */
  int64_t age_ns;       /* As lw_lighting_info. */
  const char* reason;   /* As lw_lighting_info. */
  float error_bound;    /* As lw_answer. */
  uint32_t flags;       /* LW_FLAG_*. */
  int32_t no_light;     /* 1: no light reaches the plane, and all ratios are 1. */
  int32_t lights;       /* Lights that reach the plane. */
  int32_t directions;   /* Directions sampled. */
  int32_t reserved;
  uint64_t ignored_triangles; /* With a vertex that is NaN, infinite or too far away. */
} lw_shadow_summary;

/* options: NULL for the defaults. Release *out with lw_shadow_caster_release, which ignores NULL. */
LW_API lw_status lw_shadow_caster_create(const lw_shadow_options* options, lw_shadow_caster** out);
LW_API void lw_shadow_caster_release(lw_shadow_caster* caster);

/* As ShadowCaster::cast: ratios[3 (row columns + column)] and the two that follow are r, g, b of a texel, 0 to 1.
 * Writes 3 rows columns floats; LW_INVALID_ARGUMENT if `capacity` (floats) is less, or if an index is out of range.
 * `summary` may be NULL. Takes milliseconds. Does not allocate if receiver and mesh are not larger than before, and
 * after a call with as many lights. */
LW_API lw_status lw_shadow_caster_cast(lw_shadow_caster* caster, const lw_lighting* lighting,
                                       const lw_shadow_receiver* receiver, const lw_shadow_mesh* mesh, float* ratios,
                                       size_t capacity, lw_shadow_summary* summary);

#ifdef __cplusplus
}
#endif
#endif
