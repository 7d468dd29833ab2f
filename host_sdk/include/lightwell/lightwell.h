/* A probe, for any language that can call C: the C ABI of liblightwell.so, in C99 and C++.
 *
 * Meanings are documented in probe.hpp and lighting.hpp, where types and functions have the same names. Directions and
 * normals are in the probe's frame (right-handed, +X right, +Y up, -Z forward) unless lw_lighting_rotated, and need not
 * be normalised. Colour is linear Rec. 709, D65, three floats r, g, b. The luminance of radiance is in cd/m² and of
 * irradiance in lux if units are absolute.
 *
 * Sizes. Every struct begins with `size`. Set it to sizeof(the struct) before each call, also if the library fills the
 * struct: lw_answer a = {.size = sizeof a}. The library accesses no byte beyond it. Fields that a shorter struct of an
 * older header lacks count as not set. In a longer struct of a newer header, the library sets unknown fields of a
 * result to zero, and refuses an input whose unknown fields are not zero. New fields are added at the end; zero means
 * the former behaviour.
 *
 * Errors. Functions return a status. If it is not LW_OK, they have changed nothing, with one exception: structs with a
 * `validity` are LW_INVALID_QUERY and hold zeros. No C++ exception crosses this interface. lw_last_error says what is
 * wrong and what to do.
 *
 * Handles are opaque. NULL, a handle of the other type and most invalid pointers are LW_INVALID_ARGUMENT; a released
 * handle is not always detected.
 *
 * Threads. Any thread may call any function concurrently, with two exceptions: a handle is released only while no
 * other call uses it, and while a function fills an lw_lighting (`into`), no other call uses that lw_lighting. No
 * function blocks unless this is stated.
 */
#ifndef LIGHTWELL_LIGHTWELL_H
#define LIGHTWELL_LIGHTWELL_H

#include <stddef.h>
#include <stdint.h>

#include <lightwell/export.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of this header. The upper 16 bits (and the SONAME) change with incompatible changes, the lower 16 with additions. */
#define LW_ABI_VERSION 0x0001000a

#define LW_ZERO_TERMINATED SIZE_MAX /* As a length: the text ends with a zero byte. */

#define LW_MAX_BAND 6
#define LW_MAX_COEFFICIENTS 49
#define LW_MAX_LIGHTS 64
#define LW_MAX_ENVIRONMENT_LEVELS 8

typedef int32_t lw_status; /* As StatusCode of result.hpp. */
enum {
  LW_OK = 0,
  LW_INVALID_ARGUMENT = 1,
  LW_NOT_FOUND = 2,
  LW_DATA_LOSS = 3,
  LW_FAILED_PRECONDITION = 4,
  LW_UNAVAILABLE = 5,
  LW_RESOURCE_EXHAUSTED = 6,
  LW_INTERNAL = 7
};

typedef int32_t lw_validity; /* Whether an answer can be used. */
enum {
  LW_VALID = 0,
  LW_STALE = 1,          /* The values were measured, but are or may be older than lw_probe_options.max_age_ns. */
  LW_NONE = 2,           /* No descriptor has been received yet; the value is zero. */
  LW_BEFORE_HISTORY = 3, /* The requested time is before the oldest stored descriptor; the value is zero. */
  LW_INVALID_QUERY = 4   /* An argument is not a direction, roughness or rotation; the value is zero. */
};

typedef int32_t lw_units; /* Relative: proportional to cd/m² and lux by one unknown factor. */
enum { LW_RELATIVE = 1, LW_ABSOLUTE = 2 };

/* Conditions under which a value may be wrong: bits of `flags`. */
enum {
  LW_FLAG_UNSEEN = 1 << 1,  /* A part of the sphere was never seen; its light is missing. */
  LW_FLAG_CLIPPED = 1 << 2, /* Pixels saturated in every exposure; their energy is a lower bound. */
  LW_FLAG_CLEANED = 1 << 3, /* The input had NaN, infinite or negative radiance, which was replaced. */
  LW_FLAG_DARK = 1 << 4,    /* Only darkness: there is no relative error. */
  LW_FLAG_MOVED = 1 << 5,   /* Something moved within a bracket, or changed where an interleaved frame was not read. */
  LW_FLAG_FILLED = 1 << 6,  /* Directions that no pixel sees were filled by choice; the bound excludes them. */
  LW_FLAG_RECOVERED = 1 << 7, /* The energy of saturated pixels was recovered. */
  LW_FLAG_UNSURE = 1 << 8     /* Several lights fit: the direction of the strongest is uncertain or unknown. */
};
/* A flag of the probe that this version does not know. No enumerator: in C those are of type int. */
#define LW_FLAG_NEWER 0x80000000

