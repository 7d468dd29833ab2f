/* A probe, for any language that can call C: the C ABI of liblightwell.so.
 *   conventions of this interface   sizes, status, text, threads
 *   lw_abi_version, lw_last_error   of the library; of this thread's last call that failed
 *   lw_probe                        the connection: latest, at, wait_for_next, info, stats, get_estimator,
 *                                   change_estimator, set_estimator, report_lux
 *   lw_lighting                     an answer: irradiance, radiance, harmonics, lights, the map for reflections
 *
 * C99 and C++. What the numbers mean stands in probe.hpp and lighting.hpp, of which this is a face: directions and
 * normals are in the probe's frame (right-handed, +X right, +Y up, -Z forward) unless turned by lw_lighting_rotated,
 * and need not be normalised; colour is linear Rec. 709, D65, three floats r, g, b; the luminance of radiance is in
 * cd/m² and of irradiance in lux where units are absolute.
 *
 * Sizes. Every struct begins with `size`. Set it to sizeof(the struct) before each call, also where the library
 * fills the struct: lw_answer a = {.size = sizeof a}. The library reads and writes no byte beyond it. An application
 * that was compiled against an older header has shorter structs: what they lack counts as not set. One that was
 * compiled against a newer header has longer ones: the library fills what it does not know with zeros, and refuses a
 * question whose unknown part is not zero, because it asks for something that the library cannot do. New fields come at
 * the end and mean by zero what was so before.
 *
 * Failure. Functions return a status, and on anything but LW_OK change nothing that they were given, with one
 * exception: structs that have a `validity` say LW_INVALID_QUERY and hold zeros, so that no old light is taken for an
 * answer. No C++ exception crosses this interface. lw_last_error says what was wrong and what to do.
 *
 * Handles are opaque. NULL, a handle of the other kind, and most of what is no handle is answered by
 * LW_INVALID_ARGUMENT; a handle that was given back is not always recognised.
 *
 * Threads. Any thread may call any function at any time, with two exceptions: a handle is given back when no other
 * call that names it is under way; and while a function fills an lw_lighting (`into`), no other call names that
 * lw_lighting. Many threads may ask one lw_lighting, or one lw_probe, at once. No function blocks unless it says so.
 */
#ifndef LIGHTWELL_LIGHTWELL_H
#define LIGHTWELL_LIGHTWELL_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__) && !defined(_WIN32)
#define LW_API __attribute__((visibility("default")))
#else
#define LW_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Of this header: the upper 16 bits change where an older application would be wrong (and the SONAME with them), the
 * lower 16 where something was added. */
#define LW_ABI_VERSION 0x00010001

/* In the place of a length: the text ends with a zero byte. */
#define LW_ZERO_TERMINATED SIZE_MAX

/* Coefficients of bands 0 to 6. */
#define LW_MAX_BAND 6
#define LW_MAX_COEFFICIENTS 49
#define LW_MAX_LIGHTS 64
#define LW_MAX_ENVIRONMENT_LEVELS 8

typedef int32_t lw_status;
enum {
  LW_OK = 0,
  LW_INVALID_ARGUMENT = 1,    /* The caller's input can never work; the message names what. */
  LW_NOT_FOUND = 2,           /* A file or a probe that is not there. */
  LW_DATA_LOSS = 3,           /* Input is truncated or damaged. */
  LW_FAILED_PRECONDITION = 4, /* Not now: the message says what must come first. */
  LW_UNAVAILABLE = 5,         /* The probe is away; trying again may work. */
  LW_RESOURCE_EXHAUSTED = 6,  /* A cap, memory. */
  LW_INTERNAL = 7             /* A defect of the library or of one below. */
};

/* May an answer be used? */
typedef int32_t lw_validity;
enum {
  LW_VALID = 0,
  LW_STALE = 1,          /* The numbers are real but older than lw_probe_options.max_age_ns. */
  LW_NONE = 2,           /* No descriptor has come yet; the value is zero. */
  LW_BEFORE_HISTORY = 3, /* The moment asked for lies before the oldest kept; the value is zero. */
  LW_INVALID_QUERY = 4   /* The question was no direction, roughness or rotation; the value is zero. */
};

typedef int32_t lw_units;
enum {
  LW_RELATIVE = 1, /* Proportional to cd/m² and lux by one unknown factor. */
  LW_ABSOLUTE = 2
};

