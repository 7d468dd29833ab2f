/* Declarations of the OpenXR extensions XR_ANDROID_light_estimation (701) and XR_ANDROID_light_estimation_cubemap
 * (722), revision 1, for headers that lack them (Debian's are of OpenXR 1.0.20). Written from their specifications:
 * OpenXR 1.1, "XR_ANDROID_light_estimation", and https://developer.android.com/develop/xr/openxr/extensions/
 * XR_ANDROID_light_estimation_cubemap of 2025-08-06. Numbers: a token of extension N is 1000000000 + (N - 1) * 1000 +
 * i.
 */
#ifndef LIGHTWELL_ANDROID_LIGHT_ESTIMATION_H
#define LIGHTWELL_ANDROID_LIGHT_ESTIMATION_H

#include <openxr/openxr.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef XR_ANDROID_light_estimation
#define XR_ANDROID_light_estimation 1
#define XR_ANDROID_light_estimation_SPEC_VERSION 1
#define XR_ANDROID_LIGHT_ESTIMATION_EXTENSION_NAME "XR_ANDROID_light_estimation"

#define XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID ((XrStructureType)1000700000)
#define XR_TYPE_LIGHT_ESTIMATE_GET_INFO_ANDROID ((XrStructureType)1000700001)
#define XR_TYPE_LIGHT_ESTIMATE_ANDROID ((XrStructureType)1000700002)
#define XR_TYPE_DIRECTIONAL_LIGHT_ANDROID ((XrStructureType)1000700003)
#define XR_TYPE_SPHERICAL_HARMONICS_ANDROID ((XrStructureType)1000700004)
#define XR_TYPE_AMBIENT_LIGHT_ANDROID ((XrStructureType)1000700005)
#define XR_TYPE_SYSTEM_LIGHT_ESTIMATION_PROPERTIES_ANDROID ((XrStructureType)1000700006)

XR_DEFINE_HANDLE(XrLightEstimatorANDROID)

/* Where it is INVALID, the other members of the structure have no defined value. */
typedef enum XrLightEstimateStateANDROID {
  XR_LIGHT_ESTIMATE_STATE_VALID_ANDROID = 0,
  XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID = 1,
  XR_LIGHT_ESTIMATE_STATE_MAX_ENUM_ANDROID = 0x7FFFFFFF
} XrLightEstimateStateANDROID;

typedef enum XrSphericalHarmonicsKindANDROID {
  XR_SPHERICAL_HARMONICS_KIND_TOTAL_ANDROID = 0,   /* Including the main light. */
  XR_SPHERICAL_HARMONICS_KIND_AMBIENT_ANDROID = 1, /* Excluding it. */
  XR_SPHERICAL_HARMONICS_KIND_MAX_ENUM_ANDROID = 0x7FFFFFFF
} XrSphericalHarmonicsKindANDROID;

/* Extends XrSystemProperties. */
typedef struct XrSystemLightEstimationPropertiesANDROID {
  XrStructureType type;
  void* XR_MAY_ALIAS next;
  XrBool32 supportsLightEstimation;
} XrSystemLightEstimationPropertiesANDROID;

typedef struct XrLightEstimatorCreateInfoANDROID {
  XrStructureType type;
  const void* XR_MAY_ALIAS next;
} XrLightEstimatorCreateInfoANDROID;

typedef struct XrLightEstimateGetInfoANDROID {
  XrStructureType type;
  const void* XR_MAY_ALIAS next;
  XrSpace space; /* Directions and harmonics of the estimate are in its axes. */
  XrTime time;   /* Of the light that is requested. */
} XrLightEstimateGetInfoANDROID;

/* The four structures that follow extend it. */
typedef struct XrLightEstimateANDROID {
  XrStructureType type;
  void* XR_MAY_ALIAS next;
  XrLightEstimateStateANDROID state;
  XrTime lastUpdatedTime; /* When the estimate was last calculated. */
} XrLightEstimateANDROID;

typedef struct XrDirectionalLightANDROID {
  XrStructureType type;
  void* XR_MAY_ALIAS next;
  XrLightEstimateStateANDROID state;
  XrVector3f intensity; /* r, g, b. */
  XrVector3f direction;
} XrDirectionalLightANDROID;

typedef struct XrAmbientLightANDROID {
  XrStructureType type;
  void* XR_MAY_ALIAS next;
  XrLightEstimateStateANDROID state;
  XrVector3f intensity;       /* r, g, b. */
  XrVector3f colorCorrection; /* r, g, b, in gamma space. */
} XrAmbientLightANDROID;