typedef struct lw_probe lw_probe;
typedef struct lw_lighting lw_lighting;

/* ---- the library ---- */

/* LW_ABI_VERSION of the loaded library. It is compatible with applications that were compiled with the same upper 16
 * bits; functions of a higher lower half are missing. */
LW_API uint32_t lw_abi_version(void);
LW_API const char* lw_version(void); /* "0.1.0". */

/* Message of the last failed call on this thread, empty if there was none: UTF-8, zero-terminated, at most 1023 bytes.
 * *length (may be NULL) is its length without the zero. Valid until the next failure on this thread. */
LW_API const char* lw_last_error(size_t* length);

/* Static strings, "invalid_argument", "stale"; "unknown" for other values. */
LW_API const char* lw_status_name(lw_status status);
LW_API const char* lw_validity_name(lw_validity validity);

/* CLOCK_MONOTONIC of this machine, ns: the clock of lw_probe_at and of all times of the host. */
LW_API int64_t lw_now_ns(void);

/* ---- the probe ---- */

/* As ProbeOptions. 0 in a field is the default. */
typedef struct lw_probe_options {
  uint32_t size;
  int32_t history;            /* Descriptors stored for lw_probe_at, 1 to 4096. Default: 64. */
  int64_t max_age_ns;         /* Older answers are stale. Default: 250 ms. */
  int64_t extrapolation_ns;   /* How far beyond the newest lw_probe_at extrapolates. Default: 50 ms; -1: not at all. */
  int64_t connect_timeout_ns; /* Default: 2 s. */
  int64_t retry_min_ns;       /* First pause after a lost connection. Default: 100 ms. */
  int64_t retry_max_ns;       /* Longest pause. Default: 0.5 s. */
  int64_t silence_limit_ns;   /* Reconnects if nothing arrives for this long. Default: 4 s. */
  /* Strings end with a zero byte and are copied; NULL: none. As ProbeCredentials and MqttCredentials. */
  const char* credentials_folder; /* grpcs: as written by `lightwell pair`. Default: looked up by address. */
  const char* mqtt_ca_file;
  const char* mqtt_certificate_file;
  const char* mqtt_key_file;
  const char* mqtt_user;
  const char* mqtt_password;
  int32_t plane;    /* 1: receives captured planes, for lw_probe_plane (plane_appearance.h). Default: 0. */
  int32_t reserved; /* 0. */
} lw_probe_options;

/* As ProbeInfo and Counters: since the start of the daemon. */
typedef struct lw_probe_info {
  uint32_t size;
  uint32_t id;
  uint32_t calibration_id;
  uint32_t clients;
  int64_t clock_offset_ns;      /* The probe's clock minus the host's. */
  int64_t clock_uncertainty_ns; /* Maximum error of the offset. */
  double clock_drift_ppm;       /* Drift of the probe's clock against the host's. */
  uint64_t frames;
  uint64_t captures_dropped;
  uint64_t brackets_incomplete;
  uint64_t estimates;
  uint64_t estimates_failed;
  uint64_t descriptors_coalesced;
  uint64_t frames_recorded;
  uint64_t recording_faults;
  uint64_t frames_lost;
  uint64_t setting_moves;
  uint64_t estimates_late;
  uint64_t estimates_late_at_fast;
  uint64_t messages_refused;
  uint64_t authentication_failures;
  int32_t mounted; /* 1: the pose of the probe in its room is known. 0: position and orientation are zero. */
  int32_t reserved;
  double position[3];    /* Of T_world_probe, m. */
  double orientation[4]; /* Of T_world_probe, x, y, z, w. */
  uint64_t client_list_faults;
} lw_probe_info;

typedef int32_t lw_link_state; /* As LinkState. */
enum { LW_LINK_CONNECTING = 0, LW_LINK_CONNECTED = 1, LW_LINK_WAITING = 2, LW_LINK_ENDED = 3, LW_LINK_GONE = 4 };

/* As LinkStats: since lw_probe_connect. */
typedef struct lw_link_stats {
  uint32_t size;
  lw_link_state state;
  uint64_t received;
  uint64_t bytes;
  uint64_t gaps;
  uint64_t oversized;
  uint64_t undecodable;
  uint64_t replayed;
  uint64_t reconnects;
  uint64_t maps;
  uint64_t maps_without_key;
  uint64_t frames_lost;
  uint64_t frames_refused;
  uint64_t untimely;
} lw_link_stats;