/* Why a value may be wrong all the same: bits of `flags`. */
enum {
  LW_FLAG_UNSEEN = 1 << 1,    /* A part of the sphere was never seen; its light is missing. */
  LW_FLAG_CLIPPED = 1 << 2,   /* Pixels saturated in every exposure; their energy is a lower bound. */
  LW_FLAG_CLEANED = 1 << 3,   /* The input held NaN, infinite or negative radiance, which was replaced. */
  LW_FLAG_DARK = 1 << 4,      /* Nothing but darkness: no relative error can be stated. */
  LW_FLAG_MOVED = 1 << 5,     /* Something moved between the exposures of a bracket. */
  LW_FLAG_FILLED = 1 << 6,    /* What no pixel sees was filled in by choice; no bound speaks of it. */
  LW_FLAG_RECOVERED = 1 << 7, /* The energy of saturated pixels was recovered from a reading. */
  LW_FLAG_UNSURE =
      1 << 8 /* What was seen fits several lights: the strongest's direction is not known well, or at all. */
};
/* The probe gave a reason that this version has no name for. No enumerator: in C those are of type int. */
#define LW_FLAG_NEWER 0x80000000

typedef struct lw_probe lw_probe;
typedef struct lw_lighting lw_lighting;

/* ---- the library ---- */

/* LW_ABI_VERSION of the library that is running. It serves an application compiled with an LW_ABI_VERSION whose upper
 * 16 bits are the same; functions of a higher lower half are missing. */
LW_API uint32_t lw_abi_version(void);

/* "0.1.0", for people. */
LW_API const char* lw_version(void);

/* What was wrong with the last call on this thread that did not return LW_OK, for the person who has to mend it; empty
 * where there was none. UTF-8, zero-terminated, at most 1023 bytes; its length without the zero where `length` is not
 * NULL. Lives until the next failure on this thread. */
LW_API const char* lw_last_error(size_t* length);

/* "invalid_argument", "stale", and "unknown" for what is none. Live for ever. */
LW_API const char* lw_status_name(lw_status status);
LW_API const char* lw_validity_name(lw_validity validity);

/* CLOCK_MONOTONIC of this machine, ns: the clock of lw_probe_at and of all times of the host. */
LW_API int64_t lw_now_ns(void);

/* ---- the probe ---- */

/* How a probe is followed. 0 in a field is the default. The cost of each is told at ProbeOptions of probe.hpp. */
typedef struct lw_probe_options {
  uint32_t size;
  int32_t history;          /* Descriptors kept for lw_probe_at, 1 to 4096. Default: 64. */
  int64_t max_age_ns;       /* Older answers are stale. Default: 250 ms. */
  int64_t extrapolation_ns; /* How far beyond the newest lw_probe_at moves lights on. Default: 50 ms; -1: not at all. */
  int64_t connect_timeout_ns; /* How long connecting tries. Default: 2 s. */
  int64_t retry_min_ns;       /* First pause after a lost link. Default: 100 ms. */
  int64_t retry_max_ns;       /* Longest pause. Default: 0.5 s. */
  int64_t silence_limit_ns;   /* A probe silent for so long is given up and looked for anew. Default: 4 s. */
  /* Texts end with a zero byte and are copied; NULL: none. More at ProbeCredentials and MqttCredentials. */
  const char*
      credentials_folder;   /* grpcs: of one probe, as `lightwell pair` writes it. Default: looked up by address. */
  const char* mqtt_ca_file; /* mqtts: of the authorities that may have signed the broker's certificate, PEM. */
  const char* mqtt_certificate_file; /* Our own certificate and its key, PEM: both or neither. */
  const char* mqtt_key_file;
  const char* mqtt_user;
  const char* mqtt_password;
} lw_probe_options;

/* Since the start of the daemon, as the probe counts. */
typedef struct lw_probe_info {
  uint32_t size;
  uint32_t id;
  uint32_t calibration_id;
  uint32_t clients;
  int64_t clock_offset_ns;      /* The probe's clock less the host's. */
  int64_t clock_uncertainty_ns; /* The true offset is within this of it. */
  double clock_drift_ppm;       /* How fast the probe's clock gains on the host's, in millionths. */
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
  uint64_t messages_refused;        /* Requests that were no message, too large for one, or never came whole. */
  uint64_t authentication_failures; /* Calls without a token or certificate that is good. */
  int32_t mounted;                  /* 1: the probe knows where in its room it hangs. 0: what follows is zero. */
  int32_t reserved;
  double position[3];          /* T_world_probe, m, */
  double orientation[4];       /* and x, y, z, w. */
  uint64_t client_list_faults; /* How often the probe's file of clients was changed into one with a mistake. */
} lw_probe_info;