typedef struct XrSphericalHarmonicsANDROID {
  XrStructureType type;
  void* XR_MAY_ALIAS next;
  XrLightEstimateStateANDROID state;
  XrSphericalHarmonicsKindANDROID kind; /* Input. */
  float coefficients[9][3];             /* r, g, b of each. */
} XrSphericalHarmonicsANDROID;

typedef XrResult(XRAPI_PTR* PFN_xrCreateLightEstimatorANDROID)(XrSession session,
                                                               XrLightEstimatorCreateInfoANDROID* createInfo,
                                                               XrLightEstimatorANDROID* outHandle);
typedef XrResult(XRAPI_PTR* PFN_xrDestroyLightEstimatorANDROID)(XrLightEstimatorANDROID estimator);
typedef XrResult(XRAPI_PTR* PFN_xrGetLightEstimateANDROID)(XrLightEstimatorANDROID estimator,
                                                           const XrLightEstimateGetInfoANDROID* input,
                                                           XrLightEstimateANDROID* output);
#endif

#ifndef XR_ANDROID_light_estimation_cubemap
#define XR_ANDROID_light_estimation_cubemap 1
#define XR_ANDROID_light_estimation_cubemap_SPEC_VERSION 1
#define XR_ANDROID_LIGHT_ESTIMATION_CUBEMAP_EXTENSION_NAME "XR_ANDROID_light_estimation_cubemap"

#define XR_TYPE_SYSTEM_CUBEMAP_LIGHT_ESTIMATION_PROPERTIES_ANDROID ((XrStructureType)1000721000)
#define XR_TYPE_CUBEMAP_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID ((XrStructureType)1000721001)
#define XR_TYPE_CUBEMAP_LIGHTING_DATA_ANDROID ((XrStructureType)1000721002)

typedef enum XrCubemapLightingColorFormatANDROID {
  XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32_SFLOAT_ANDROID = 1,
  XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32A32_SFLOAT_ANDROID = 2,
  XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R16G16B16A16_SFLOAT_ANDROID = 3,
  XR_CUBEMAP_LIGHTING_COLOR_FORMAT_MAX_ENUM_ANDROID = 0x7FFFFFFF
} XrCubemapLightingColorFormatANDROID;

/* Extends XrSystemProperties. */
typedef struct XrSystemCubemapLightEstimationPropertiesANDROID {
  XrStructureType type;
  void* XR_MAY_ALIAS next;
  XrBool32 supportsCubemapLightEstimation;
} XrSystemCubemapLightEstimationPropertiesANDROID;

/* Extends XrLightEstimatorCreateInfoANDROID. */
typedef struct XrCubemapLightEstimatorCreateInfoANDROID {
  XrStructureType type;
  const void* XR_MAY_ALIAS next;
  uint32_t cubemapResolution;
  XrCubemapLightingColorFormatANDROID colorFormat;
  XrBool32 reproject; /* To the axes of XrLightEstimateGetInfoANDROID::space; the rotation is then the identity. */
} XrCubemapLightEstimatorCreateInfoANDROID;

/* Extends XrLightEstimateANDROID. The buffers are the application's, imageBufferSize bytes each. */
typedef struct XrCubemapLightingDataANDROID {
  XrStructureType type;
  void* XR_MAY_ALIAS next;
  XrLightEstimateStateANDROID state;
  uint32_t imageBufferSize;
  uint8_t* imageBufferRight;
  uint8_t* imageBufferLeft;
  uint8_t* imageBufferTop;
  uint8_t* imageBufferBottom;
  uint8_t* imageBufferFront;
  uint8_t* imageBufferBack;
  XrQuaternionf rotation;
  XrTime centerExposureTime;
} XrCubemapLightingDataANDROID;

typedef XrResult(XRAPI_PTR* PFN_xrEnumerateCubemapLightingResolutionsANDROID)(XrInstance instance, XrSystemId systemId,
                                                                              uint32_t resolutionCapacityInput,
                                                                              uint32_t* resolutionCountOutput,
                                                                              uint32_t* resolutions);
typedef XrResult(XRAPI_PTR* PFN_xrEnumerateCubemapLightingColorFormatsANDROID)(
    XrInstance instance, XrSystemId systemId, uint32_t colorFormatCapacityInput, uint32_t* colorFormatCountOutput,
    XrCubemapLightingColorFormatANDROID* colorFormats);
#endif

#ifdef __cplusplus
}
#endif
#endif