/* Meanings and defaults: proto/lightwell/v1/config.proto. Fields of the estimator that is not active must have their
 * defaults, otherwise LW_INVALID_ARGUMENT. */
typedef struct lw_estimator_config {
  uint32_t size;
  int32_t band;             /* 0 to 6. */
  int32_t max_lights;       /* 0 to 64. */
  int32_t setting;          /* 1 fast, 2 balanced, 3 exact, 4 fastest (since LW_ABI_VERSION 0x00010008). */
  int32_t unseen;           /* From here on, of the panorama estimator only. 1 none, 2 mirror, 3 average. */
  int32_t smoothing;        /* 1 none, 2 the 1 euro filter. */
  int32_t environment_edge; /* 0, 8, 16, 32 or 64. */
  int32_t reserved;         /* 0. */
  double light_threshold;
  double epsilon;
  double radiance_epsilon;
  double environment_rate;
  double marker_decimation; /* From here on, of the marker estimator only. 0, or 1 to 8. */
  double marker_search_decimation;
  int32_t marker_max_faces;
  int32_t specular_environment_edge; /* Of the specular estimator only. 0, 8, 16, 32 or 64. */
  int32_t interleave;                /* Of the panorama estimator only. 1 to 16. Since LW_ABI_VERSION 0x00010008. */
  int32_t max_bytes; /* Of the panorama estimator only. 0, or at least 96. Since LW_ABI_VERSION 0x00010009. */
} lw_estimator_config;

/* Fields of lw_estimator_config, for lw_probe_change_estimator. */
enum {
  LW_FIELD_BAND = 1 << 0,
  LW_FIELD_MAX_LIGHTS = 1 << 1,
  LW_FIELD_SETTING = 1 << 2,
  LW_FIELD_UNSEEN = 1 << 3,
  LW_FIELD_SMOOTHING = 1 << 4,
  LW_FIELD_ENVIRONMENT_EDGE = 1 << 5,
  LW_FIELD_LIGHT_THRESHOLD = 1 << 6,
  LW_FIELD_EPSILON = 1 << 7,
  LW_FIELD_RADIANCE_EPSILON = 1 << 8,
  LW_FIELD_ENVIRONMENT_RATE = 1 << 9,
  LW_FIELD_MARKER_DECIMATION = 1 << 10,
  LW_FIELD_MARKER_SEARCH_DECIMATION = 1 << 11,
  LW_FIELD_MARKER_MAX_FACES = 1 << 12,
  LW_FIELD_SPECULAR_ENVIRONMENT_EDGE = 1 << 13,
  LW_FIELD_INTERLEAVE = 1 << 14,
  LW_FIELD_MAX_BYTES = 1 << 15
};

typedef int32_t lw_estimator_kind; /* What light is estimated from. */
enum {
  LW_ESTIMATOR_PANORAMA = 1, /* A panoramic view of the surroundings. */
  LW_ESTIMATOR_MARKER = 2,   /* The shading of a marker in view. */
  LW_ESTIMATOR_SPECULAR = 3  /* The mirror image of the surroundings in a glossy plane. */
};

typedef int32_t lw_probe_text_kind; /* Strings of a probe, for lw_probe_text. */
enum {
  LW_PROBE_NAME = 0,
  LW_PROBE_VERSION = 1, /* Of its firmware. */
  LW_PROBE_CAMERA = 2,
  LW_PROBE_LAST_ERROR = 3 /* Of the link, or of the last rejected message; empty if there was none. */
};

/* As Probe::connect: URIs are `grpc://host:port`, `grpcs://` with TLS, `ws://host:port` (WebSocket), `wss://`,
 * `usb:SERIAL`, `mqtt://broker/venue/probe`, `mqtts://` and `replay:PATH` (`?speed=2`, `?speed=0`). options: NULL for
 * the defaults. Release *out with lw_probe_close. Blocks, at most connect_timeout_ns. LW_INVALID_ARGUMENT names what is
 * wrong in the URI or the options. LW_UNAVAILABLE: no response. LW_NOT_FOUND, LW_DATA_LOSS: the recording, or a file of
 * credentials. */
LW_API lw_status lw_probe_connect(const char* uri, size_t uri_length, const lw_probe_options* options, lw_probe** out);

/* Closes the connection and joins its thread; blocks for less than a second. Lightings stay valid. Ignores NULL. */
LW_API void lw_probe_close(lw_probe* probe);