typedef int32_t lw_link_state;
enum {
  LW_LINK_CONNECTING = 0,
  LW_LINK_CONNECTED = 1,
  LW_LINK_WAITING = 2, /* The last attempt failed; the next follows after a pause. */
  LW_LINK_ENDED = 3,   /* The recording is over. */
  LW_LINK_GONE = 4     /* Of MQTT: the broker says that the probe has left it. It is waited for. */
};

/* Since the connection was made. */
typedef struct lw_link_stats {
  uint32_t size;
  lw_link_state state;
  uint64_t received;    /* Good descriptors. */
  uint64_t bytes;       /* Of the good ones. */
  uint64_t gaps;        /* Captures that never came. */
  uint64_t oversized;   /* Messages too long to be read. */
  uint64_t undecodable; /* Messages that were no descriptor; the last good one stays. */
  uint64_t replayed;    /* Descriptors that came again after a newer one: dropped. */
  uint64_t reconnects;
  uint64_t maps;             /* Environment maps that came, whole or as changes. */
  uint64_t maps_without_key; /* Changes to a whole map that never came here. */
  uint64_t frames_lost;      /* By USB: numbered frames that never came, and */
  uint64_t frames_refused;   /* those that came damaged, too large or a second time. */
  uint64_t untimely;         /* By MQTT: descriptors not newer than what had come, or dated in the future. Refused. */
} lw_link_stats;

/* Meanings and defaults: proto/lightwell/v1/config.proto. Fields of an estimator that the probe does not run must have
 * their defaults: others are LW_INVALID_ARGUMENT. */
typedef struct lw_estimator_config {
  uint32_t size;
  int32_t band;             /* 0 to 6. */
  int32_t max_lights;       /* 0 to 64. */
  int32_t setting;          /* 1 fast, 2 balanced, 3 exact. */
  int32_t unseen;           /* From here on of the panorama estimator alone. 1 none, 2 mirror, 3 average. */
  int32_t smoothing;        /* 1 none, 2 the 1 euro filter. */
  int32_t environment_edge; /* 0, 8, 16, 32 or 64. */
  int32_t reserved;         /* 0. */
  double light_threshold;
  double epsilon;
  double radiance_epsilon;
  double environment_rate;
  double marker_decimation; /* From here on of the marker estimator alone. 0, or 1 to 8. */
  double marker_search_decimation;
  int32_t marker_max_faces;
  int32_t reserved_2; /* 0. */
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
  LW_FIELD_MARKER_MAX_FACES = 1 << 12
};

/* What light is read from. */
typedef int32_t lw_estimator_kind;
enum {
  LW_ESTIMATOR_PANORAMA = 1, /* All that the camera sees around it. */
  LW_ESTIMATOR_MARKER = 2    /* A marker that the camera looks at. */
};

/* Texts of a probe, for lw_probe_text. */
typedef int32_t lw_probe_text_kind;
enum {
  LW_PROBE_NAME = 0,
  LW_PROBE_VERSION = 1, /* Of its firmware. */
  LW_PROBE_CAMERA = 2,
  LW_PROBE_LAST_ERROR = 3 /* Of the link, or of the last refused message; empty while all went well. */
};

/* uri: `grpc://host:port`, `grpcs://` with TLS, `usb:SERIAL`, `mqtt://broker/venue/probe`, `mqtts://`, or
 * `replay:PATH`, a recording of descriptors (`?speed=2`, `?speed=0`); more at Probe::connect of probe.hpp. options:
 * NULL for defaults. *out is given back with lw_probe_close. Blocks, at most connect_timeout_ns. LW_INVALID_ARGUMENT:
 * the URI or an option, by name. LW_UNAVAILABLE: nobody answered. LW_NOT_FOUND, LW_DATA_LOSS: the recording, or a file
 * of credentials. */
LW_API lw_status lw_probe_connect(const char* uri, size_t uri_length, const lw_probe_options* options, lw_probe** out);

/* Ends the link and its thread; blocks for less than a second. Lightings live on. NULL is passed over. */
LW_API void lw_probe_close(lw_probe* probe);

