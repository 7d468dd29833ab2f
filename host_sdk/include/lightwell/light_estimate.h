/* The light in the few numbers that AR platforms' light estimation gives, for C: light_estimate.hpp through the C ABI,
 * with the rules of lightwell.h. Meanings and units are documented there. No function blocks; lw_lighting_estimate
 * allocates. Since LW_ABI_VERSION 0x00010007.
 */
#ifndef LIGHTWELL_LIGHT_ESTIMATE_H
#define LIGHTWELL_LIGHT_ESTIMATE_H

#include <lightwell/lightwell.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What an application wants to know, as LightRequest: bits. */
enum {
  LW_REQUEST_NONE = 0,
  LW_REQUEST_AMBIENT_INTENSITY = 1 << 0,
  LW_REQUEST_AMBIENT_COLOR = 1 << 1,
  LW_REQUEST_AMBIENT_SPHERICAL_HARMONICS = 1 << 2,
  LW_REQUEST_MAIN_LIGHT_DIRECTION = 1 << 3,
  LW_REQUEST_MAIN_LIGHT_INTENSITY = 1 << 4,
  LW_REQUEST_ALL = 31
};

/* Zero in a field is NOT its default, because an application may request nothing, and a gain of 0 is refused: fill it
 * by lw_light_estimate_defaults first. */
typedef struct lw_light_estimate_options {
  uint32_t size;
  uint32_t requested;        /* LW_REQUEST_*. Default: all. */
  float gain;                /* Factor on all light, above 0 and finite. Default: 1. */
  float neutral_illuminance; /* Lux that are "1000 lumens", above 0 and finite. Default: 1000. */
} lw_light_estimate_options;

/* Zero where a value was not requested or there is none. */
typedef struct lw_light_estimate {
  uint32_t size;
  lw_validity validity; /* Of the lighting. */
  uint32_t available;   /* LW_REQUEST_*: what was requested and is known. */
  float ambient_lumens;
  float mean_illuminance;  /* Lux. */
  float color_temperature; /* K; 0 where it has no meaning. */
  float duv;
  float ambient_color[3];
  float ambient_spherical_harmonics[27]; /* r, g, b of each. */
  float main_light_direction[3];         /* Towards the light. */
  float main_light_color[3];
  float main_light_lumens;
} lw_light_estimate;

LW_API lw_status lw_light_estimate_defaults(lw_light_estimate_options* options);

/* As estimate_light(). options: NULL for the defaults. LW_INVALID_ARGUMENT names the option. LW_INVALID_QUERY if the
 * gain makes the light larger than a float. */
LW_API lw_status lw_lighting_estimate(const lw_lighting* lighting, const lw_light_estimate_options* options,
                                      lw_light_estimate* out);

/* As color_temperature() of a colour rgb[3], linear Rec. 709. *kelvin is 0, and *duv, where it has no meaning. Either
 * may be NULL. */
LW_API lw_status lw_color_temperature(const float* rgb, double* kelvin, double* duv);

/* As fade_weight(): 1 up to the age hold_ns, 0 after hold_ns + fade_ns. LW_INVALID_ARGUMENT for a negative hold or
 * fade.
 */
LW_API lw_status lw_fade_weight(int64_t age_ns, int64_t hold_ns, int64_t fade_ns, float* weight);
/* By the age of a lighting; 0 without light. */
LW_API lw_status lw_lighting_fade_weight(const lw_lighting* lighting, int64_t hold_ns, int64_t fade_ns, float* weight);

#ifdef __cplusplus
}
#endif
#endif
