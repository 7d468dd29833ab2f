/* Light that varies in space, for C: LightField of field.hpp through the C ABI, with the rules of lightwell.h.
 * Meanings, limits and errors are documented at the types of the same names in field.hpp. Positions are in metres, in
 * the field's world (right-handed, +Y up). All functions and structs: since LW_ABI_VERSION 0x0001000a.
 *
 * The field itself is in a module, lightwell/lightwell_field.so beside liblightwell.so, which brings Ceres and Embree.
 * lw_light_field_create loads it; where it is missing, or of another version, LW_FAILED_PRECONDITION says so.
 *
 * Threads. One thread at a time changes a field (set, remove, set_geometry, update); any number of threads query it
 * meanwhile. Lights and probes are those of the last update.
 */
#ifndef LIGHTWELL_FIELD_H
#define LIGHTWELL_FIELD_H

#include <lightwell/lightwell.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lw_light_field lw_light_field;

/* As FieldOptions. 0 in a field is the default. */
typedef struct lw_light_field_options {
  uint32_t size;
  uint32_t reserved;
  int64_t max_age_ns;      /* Answers that rest on older samples are stale. Default: 1 s. */
  int64_t drop_age_ns;     /* Older samples take no part. Default: 60 s. */
  double typical_distance; /* m, over which light of unknown place changes by its own size. Default: 3. */
} lw_light_field_options;

/* Where and when a probe measured: as FieldSample, without its light. */
typedef struct lw_light_field_sample {
  uint32_t size;
  uint32_t reserved;
  double position[3];       /* T_world_probe. */
  double orientation[4];    /* Of it: x, y, z, w. All zero: the identity. */
  double position_sigma;    /* Standard deviation along each axis, m; less than 1 mm counts as 1 mm. */
  double orientation_sigma; /* About each axis, rad; less than 0.1 mrad counts as that. */
  int64_t mid_exposure_ns;  /* In the host's clock. 0: that of the lighting, which a decoded one does not have. */
} lw_light_field_sample;

/* As FieldState. */
typedef struct lw_light_field_state {
  uint32_t size;
  uint32_t light_count;
  uint32_t probe_count;
  lw_units units;
  uint64_t updates;
} lw_light_field_state;

/* As FieldLight. */
typedef struct lw_light_field_light {
  uint32_t size;
  uint32_t id;
  int32_t placed;                /* 0: distant. */
  uint32_t probes;               /* That saw it. */
  double position[3];            /* Of a placed light. */
  double position_covariance[6]; /* xx, xy, xz, yy, yz, zz, m²; of a placed light. */
  float direction[3];            /* Unit, towards the light; of a distant light. */
  float direction_sigma;         /* rad, in each tangent; of a distant light. */
  float intensity[3];            /* Placed: irradiance times m². Distant: irradiance at normal incidence. */
  float intensity_gradient[9];   /* r, g, b along x, then y, then z; of a placed light. */
  float radius;                  /* Placed: m. Distant: rad. */
  uint32_t reserved;
} lw_light_field_light;

typedef int32_t lw_light_field_probe_state; /* As FieldProbeState. */
enum {
  LW_LIGHT_FIELD_USED = 0,
  LW_LIGHT_FIELD_STALE = 1,
  LW_LIGHT_FIELD_EXPIRED = 2,
  LW_LIGHT_FIELD_WRONG_CLOCK = 3,
  LW_LIGHT_FIELD_WRONG_POSE = 4,
  LW_LIGHT_FIELD_WRONG_SCALE = 5,
  LW_LIGHT_FIELD_CONTRADICTED = 6
};

/* As FieldProbe; its name and the reason of its state: lw_light_field_probe_text. */
typedef struct lw_light_field_probe {
  uint32_t size;
  lw_light_field_probe_state state;
  double position[3];
  double scale;       /* Factor on its light that brings it to the common scale. */
  uint32_t lights;    /* That it reported, */
  uint32_t matched;   /* of which were matched with those of other probes, */
  uint32_t ambiguous; /* and fit several lights equally well. */
  uint32_t reserved;
} lw_light_field_probe;

typedef int32_t lw_light_field_text_kind;
enum { LW_LIGHT_FIELD_NAME = 0, LW_LIGHT_FIELD_REASON = 1 };

/* As FieldFlag: bits of lw_light_field_answer.field_flags. */
enum {
  LW_LIGHT_FIELD_ONE_PROBE = 1 << 0,
  LW_LIGHT_FIELD_FAR_FROM_PROBES = 1 << 1,
  LW_LIGHT_FIELD_CONTRADICTION = 1 << 2,
  LW_LIGHT_FIELD_AT_LIGHT = 1 << 3,
  LW_LIGHT_FIELD_OCCLUSION_UNKNOWN = 1 << 4
};