/* The newest. Made for render threads: takes no lock, allocates nothing, does not wait for the reader thread. LW_OK
 * with LW_NONE before the first descriptor. */
LW_API lw_status lw_probe_latest(const lw_probe* probe, lw_lighting* into);

/* The same in the axes of the probe's room, by what the probe says of its mounting (lw_probe_info.mounted); the doubt
 * of its rotation is added to each light's. LW_OK with LW_INVALID_QUERY where the probe does not know where it hangs.
 * About 20 µs, allocates: ask once a frame. In an application's own world: lw_lighting_rotated. */
LW_API lw_status lw_probe_latest_in_world(const lw_probe* probe, lw_lighting* into);

/* How it was lit at `host_time_ns` (of lw_now_ns): interpolated between two descriptors, a little beyond the newest
 * with its lights moved on, later the newest as it was (lw_lighting_info.derivation says which); earlier than the
 * oldest kept it is LW_BEFORE_HISTORY. Takes no lock, allocates. */
LW_API lw_status lw_probe_at(const lw_probe* probe, int64_t host_time_ns, lw_lighting* into);

/* Waits for a newest descriptor with another sequence than *seen (NULL: for any). Blocks: not for render threads.
 * LW_UNAVAILABLE after timeout_ns, LW_FAILED_PRECONDITION where the recording has ended. */
LW_API lw_status lw_probe_wait_for_next(const lw_probe* probe, const uint64_t* seen, int64_t timeout_ns,
                                        lw_lighting* into);

/* Block shortly. */
LW_API lw_status lw_probe_get_info(const lw_probe* probe, lw_probe_info* out);
LW_API lw_status lw_probe_get_stats(const lw_probe* probe, lw_link_stats* out);

/* Into text[0 .. capacity): UTF-8, zero-terminated where capacity is not 0, cut between characters where it is too
 * long. *length (may be NULL) is what it would need without the zero. Blocks shortly. */
LW_API lw_status lw_probe_text(const lw_probe* probe, lw_probe_text_kind kind, char* text, size_t capacity,
                               size_t* length);

/* Fills `config` with the defaults of a probe. */
LW_API lw_status lw_estimator_config_defaults(lw_estimator_config* config);

/* How the probe's estimator is configured now, by its owner's file and by all clients since; and which one runs. Each
 * asks the probe: blocks as lw_probe_change_estimator. LW_FAILED_PRECONDITION for a recording, and where the probe's
 * firmware is too old to tell. Since LW_ABI_VERSION 0x00010001. */
LW_API lw_status lw_probe_get_estimator(const lw_probe* probe, lw_estimator_config* config);
LW_API lw_status lw_probe_get_estimator_kind(const lw_probe* probe, lw_estimator_kind* kind);

/* Sets the fields that `fields` names, LW_FIELD_EPSILON | LW_FIELD_BAND, for all clients of the probe, and leaves the
 * others as they are: they are not read here, and may be zero. Takes effect with the probe's next capture. Blocks until
 * the probe answers, at most connect_timeout_ns. LW_INVALID_ARGUMENT: a value, a bit that is no field's, or none at
 * all. LW_FAILED_PRECONDITION for a recording; otherwise what the probe said. Since LW_ABI_VERSION 0x00010001. */
LW_API lw_status lw_probe_change_estimator(lw_probe* probe, const lw_estimator_config* config, uint64_t fields);

/* Replaces the whole configuration: what the owner or other clients chose is lost, also in the fields that are defaults
 * here. As lw_probe_change_estimator. */
LW_API lw_status lw_probe_set_estimator(lw_probe* probe, const lw_estimator_config* config);

/* Tells the probe what a lux meter beside it reads, facing normal[3]: from then on its units are absolute. *factor
 * (may be NULL) is what was applied. Blocks and fails as lw_probe_change_estimator. */
LW_API lw_status lw_probe_report_lux(lw_probe* probe, double lux, const float* normal, double* factor);

/* ---- an answer ---- */

/* A place for one immutable answer, empty (LW_NONE) at first. Make it once and fill it every frame: filling does not
 * allocate. Given back with lw_lighting_release. */
LW_API lw_status lw_lighting_create(lw_lighting** out);

/* NULL is passed over. */
LW_API void lw_lighting_release(lw_lighting* lighting);

/* The same answer into another place, for another thread to keep. Cheap, does not allocate. */
LW_API lw_status lw_lighting_copy(const lw_lighting* lighting, lw_lighting* into);