/* The newest lighting. For render threads: lock-free, no allocation, independent of the reader thread. LW_OK with
 * LW_NONE before the first descriptor. */
LW_API lw_status lw_probe_latest(const lw_probe* probe, lw_lighting* into);

/* The same in the frame of the probe's room, by its mounting (lw_probe_info.mounted), whose uncertainty is added as in
 * Lighting::in_world. LW_OK with LW_INVALID_QUERY if the mounting is not known. About 20 µs, allocates: call it once
 * per frame. For another world frame: lw_lighting_in_world. */
LW_API lw_status lw_probe_latest_in_world(const lw_probe* probe, lw_lighting* into);

/* As Probe::at: the lighting at `host_time_ns` (of lw_now_ns), interpolated, extrapolated or held
 * (lw_lighting_info.derivation); LW_BEFORE_HISTORY before the oldest stored descriptor. Lock-free, allocates. */
LW_API lw_status lw_probe_at(const lw_probe* probe, int64_t host_time_ns, lw_lighting* into);

/* Waits for a newest descriptor with a sequence number other than *seen (NULL: any). Blocks. LW_UNAVAILABLE after
 * timeout_ns, LW_FAILED_PRECONDITION if the recording has ended. */
LW_API lw_status lw_probe_wait_for_next(const lw_probe* probe, const uint64_t* seen, int64_t timeout_ns,
                                        lw_lighting* into);

/* Block briefly. */
LW_API lw_status lw_probe_get_info(const lw_probe* probe, lw_probe_info* out);
LW_API lw_status lw_probe_get_stats(const lw_probe* probe, lw_link_stats* out);

/* Into text[0 .. capacity): UTF-8, zero-terminated if capacity is not 0, truncated between two characters. *length (may
 * be NULL) is the whole length without the zero. Blocks briefly. */
LW_API lw_status lw_probe_text(const lw_probe* probe, lw_probe_text_kind kind, char* text, size_t capacity,
                               size_t* length);

/* Fills `config` with the defaults of a probe. */
LW_API lw_status lw_estimator_config_defaults(lw_estimator_config* config);

/* The current configuration, by the probe's file and all clients, and the active estimator. Block as
 * lw_probe_change_estimator. LW_FAILED_PRECONDITION for a recording, over MQTT, and if the probe's firmware is too old
 * to report it. Since LW_ABI_VERSION 0x00010001. */
LW_API lw_status lw_probe_get_estimator(const lw_probe* probe, lw_estimator_config* config);
LW_API lw_status lw_probe_get_estimator_kind(const lw_probe* probe, lw_estimator_kind* kind);

/* Sets the fields of `fields`, LW_FIELD_EPSILON | LW_FIELD_BAND, for all clients of the probe, and leaves the others
 * unchanged: these are not read here. Takes effect with the probe's next capture. Blocks until the probe responds, at
 * most connect_timeout_ns. LW_INVALID_ARGUMENT: a value, an unknown bit, or no bit. LW_FAILED_PRECONDITION for a
 * recording and over MQTT; otherwise the probe's error. Since LW_ABI_VERSION 0x00010001. */
LW_API lw_status lw_probe_change_estimator(lw_probe* probe, const lw_estimator_config* config, uint64_t fields);
/* The same for all fields: replaces what the probe's file or other clients have set. */
LW_API lw_status lw_probe_set_estimator(lw_probe* probe, const lw_estimator_config* config);

/* Reports the reading of a lux meter beside the probe that faces normal[3]: from then on its units are absolute.
 * *factor (may be NULL) is the factor that was applied to radiance. Blocks and fails as lw_probe_change_estimator. */
LW_API lw_status lw_probe_report_lux(lw_probe* probe, double lux, const float* normal, double* factor);

/* ---- the lighting ---- */

/* A container for the lighting of one moment, LW_NONE at first. Create it once and fill it every frame, which does not
 * allocate. Release it with lw_lighting_release, which ignores NULL. */
LW_API lw_status lw_lighting_create(lw_lighting** out);
LW_API void lw_lighting_release(lw_lighting* lighting);

/* Puts the same lighting into another container, for another thread to keep: filling either one later does not change
 * the other. Does not allocate. */
LW_API lw_status lw_lighting_copy(const lw_lighting* lighting, lw_lighting* into);

/* Decodes the bytes of a LightingDescriptor that was not received by a probe. Stale if age_ns is above 250 ms.
 * LW_DATA_LOSS and LW_INVALID_ARGUMENT name the field. */
