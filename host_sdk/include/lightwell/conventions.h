/* Conversions to other engines' lighting types, for C: conventions.hpp through the C ABI, with the rules of
 * lightwell.h. Meaning, unit, axes and signs of each field are documented at the corresponding type in conventions.hpp.
 * Transform the lighting to the application's world first (lw_lighting_rotated), in Lightwell's axes; the conversion
 * changes handedness.
 *
 * Functions return LW_OK also without an estimate: see `validity`; the value is then the target's own representation of
 * that. No function blocks; all allocate.
 */
#ifndef LIGHTWELL_CONVENTIONS_H
#define LIGHTWELL_CONVENTIONS_H

#include <lightwell/lightwell.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Whether `residual` is computed, which costs more than the conversion. */
enum { LW_RESIDUAL_MEASURED = 0, LW_RESIDUAL_LEFT_OUT = 1 };

/* How the strongest light is represented, for targets that allow both. */
typedef int32_t lw_main_light;
enum { LW_MAIN_LIGHT_APART = 0, LW_MAIN_LIGHT_IN_HARMONICS = 1 };

/* Sign convention of the nine basis functions. */
typedef int32_t lw_sh_signs;
enum {
  LW_SH_CONDON_SHORTLEY = 0, /* Odd m negative, as in ARCore. */
  LW_SH_POSITIVE = 1
};

typedef int32_t lw_unity_pipeline;
enum {
  LW_UNITY_UNIVERSAL = 0,      /* Built-in and URP. */
  LW_UNITY_HIGH_DEFINITION = 1 /* HDRP: lux. */
};

typedef int32_t lw_three_lights;
enum {
  LW_THREE_PHYSICAL = 0, /* r155 and later. */
  LW_THREE_LEGACY = 1
};

typedef int32_t lw_openxr_harmonics;
enum { LW_OPENXR_TOTAL = 0, LW_OPENXR_AMBIENT = 1 };

typedef struct lw_conversion_options {
  uint32_t size;
  int32_t residual; /* LW_RESIDUAL_*. */
  float color[9];   /* Matrix, stored by rows, applied to every colour. All zero: none. */
} lw_conversion_options;

/* In each of the following structs, `validity` is the lighting's, or LW_INVALID_QUERY for a colour matrix that is not
 * finite. `residual` is the irradiance error due to what the target cannot represent, RMS relative to the RMS
 * irradiance; -1 if it was not computed. */

typedef struct lw_webxr {
  uint32_t size;
  lw_validity validity;
  float residual;
  float sphericalHarmonicsCoefficients[27];
  float primaryLightDirection[4];
  float primaryLightIntensity[4];
} lw_webxr;

typedef struct lw_arcore {
  uint32_t size;
  lw_validity validity;
  float residual;
  int32_t state; /* 0 not valid, 1 valid. */
  int64_t timestamp;
  float environmentalHdrMainLightDirection[3];
  float environmentalHdrMainLightIntensity[3];
  float environmentalHdrAmbientSphericalHarmonics[27];
} lw_arcore;

/* States: 0 valid, 1 invalid. */
typedef struct lw_openxr {
  uint32_t size;
  lw_validity validity;
  float residual;
  int32_t state;
  int64_t lastUpdatedTime;
  int32_t ambientLightState;
  float ambientLightIntensity[3];
  float ambientLightColorCorrection[3];
  int32_t sphericalHarmonicsState;
  lw_openxr_harmonics sphericalHarmonicsKind;
  float sphericalHarmonicsCoefficients[27]; /* r, g, b of each. */
  int32_t directionalLightState;
  float directionalLightIntensity[3];
  float directionalLightDirection[3];
} lw_openxr;

typedef struct lw_arkit {
  uint32_t size;
  lw_validity validity;
  float residual;
  float sphericalHarmonicsCoefficients[27];
  float primaryLightDirection[3];
  float primaryLightIntensity;
  float ambientIntensity;
  float ambientColorTemperature;
} lw_arkit;

typedef struct lw_unity {
  uint32_t size;
  lw_validity validity;
  float residual;
  float sphericalHarmonicsL2[27];
  float forward[3];
  float color[3];
  float intensity;
} lw_unity;

typedef struct lw_three {
  uint32_t size;
  lw_validity validity;
  float residual;
  float sh[27];
  float lightProbeIntensity;
  float position[3];
  float color[3];
  float intensity;
} lw_three;

typedef struct lw_filament {
  uint32_t size;
  lw_validity validity;
  float residual;
  float irradiance[27]; /* float3[9]. */
  float radiance[27];   /* float3[9]. */
  float indirectIntensity;
  float direction[3];
  float color[3];
  float intensity;
  float sunAngularRadius;
} lw_filament;

typedef struct lw_unreal {
  uint32_t size;
  lw_validity validity;
  float residual;
  float R[9];
  float G[9];
  float B[9];
  float forward[3];
  float color[3];
  float intensity;
  float lightSourceAngle;
} lw_unreal;

/* options: NULL for the defaults. LW_INVALID_ARGUMENT for a value that an enum does not have. */
LW_API lw_status lw_lighting_to_webxr(const lw_lighting* lighting, lw_sh_signs signs,
                                      const lw_conversion_options* options, lw_webxr* out);
LW_API lw_status lw_lighting_to_arcore(const lw_lighting* lighting, const lw_conversion_options* options,
                                       lw_arcore* out);
LW_API lw_status lw_lighting_to_openxr(const lw_lighting* lighting, lw_openxr_harmonics kind, lw_sh_signs signs,
                                       const lw_conversion_options* options, lw_openxr* out);
LW_API lw_status lw_lighting_to_arkit(const lw_lighting* lighting, const lw_conversion_options* options, lw_arkit* out);
LW_API lw_status lw_lighting_to_unity(const lw_lighting* lighting, lw_unity_pipeline pipeline, lw_main_light main_light,
                                      const lw_conversion_options* options, lw_unity* out);
LW_API lw_status lw_lighting_to_three(const lw_lighting* lighting, lw_three_lights lights, lw_main_light main_light,
                                      const lw_conversion_options* options, lw_three* out);
LW_API lw_status lw_lighting_to_filament(const lw_lighting* lighting, lw_main_light main_light,
                                         const lw_conversion_options* options, lw_filament* out);
LW_API lw_status lw_lighting_to_unreal(const lw_lighting* lighting, lw_main_light main_light,
                                       const lw_conversion_options* options, lw_unreal* out);

#ifdef __cplusplus
}
#endif
#endif