/* The light of a LightingDescriptor's bytes that came by other ways than a probe: from a file, from a relay. It is
 * stale where age_ns is more than 250 ms. LW_DATA_LOSS and LW_INVALID_ARGUMENT name the field that is wrong. */
LW_API lw_status lw_lighting_decode(const void* bytes, size_t length, int64_t age_ns, lw_lighting* into);

/* The same light in a frame turned by the quaternion q[4] (x, y, z, w), p_new = q p_old. `into` may be `lighting`.
 * LW_OK with LW_INVALID_QUERY where q is zero or not finite. About 20 µs, allocates. */
LW_API lw_status lw_lighting_rotated(const lw_lighting* lighting, const double* q, lw_lighting* into);

/* How an answer came about. */
typedef int32_t lw_derivation;
enum {
  LW_MEASURED = 0,     /* One descriptor. */
  LW_INTERPOLATED = 1, /* Between two. */
  LW_EXTRAPOLATED = 2, /* Beyond the newest: its lights moved on as they moved before. */
  LW_HELD = 3          /* Beyond that: the newest as it was. */
};

typedef struct lw_lighting_info {
  uint32_t size;
  lw_validity validity;
  int64_t age_ns;     /* Since mid-exposure, at the moment it was asked; of lw_probe_at, to the nearest descriptor. */
  const char* reason; /* Why it is not valid, zero-terminated, lives for ever; empty where it is valid. */
  int64_t age_uncertainty_ns; /* What age_ns may be off by; one that may be older than max_age_ns is stale. */
  uint64_t sequence;
  int64_t mid_exposure_ns;       /* Of the host's clock; 0 where there was none. */
  int64_t received_ns;           /* Of the host's clock; 0 where there was none. */
  int64_t probe_mid_exposure_ns; /* Of the probe's clock. */
  int64_t delivered_after_ns;    /* From mid-exposure to the camera's handing over. */
  int64_t encoded_after_ns;      /* From mid-exposure to the encoded bytes. */
  uint64_t encoded_bytes;        /* Of the message as received. */
  lw_units units;
  uint32_t flags;
  float bound_total; /* As lw_answer.error_bound; the parts of it follow. */
  float bound_truncation;
  float bound_sampling;
  float bound_noise;
  float bound_quantization;
  float bound_smoothing;
  float coverage;  /* Share of the sphere that some pixel saw. */
  float saturated; /* Share of the seen sphere that was saturated in every exposure. */
  int32_t band;
  uint32_t light_count;
  uint32_t probe_id;
  uint32_t calibration_id;
  int32_t setting; /* 1 fast, 2 balanced, 3 exact. */
  int32_t flicker; /* 0 not known, 1 none, 2 100 Hz, 3 120 Hz. */
  lw_derivation derivation;
} lw_lighting_info;

LW_API lw_status lw_lighting_get_info(const lw_lighting* lighting, lw_lighting_info* out);

/* Why the lighting is not valid, with the numbers ("300 ms from the nearest descriptor, and ..."); empty where it is
 * valid. As lw_probe_text, and does not block. */
LW_API lw_status lw_lighting_reason(const lw_lighting* lighting, char* text, size_t capacity, size_t* length);

/* A value with all that is needed to decide whether to believe it. */
typedef struct lw_answer {
  uint32_t size;
  lw_validity validity;
  int64_t age_ns;     /* As lw_lighting_info. */
  const char* reason; /* As lw_lighting_info. */
  float value[3];     /* r, g, b. Zero for a batch. */
  float error_bound;  /* RMS over normals relative to the RMS irradiance, 0.01 is 1 %; infinite where flags say why. */
  uint32_t flags;     /* LW_FLAG_*. */
  int32_t lights_included; /* 1; 0 of radiance at roughness 0, which leaves the discrete lights out. */
  lw_units units;
  uint32_t refused; /* Entries of a batch that were no question: their values are zero, and validity is
                       LW_INVALID_QUERY though the others are answered. */
} lw_answer;

/* Irradiance of a flat receiver that faces normal[3]. Not divided by pi and not clamped: more at Lighting::irradiance
 * of lighting.hpp. LW_OK with LW_INVALID_QUERY for a normal that is zero, NaN or infinite. */
LW_API lw_status lw_lighting_irradiance(const lw_lighting* lighting, const float* normal, lw_answer* out);

