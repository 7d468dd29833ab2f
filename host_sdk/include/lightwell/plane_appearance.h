/* A glossy plane that a probe captured, for C: plane_appearance.hpp through the C ABI, with the rules of lightwell.h.
 * Meanings are documented there at the types and functions of the same names. Since LW_ABI_VERSION 0x00010003.
 *
 * Points and directions are in the plane's frame: right-handed, m, origin in the middle of the captured square, +Z its
 * normal on the viewer's side, +X right, +Y to the top of the texture. Colour is linear Rec. 709, three floats r, g, b.
 *
 * Threads. As lightwell.h: one thread at a time uses an lw_plane_reader; while lw_plane_reader_snapshot or
 * lw_plane_copy fills an lw_plane (`into`), no other call uses that lw_plane.
 */
#ifndef LIGHTWELL_PLANE_APPEARANCE_H
#define LIGHTWELL_PLANE_APPEARANCE_H

#include <lightwell/lightwell.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lw_plane_reader lw_plane_reader; /* Collects the messages of one plane. */
typedef struct lw_plane lw_plane;               /* A container for one immutable snapshot. */

typedef int32_t lw_plane_layers; /* Which parts of the radiance are wanted. */
enum {
  LW_PLANE_ALL = 0,
  LW_PLANE_DIFFUSE = 1, /* Without the mirror image of the room: where a virtual object hides it. */
  LW_PLANE_SPECULAR = 2 /* The mirror image alone. */
};

/* Why a radiance may be wrong: bits of `flags`, as PlaneFlag. */
enum {
  LW_PLANE_UNSEEN_DIRECTION = 1 << 0,
  LW_PLANE_CLIPPED_DIRECTION = 1 << 1,
  LW_PLANE_UNSEEN_TEXEL = 1 << 2,
  LW_PLANE_CLIPPED_TEXEL = 1 << 3
};

/* ---- the reader ---- */

/* Release it with lw_plane_reader_release, which ignores NULL. */
LW_API lw_status lw_plane_reader_create(lw_plane_reader** out);
LW_API void lw_plane_reader_release(lw_plane_reader* reader);

/* One message (PlaneUpdate). received_ns: when it arrived, in the clock of lw_now_ns. LW_DATA_LOSS and
 * LW_INVALID_ARGUMENT name the field; then nothing has changed. Allocates. */
LW_API lw_status lw_plane_reader_take(lw_plane_reader* reader, const void* message, size_t length, int64_t received_ns);

/* The plane as received so far. Allocates if something has changed since the previous snapshot. */
LW_API lw_status lw_plane_reader_snapshot(lw_plane_reader* reader, int64_t now_ns, lw_plane* into);

/* As PlaneReaderStats. */
typedef struct lw_plane_reader_stats {
  uint32_t size;
  uint32_t reserved;
  uint64_t messages;
  uint64_t refused;
  uint64_t tiles;
  uint64_t tiles_unused;
} lw_plane_reader_stats;
LW_API lw_status lw_plane_reader_get_stats(const lw_plane_reader* reader, lw_plane_reader_stats* out);

/* Puts the newest complete state of the plane that the probe captures into `into`; LW_NONE without
 * lw_probe_options.plane. For render loops: lock-free, no allocation. As Probe::plane. */
LW_API lw_status lw_probe_plane(const lw_probe* probe, lw_plane* into);

/* ---- the plane ---- */

/* LW_NONE at first. Release it with lw_plane_release, which ignores NULL. */
LW_API lw_status lw_plane_create(lw_plane** out);
LW_API void lw_plane_release(lw_plane* plane);
/* Puts the same snapshot into another container. Does not allocate. */
LW_API lw_status lw_plane_copy(const lw_plane* plane, lw_plane* into);

typedef struct lw_plane_info {
  uint32_t size;
  lw_validity validity;
  int64_t age_ns;         /* Since the newest message. */
  uint64_t revision;      /* Of the newest update; 0: nothing was received, and all that follows is 0. */
  uint64_t missing_tiles; /* Tiles whose newest content has not arrived. */
  uint32_t capture;
  int32_t texture_edge;       /* Texels along a side; 0: the probe sends no texture. */
  int64_t mid_exposure_ns;    /* Of the newest frame that contributed, in the probe's clock. */
  double side;                /* Of the captured square, m. */
  double texture_position[2]; /* Similarity from the texture's frame to the plane's: translation, m, */
  double texture_rotation;    /* rotation from +X to +Y, rad, */
  double texture_scale;       /* and scale. */
  double position[3];         /* Of T_probe_plane, m. */
  double orientation[4];      /* Of T_probe_plane, x, y, z, w. */
  int32_t pose_known;         /* 0: position and orientation are zero. */
  lw_units units;
  float gloss_alpha; /* GGX alpha; -1: not known. */
  float f0;          /* Specular reflectance at normal incidence; -1: not known. */
} lw_plane_info;
LW_API lw_status lw_plane_get_info(const lw_plane* plane, lw_plane_info* out);