/* As FieldAnswer, without its light. */
typedef struct lw_light_field_answer {
  uint32_t size;
  lw_validity validity; /* LW_NONE without probes; LW_INVALID_QUERY for a position or normal that is no such. */
  int64_t age_ns;       /* As lw_lighting_info. */
  float error_bound;    /* As lw_answer: at 95 % confidence; infinite without a bound. */
  uint32_t flags;       /* LW_FLAG_*, of the probes. */
  uint32_t field_flags; /* LW_LIGHT_FIELD_*. */
  uint32_t reserved;
  double nearest_probe; /* m; infinite without probes. */
} lw_light_field_answer;

/* options: NULL for the defaults. Release *out with lw_light_field_release, which ignores NULL. The first call of a
 * process loads the module, which takes tens of milliseconds. LW_INVALID_ARGUMENT names the option. */
LW_API lw_status lw_light_field_create(const lw_light_field_options* options, lw_light_field** out);
LW_API void lw_light_field_release(lw_light_field* field);

/* As LightField::set: adds or replaces the sample of a probe, from the next update on. `lighting` is that of
 * lw_probe_latest, lw_probe_at or lw_lighting_decode: in the probe's frame. LW_FAILED_PRECONDITION for one without
 * light; LW_INVALID_ARGUMENT for a pose that is not finite, a negative sigma or an empty name; LW_RESOURCE_EXHAUSTED
 * for the 257th probe. */
LW_API lw_status lw_light_field_set(lw_light_field* field, const char* name, size_t name_length,
                                    const lw_lighting* lighting, const lw_light_field_sample* sample);
/* From the next update on. LW_NOT_FOUND if there is none of that name. */
LW_API lw_status lw_light_field_remove(lw_light_field* field, const char* name, size_t name_length);

/* As LightField::set_geometry: vertices are three floats each, vertex_stride bytes apart (0: 12), indices three for
 * each triangle; no indices remove it. Copied. */
LW_API lw_status lw_light_field_set_geometry(lw_light_field* field, const void* vertices, size_t vertex_stride,
                                             size_t vertex_count, const uint32_t* indices, size_t index_count);

/* As LightField::update: now_ns is lw_now_ns(). Blocks for milliseconds to a tenth of a second. `state` may be NULL. */
LW_API lw_status lw_light_field_update(lw_light_field* field, int64_t now_ns, lw_light_field_state* state);

/* Of the last update, into [0 .. capacity), of which each is the given bytes long; as lw_lighting_lights. */
LW_API lw_status lw_light_field_lights(const lw_light_field* field, lw_light_field_light* lights, size_t light_size,
                                       size_t capacity, size_t* count);
LW_API lw_status lw_light_field_probes(const lw_light_field* field, lw_light_field_probe* probes, size_t probe_size,
                                       size_t capacity, size_t* count);
/* Of the probe at `index` of lw_light_field_probes; as lw_probe_text. LW_NOT_FOUND if there is none. */
LW_API lw_status lw_light_field_probe_text(const lw_light_field* field, size_t index, lw_light_field_text_kind kind,
                                           char* text, size_t capacity, size_t* length);

/* As LightField::at: the lighting at position[3], in the world's axes; its origin is the point. `into` or `about` may
 * be NULL. LW_OK with LW_NONE without probes, with LW_INVALID_QUERY for a position that is not finite. */
LW_API lw_status lw_light_field_at(const lw_light_field* field, const double* position, int64_t now_ns,
                                   lw_lighting* into, lw_light_field_answer* about);

/* Irradiance of `count` flat receivers, positions (three doubles, position_stride bytes apart, 0: 24) and normals
 * (three floats, 0: 12), as three floats each (0: 12), and what an answer says of each, answer_size (sizeof) bytes
 * apart; `answers` may be NULL. Equal positions in a row cost one query. If another thread updates the field meanwhile,
 * some points have the light of before. A receiver that is none has the value zero. */
LW_API lw_status lw_light_field_irradiance(const lw_light_field* field, const void* positions, size_t position_stride,
                                           const void* normals, size_t normal_stride, size_t count, int64_t now_ns,
                                           float* values, size_t value_stride, lw_light_field_answer* answers,
                                           size_t answer_size);

#ifdef __cplusplus
}
#endif
#endif