/* Radiance from direction[3] as a surface of that perceptual roughness sees it: more at Lighting::radiance. */
LW_API lw_status lw_lighting_radiance(const lw_lighting* lighting, const float* direction, float roughness,
                                      lw_answer* out);

/* `count` at once, irradiance several at a time: within 1e-5 of the largest of what lw_lighting_irradiance says.
 * Normals and values are three floats each, *_stride bytes apart (0: 12, one behind the other; else
 * 12 or more). Values may lie over the normals where both strides are the same. `about` may be NULL. */
LW_API lw_status lw_lighting_irradiance_batch(const lw_lighting* lighting, const float* normals, size_t normal_stride,
                                              size_t count, float* values, size_t value_stride, lw_answer* about);
LW_API lw_status lw_lighting_radiance_batch(const lw_lighting* lighting, const float* directions,
                                            size_t direction_stride, size_t count, float roughness, float* values,
                                            size_t value_stride, lw_answer* about);

typedef int32_t lw_quantity;
enum {
  LW_RADIANCE = 0,  /* Of each direction. */
  LW_IRRADIANCE = 1 /* Of each normal: the same times A_l = pi, 2 pi/3, pi/4, 0, -pi/24, 0, pi/64. */
};

/* Spherical harmonics of what is left after the lights were taken out: real, orthonormal, WITHOUT the Condon-Shortley
 * phase (all constants positive), r, g, b of each function, functions in the order l(l+1)+m, band 1 as y, z, x.
 * Writes exactly 3 (max_band + 1)² floats, zeros above the lighting's own band, which *band (may be NULL) tells: bands
 * above max_band, 0 to 6, are left out. */
LW_API lw_status lw_lighting_harmonics(const lw_lighting* lighting, lw_quantity quantity, int32_t max_band,
                                       float* coefficients, int32_t* band);

/* A lamp, the sun, a window: a cap of uniform radiance. */
typedef struct lw_light {
  uint32_t size;
  uint32_t track;                /* Stays with the same lamp; 0 is not a track. */
  float direction[3];            /* Unit, TOWARDS the light. */
  float irradiance[3];           /* Vector irradiance: of a receiver that faces it, for small ones. */
  float angular_radius;          /* rad. */
  float direction_covariance[3]; /* u·u, u·v, v·v in rad²; the basis is that of proto/README.md. */
} lw_light;

/* Strongest first, into lights[0 .. capacity), which are light_size (sizeof(lw_light)) bytes apart; the library sets
 * their `size`. *count is how many there are, also where capacity is less. */
LW_API lw_status lw_lighting_lights(const lw_lighting* lighting, lw_light* lights, size_t light_size, size_t capacity,
                                    size_t* count);

/* The prefiltered map for reflections, lights left out: octahedral squares, more at EnvironmentMap of environment.hpp.
 */
typedef struct lw_environment {
  uint32_t size;
  uint32_t level_count; /* 0: there is no map, and nothing below means anything. */
  uint64_t sequence;    /* Of the descriptor that brought it: upload when this changes. */
  int64_t older_by_ns;  /* Mid-exposure of the lighting's descriptor less that of the map's. */
  double rotation[4];   /* x, y, z, w; p_lighting = rotation p_map. */
  uint32_t key;         /* Of the whole map that this is, or that this changed. */
  int32_t exponent;     /* Radiance is the RGB9E5 texel times 2^exponent. */
  uint32_t edge[8];     /* Texels along the edge of each level. */
  float roughness[8];   /* Perceptual, rising. */
} lw_environment;

LW_API lw_status lw_lighting_environment(const lw_lighting* lighting, lw_environment* out);

/* One level as radiance: 3 edge² floats, rows from the top. LW_INVALID_ARGUMENT where `capacity` (floats) is less, and
 * where there is no such level. */
LW_API lw_status lw_lighting_environment_radiance(const lw_lighting* lighting, uint32_t level, float* rgb,
                                                  size_t capacity);

/* The same as RGB9E5 texels (the layout of GL_RGB9_E5 and VK_FORMAT_E5B9G9R9_UFLOAT_PACK32), still to be multiplied by
 * 2^exponent: edge² numbers. */
LW_API lw_status lw_lighting_environment_texels(const lw_lighting* lighting, uint32_t level, uint32_t* texels,
                                                size_t capacity);

#ifdef __cplusplus
}
#endif
#endif