/* As PlaneAnswer. */
typedef struct lw_plane_answer {
  uint32_t size;
  lw_validity validity;
  float value[3]; /* Luminance in cd/m² if units are absolute. */
  uint32_t flags; /* LW_PLANE_*. */
  lw_units units;
  uint32_t reserved;
} lw_plane_answer;

/* Radiance from point[2] of the plane (x, y; m) towards eye[3] (m). Does not allocate, as the next two. */
LW_API lw_status lw_plane_radiance(const lw_plane* plane, const double* point, const double* eye,
                                   lw_plane_layers layers, lw_plane_answer* out);
/* The diffuse part at point[2]. */
LW_API lw_status lw_plane_diffuse(const lw_plane* plane, const double* point, lw_plane_answer* out);
/* The specular part towards to_viewer[3], which need not be normalised. */
LW_API lw_status lw_plane_specular(const lw_plane* plane, const double* to_viewer, lw_plane_answer* out);

/* As PlaneCamera: +X right, +Y up, -Z forward; the centre of the top left pixel is (0, 0). */
typedef struct lw_plane_camera {
  uint32_t size;
  int32_t width;
  int32_t height;
  uint32_t reserved; /* 0. */
  double fx;
  double fy;
  double cx;
  double cy;
  double position[3];    /* Of T_plane_camera, m. */
  double orientation[4]; /* Of T_plane_camera, x, y, z, w. All zero: the identity. */
} lw_plane_camera;

/* As PlaneRendering. */
typedef struct lw_plane_rendering {
  uint32_t size;
  lw_validity validity;
  uint32_t flags;
  uint32_t reserved;
  uint64_t pixels;
  uint64_t flagged;
} lw_plane_rendering;

/* Draws the plane as PlaneAppearance::render does. rgb: rgb_count floats, 3 width height. flags: NULL and 0, or
 * flag_count = width height bytes. `about` may be NULL. Does not allocate. */
LW_API lw_status lw_plane_render(const lw_plane* plane, const lw_plane_camera* camera, lw_plane_layers layers,
                                 float* rgb, size_t rgb_count, uint8_t* flags, size_t flag_count,
                                 lw_plane_rendering* about);

/* ---- guidance of the capture ---- */

/* As PlaneGuidanceOptions. 0 in a field is the default. */
typedef struct lw_plane_guidance_options {
  uint32_t size;
  uint32_t reserved;    /* 0. */
  double min_elevation; /* rad. Default: 10 degrees. */
  double min_seen;      /* Default: 0.9. */
  double max_gap;       /* rad. Default: 15 degrees. */
} lw_plane_guidance_options;

enum { LW_CAPTURE_KEEP_MOVING = 0, LW_CAPTURE_ENOUGH = 1 };

/* As PlaneGuidance. */
typedef struct lw_plane_guidance {
  uint32_t size;
  int32_t progress; /* LW_CAPTURE_*. */
  double seen;      /* Share of the directions that count, 0 to 1. */
  double gap;       /* Angle from `next` to the nearest seen direction, rad. */
  double next[3];   /* Where to move next: unit vector from the plane to the viewer; zero: all was seen. */
  double probe[3];  /* Where the newest frame that contributed was taken: unit vector; zero: not known, or behind. */
  double circle;    /* Radius on the unit disc of the circle of directions that count. */
} lw_plane_guidance;

/* `options` may be NULL. About 1 ms, allocates. */
LW_API lw_status lw_plane_get_guidance(const lw_plane* plane, const lw_plane_guidance_options* options,
                                       lw_plane_guidance* out);

/* For a drawing of the coverage: of each node of the hemisphere the position x, y on the unit disc (stereographic) and
 * whether it was seen (1) or not (0). xy: 2 capacity floats; seen: capacity bytes; both may be NULL if capacity is 0.
 * *count is the number of nodes, also where it is above capacity; then the first ones are written. */
LW_API lw_status lw_plane_coverage(const lw_plane* plane, float* xy, uint8_t* seen, size_t capacity, size_t* count);

#ifdef __cplusplus
}
#endif

#endif