LW_API lw_status lw_lighting_decode(const void* bytes, size_t length, int64_t age_ns, lw_lighting* into);

/* The same lighting in a frame rotated by the quaternion q[4] (x, y, z, w), p_new = q p_old. `into` may be `lighting`.
 * LW_OK with LW_INVALID_QUERY if q is zero or not finite. About 20 µs, allocates. */
LW_API lw_status lw_lighting_rotated(const lw_lighting* lighting, const double* q, lw_lighting* into);

/* As lw_lighting_rotated, and the origin and the positions of lights move: p_new = q p_old + position[3] (m), such as
 * T_world_probe. LW_INVALID_QUERY also if the position is not finite. Since LW_ABI_VERSION 0x00010002. */
LW_API lw_status lw_lighting_in_world(const lw_lighting* lighting, const double* position, const double* q,
                                      lw_lighting* into);

typedef int32_t lw_derivation; /* As Derivation. */
enum { LW_MEASURED = 0, LW_INTERPOLATED = 1, LW_EXTRAPOLATED = 2, LW_HELD = 3 };

typedef struct lw_lighting_info {
  uint32_t size;
  lw_validity validity;
  int64_t age_ns;             /* As Lighting::age. */
  const char* reason;         /* Why it is not valid: static string, empty if it is. */
  int64_t age_uncertainty_ns; /* Maximum error of age_ns; stale if the age can exceed max_age_ns within it. */
  uint64_t sequence;
  int64_t mid_exposure_ns;       /* In the host's clock; 0 if there is none. */
  int64_t received_ns;           /* In the host's clock; 0 if there is none. */
  int64_t probe_mid_exposure_ns; /* In the probe's clock. */
  int64_t delivered_after_ns;    /* From mid-exposure to the delivery by the camera. */
  int64_t encoded_after_ns;      /* From mid-exposure to the encoded bytes. */
  uint64_t encoded_bytes;        /* Size of the received message. */
  lw_units units;
  uint32_t flags;
  float bound_total; /* As lw_answer.error_bound; its parts follow. */
  float bound_truncation;
  float bound_sampling;
  float bound_noise;
  float bound_quantization;
  float bound_smoothing;
  float coverage;  /* Fraction of the sphere that at least one pixel sees. */
  float saturated; /* Fraction of the seen part that is saturated in every exposure. */
  int32_t band;
  uint32_t light_count;
  uint32_t probe_id;
  uint32_t calibration_id;
  int32_t setting; /* 1 fast, 2 balanced, 3 exact, 4 fastest. */
  int32_t flicker; /* 0 unknown, 1 none, 2 100 Hz, 3 120 Hz. */
  lw_derivation derivation;
  int32_t reserved;
  double origin_position[3];    /* Where the light holds, m, in the lighting's frame: 0 of a probe, else of a marker. */
  double origin_orientation[4]; /* Of a marker's axes, x, y, z, w. It turns no direction. */
} lw_lighting_info;

LW_API lw_status lw_lighting_get_info(const lw_lighting* lighting, lw_lighting_info* out);

/* Why the lighting is not valid, with numbers ("300 ms from the nearest descriptor ..."); empty if it is. As
 * lw_probe_text, but does not block. */
LW_API lw_status lw_lighting_reason(const lw_lighting* lighting, char* text, size_t capacity, size_t* length);

/* A value with its validity, age and error bound. */
typedef struct lw_answer {
  uint32_t size;
  lw_validity validity;
  int64_t age_ns;          /* As lw_lighting_info. */
  const char* reason;      /* As lw_lighting_info. */
  float value[3];          /* r, g, b. Zero for a batch. */
  float error_bound;       /* RMS over normals relative to the RMS irradiance, 0.01 is 1 %; infinite without a bound. */
  uint32_t flags;          /* LW_FLAG_*. */
  int32_t lights_included; /* 0 for radiance at roughness 0, which excludes the discrete lights; otherwise 1. */
  lw_units units;
  uint32_t refused; /* Number of invalid inputs of a batch: their values are zero, and validity is LW_INVALID_QUERY. */
} lw_answer;

/* As Lighting::irradiance: of a flat receiver that faces normal[3], not divided by pi, not clamped. LW_OK with
 * LW_INVALID_QUERY for a normal that is zero, NaN or infinite. */
LW_API lw_status lw_lighting_irradiance(const lw_lighting* lighting, const float* normal, lw_answer* out);

