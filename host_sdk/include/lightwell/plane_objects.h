/* A virtual object on a captured plane, for C: its reflection (plane_reflection.hpp) and the light that the plane
 * reflects onto it (plane_light.hpp) through the C ABI, with the rules of lightwell.h. Meanings, limits and errors are
 * documented at the types of the same names there. All functions and structs: since LW_ABI_VERSION 0x00010004.
 *
 * Points, eyes and normals are in the plane's frame (plane_appearance.h), m. Colour is linear Rec. 709, three floats r,
 * g, b.
 */
#ifndef LIGHTWELL_PLANE_OBJECTS_H
#define LIGHTWELL_PLANE_OBJECTS_H

#include <lightwell/plane_appearance.h>
#include <lightwell/shadows.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the reflection of an object ---- */

/* Reused memory of reflections. One thread at a time uses a reflector. */
typedef struct lw_plane_reflector lw_plane_reflector;

/* As ReflectionOptions. 0 in a field is the default. */
typedef struct lw_reflection_options {
  uint32_t size;
  int32_t cell;     /* Texels along a cell within which a wide blur is interpolated, 1 to 16. Default: 4. */
  double tolerance; /* Largest part of the object that is evaluated as one, in lobe widths, 0.1 to 1. Default: 0.5. */
} lw_reflection_options;

/* As PlaneGrid: a rectangle of the plane, sides along its X and Y, row 0 at the top (+Y). */
typedef struct lw_plane_grid {
  uint32_t size;
  int32_t columns; /* 1 to 1024. 0: 256. */
  int32_t rows;    /* 1 to 1024. 0: 256. */
  int32_t reserved;
  double centre[2]; /* x, y, m. */
  double width;     /* Along X, m. */
  double height;    /* Along Y, m. */
} lw_plane_grid;

enum { LW_RADIANCE_PER_VERTEX = 0, LW_RADIANCE_PER_TRIANGLE = 1 };

/* As RadiantMesh. Memory is borrowed for the duration of a call. */
typedef struct lw_radiant_mesh {
  uint32_t size;
  int32_t radiance_per;       /* LW_RADIANCE_PER_*. */
  const lw_shadow_mesh* mesh; /* Its pose is in the plane's frame. */
  const float* radiance;      /* Three floats for each vertex or triangle, tightly packed. */
  size_t radiance_count;      /* Of vertices or triangles. */
} lw_radiant_mesh;

/* As PlaneReflection. */
typedef struct lw_plane_reflection {
  uint32_t size;
  lw_validity validity; /* LW_NONE: a matte plane, or none was received. LW_INVALID_QUERY: the eye is not in front. */
  int32_t f0_assumed;   /* 1: the probe sends no f0; it is taken as 0.04. */
  uint32_t reserved;
  uint64_t ignored_triangles; /* With a vertex that is NaN, infinite or too far away. */
  uint64_t texels;            /* With a hidden share above 0.001. */
} lw_plane_reflection;

/* options: NULL for the defaults. Release *out with lw_plane_reflector_release, which ignores NULL. */
LW_API lw_status lw_plane_reflector_create(const lw_reflection_options* options, lw_plane_reflector** out);
LW_API void lw_plane_reflector_release(lw_plane_reflector* reflector);

/* As PlaneReflector::render towards eye[3]: reflected[3 (row columns + column)] and the two that follow are r, g, b of
 * a texel, hidden[row columns + column] is the share of the specular part that the object hides. The texel's radiance
 * is D + S (1 - hidden) + reflected, with D and S by lw_plane_radiance. Writes 3 rows columns and rows columns floats;
 * LW_INVALID_ARGUMENT if reflected_capacity or hidden_capacity (floats) is less. `about` may be NULL. Takes
 * milliseconds. Does not allocate if grid, mesh and reflected image are not larger than before. */
LW_API lw_status lw_plane_reflector_render(lw_plane_reflector* reflector, const lw_plane* plane,
                                           const lw_plane_grid* grid, const lw_radiant_mesh* object, const double* eye,
                                           float* reflected, size_t reflected_capacity, float* hidden,
                                           size_t hidden_capacity, lw_plane_reflection* about);

/* ---- the light that a plane reflects ---- */

/* What is known of the light of a plane. Any number of threads may query it while none updates it. */
typedef struct lw_plane_light lw_plane_light;

/* What the plane's part was computed from, as PlaneLightSource. */
enum {
  LW_PLANE_LIGHT_NONE = 0,
  LW_PLANE_LIGHT_TEXTURE = 1,
  LW_PLANE_LIGHT_DESCRIPTOR = 2 /* The probe sends no texture: the lower hemisphere of the lighting. */
};

/* As PlaneLightAnswer. */
typedef struct lw_plane_light_answer {
  uint32_t size;
  lw_validity validity;
  float value[3]; /* Irradiance; luminance in lux if units are absolute. */
  uint32_t flags; /* LW_PLANE_*. */
  int32_t source; /* LW_PLANE_LIGHT_*. */
  uint32_t reserved;
} lw_plane_light_answer;

/* LW_NONE at first. Release it with lw_plane_light_release, which ignores NULL. */
LW_API lw_status lw_plane_light_create(lw_plane_light** out);
LW_API void lw_plane_light_release(lw_plane_light* light);

/* Takes over a snapshot. About 10 ms if the plane has changed. Allocates only if its texture is larger than before. */
LW_API lw_status lw_plane_light_update(lw_plane_light* light, const lw_plane* plane);

/* Irradiance at point[3] of a surface that faces normal[3] by what leaves the captured square. Does not allocate. */
LW_API lw_status lw_plane_light_irradiance(const lw_plane_light* light, const double* point, const double* normal,
                                           lw_plane_layers layers, lw_plane_light_answer* out);
/* The whole irradiance: that of a lighting, with the square's light in the directions of the square. The lighting's
 * axes are those of the plane (lw_lighting_rotated). Does not allocate. */
LW_API lw_status lw_plane_light_irradiance_in(const lw_plane_light* light, const double* point, const double* normal,
                                              const lw_lighting* lighting, lw_plane_light_answer* out);

#ifdef __cplusplus
}
#endif
#endif