/* As Lighting::radiance: from direction[3], as reflected by a surface of that perceptual roughness. */
LW_API lw_status lw_lighting_radiance(const lw_lighting* lighting, const float* direction, float roughness,
                                      lw_answer* out);

/* Batches of `count`; irradiance differs from lw_lighting_irradiance by at most 1e-5 of the largest. Inputs and values
 * are three floats each, *_stride bytes apart (0: 12; otherwise at least 12). Values may overwrite the inputs if both
 * strides are the same. `about` may be NULL. */
LW_API lw_status lw_lighting_irradiance_batch(const lw_lighting* lighting, const float* normals, size_t normal_stride,
                                              size_t count, float* values, size_t value_stride, lw_answer* about);
LW_API lw_status lw_lighting_radiance_batch(const lw_lighting* lighting, const float* directions,
                                            size_t direction_stride, size_t count, float roughness, float* values,
                                            size_t value_stride, lw_answer* about);

typedef int32_t lw_quantity;
/* Irradiance: radiance times A_l = pi, 2 pi/3, pi/4, 0, -pi/24, 0, pi/64. */
enum { LW_RADIANCE = 0, LW_IRRADIANCE = 1 };

/* Spherical harmonics without the lights: real, orthonormal, WITHOUT the Condon-Shortley phase (all constants
 * positive), r, g, b of each function, in the order l(l+1)+m, band 1 as y, z, x. Writes exactly 3 (max_band + 1)²
 * floats, max_band 0 to 6: zeros above the lighting's own band, which is written to *band (may be NULL). */
LW_API lw_status lw_lighting_harmonics(const lw_lighting* lighting, lw_quantity quantity, int32_t max_band,
                                       float* coefficients, int32_t* band);

/* A detected light (lamp, sun, window): a spherical cap of uniform radiance. */
typedef struct lw_light {
  uint32_t size;
  uint32_t track;                /* Identity over time: the same light keeps its track. 0: not tracked. */
  float direction[3];            /* Unit, TOWARDS the light. */
  float irradiance[3];           /* At normal incidence: magnitude of the vector irradiance of the cap. */
  float angular_radius;          /* rad. */
  float direction_covariance[3]; /* u·u, u·v, v·v in rad², in the tangent basis of proto/README.md. */
  float distance;                /* From the origin, m. 0: distant or not known; then distance_sigma, position are 0. */
  float distance_sigma;          /* Standard deviation of the distance, m. */
  float position[3];             /* m, in the lighting's frame, as origin_position. */
} lw_light;

/* Strongest first, into lights[0 .. capacity), which are light_size (sizeof(lw_light)) bytes apart; the library sets
 * their `size`. *count is the number of all lights, even if capacity is less. */
LW_API lw_status lw_lighting_lights(const lw_lighting* lighting, lw_light* lights, size_t light_size, size_t capacity,
                                    size_t* count);

/* The prefiltered environment map for reflections, without the lights: octahedral squares, as EnvironmentMap of
 * environment.hpp. */
typedef struct lw_environment {
  uint32_t size;
  uint32_t level_count; /* 0: there is no map. */
  uint64_t sequence;    /* Of the descriptor with the map: upload the map when this changes. */
  int64_t older_by_ns;  /* Mid-exposure of the lighting's descriptor minus that of the map's descriptor. */
  double rotation[4];   /* x, y, z, w; p_lighting = rotation p_map. */
  uint32_t key;         /* Of the whole map. */
  int32_t exponent;     /* Radiance is the RGB9E5 texel times 2^exponent. */
  uint32_t edge[8];     /* Texels along the edge of each level. */
  float roughness[8];   /* Perceptual, increasing. */
} lw_environment;

LW_API lw_status lw_lighting_environment(const lw_lighting* lighting, lw_environment* out);

/* One level, rows from the top: as radiance, 3 edge² floats, and as RGB9E5 texels (the layout of GL_RGB9_E5 and
 * VK_FORMAT_E5B9G9R9_UFLOAT_PACK32) without the factor 2^exponent, edge² numbers. LW_INVALID_ARGUMENT if `capacity`
 * (numbers) is less, or there is no such level. */
LW_API lw_status lw_lighting_environment_radiance(const lw_lighting* lighting, uint32_t level, float* rgb,
                                                  size_t capacity);
LW_API lw_status lw_lighting_environment_texels(const lw_lighting* lighting, uint32_t level, uint32_t* texels,
                                                size_t capacity);

#ifdef __cplusplus
}
#endif
#endif
