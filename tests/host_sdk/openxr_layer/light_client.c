/* An OpenXR application that knows nothing of Lightwell: it enables XR_ANDROID_light_estimation where the loader lists
 * it, and prints what it gets. Floats are printed as the 8 hexadecimal digits of their bits.
 *
 *   light_client [--frames N] [--kind total|ambient] [--space local|view] [--cube EDGE FORMAT REPROJECT] [--ahead MS]
 *                [--sessions N] [--instances N] [--plain] [--messages]
 *
 * --plain: without the extension. --instances: one after the other. --messages: with XR_EXT_debug_utils.
 * Lines: listed LIGHT CUBE | supported LIGHT CUBE | message TEXT | created RESULT | for each frame
 *   light SESSION HOST_NS TOOK_NS TIME RESULT STATE UPDATED POSE[7] DIRECTIONAL_STATE INTENSITY[3] DIRECTION[3]
 *         AMBIENT_STATE INTENSITY[3] CORRECTION[3] HARMONICS_STATE COEFFICIENTS[27]
 *   cube SESSION STATE CENTER_EXPOSURE ROTATION[4] HASH   (FNV-1a, 64 bits, of right, left, top, bottom, front, back)
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "host_sdk/openxr_layer/android_light_estimation.h"

#define MAX_SESSIONS 4

struct options {
  int frames, sessions, instances, plain, messages, ahead_ms, cube_edge, cube_format, cube_reproject;
  XrSphericalHarmonicsKindANDROID kind;
  XrReferenceSpaceType space;
};

static struct options read_options(int argc, char** argv) {
  struct options o = {
      1, 1, 1, 0, 0, 0, 0, 0, 1, XR_SPHERICAL_HARMONICS_KIND_AMBIENT_ANDROID, XR_REFERENCE_SPACE_TYPE_LOCAL};
  for (int i = 1; i < argc; ++i) {
    const int last = i + 1 == argc;
    if (!strcmp(argv[i], "--plain"))
      o.plain = 1;
    else if (!strcmp(argv[i], "--messages"))
      o.messages = 1;
    else if (last)
      exit(2);
    else if (!strcmp(argv[i], "--frames"))
      o.frames = atoi(argv[++i]);
    else if (!strcmp(argv[i], "--ahead"))
      o.ahead_ms = atoi(argv[++i]);
    else if (!strcmp(argv[i], "--sessions"))
      o.sessions = atoi(argv[++i]);
    else if (!strcmp(argv[i], "--instances"))
      o.instances = atoi(argv[++i]);
    else if (!strcmp(argv[i], "--kind"))
      o.kind = strcmp(argv[++i], "total") ? XR_SPHERICAL_HARMONICS_KIND_AMBIENT_ANDROID
                                          : XR_SPHERICAL_HARMONICS_KIND_TOTAL_ANDROID;
    else if (!strcmp(argv[i], "--space"))
      o.space = strcmp(argv[++i], "view") ? XR_REFERENCE_SPACE_TYPE_LOCAL : XR_REFERENCE_SPACE_TYPE_VIEW;
    else if (!strcmp(argv[i], "--cube") && i + 3 < argc) {
      o.cube_edge = atoi(argv[++i]);
      o.cube_format = atoi(argv[++i]);
      o.cube_reproject = atoi(argv[++i]);
    } else
      exit(2);
  }
  if (o.sessions < 1 || o.sessions > MAX_SESSIONS) exit(2);
  return o;
}

static void check(const char* what, XrResult result) {
  if (XR_SUCCEEDED(result)) return;
  printf("failed %s %d\n", what, (int)result);
  fflush(stdout);
  exit(1);
}

#define LOAD(name)        \
  PFN_##name name = NULL; \
  if (XR_FAILED(xrGetInstanceProcAddr(instance, #name, (PFN_xrVoidFunction*)&name))) name = NULL

static int listed(const char* name) {
  uint32_t count = 0;
  check("xrEnumerateInstanceExtensionProperties", xrEnumerateInstanceExtensionProperties(NULL, 0, &count, NULL));
  XrExtensionProperties* all = calloc(count, sizeof *all);
  for (uint32_t i = 0; i < count; ++i) all[i].type = XR_TYPE_EXTENSION_PROPERTIES;
  check("xrEnumerateInstanceExtensionProperties", xrEnumerateInstanceExtensionProperties(NULL, count, &count, all));
  int found = 0;
  for (uint32_t i = 0; i < count; ++i) found |= !strcmp(all[i].extensionName, name);
  free(all);
  return found;
}

static XRAPI_ATTR XrBool32 XRAPI_CALL print_message(XrDebugUtilsMessageSeverityFlagsEXT severity,
                                                    XrDebugUtilsMessageTypeFlagsEXT types,
                                                    const XrDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  (void)severity, (void)types, (void)user;
  printf("message %s: %s\n", data->functionName, data->message);
  fflush(stdout);
  return XR_FALSE;
}

static void print_bits(const float* values, int count) {
  for (int i = 0; i < count; ++i) {
    uint32_t bits;
    memcpy(&bits, values + i, sizeof bits);
    printf(" %08" PRIx32, bits);
  }
}

static int64_t host_now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

struct session {
  XrSession session;
  XrSpace space, local;
  XrLightEstimatorANDROID estimator;
};

static XrSpace make_space(XrSession session, XrReferenceSpaceType type) {
  XrReferenceSpaceCreateInfo info = {XR_TYPE_REFERENCE_SPACE_CREATE_INFO};
  info.referenceSpaceType = type;
  info.poseInReferenceSpace.orientation.w = 1;
  XrSpace out = XR_NULL_HANDLE;
  check("xrCreateReferenceSpace", xrCreateReferenceSpace(session, &info, &out));
  return out;
}

static uint64_t hash_of(const uint8_t* bytes, size_t count) {
  uint64_t hash = 14695981039346656037u;
  for (size_t i = 0; i < count; ++i) hash = (hash ^ bytes[i]) * 1099511628211u;
  return hash;
}

/* One call for each frame: everything that the extensions have. */
static void print_light(int index, const struct session* s, const struct options* o, XrTime time,
                        PFN_xrGetLightEstimateANDROID get) {
  XrDirectionalLightANDROID directional = {XR_TYPE_DIRECTIONAL_LIGHT_ANDROID};
  XrAmbientLightANDROID ambient = {XR_TYPE_AMBIENT_LIGHT_ANDROID, &directional};
  XrSphericalHarmonicsANDROID harmonics = {XR_TYPE_SPHERICAL_HARMONICS_ANDROID, &ambient};
  harmonics.kind = o->kind;
  XrLightEstimateANDROID estimate = {XR_TYPE_LIGHT_ESTIMATE_ANDROID, &harmonics};
  XrCubemapLightingDataANDROID cube = {XR_TYPE_CUBEMAP_LIGHTING_DATA_ANDROID};
  uint8_t* texels = NULL;
  const size_t texel = o->cube_format == 3 ? 8 : o->cube_format == 2 ? 16 : 12;
  const size_t face = texel * (size_t)o->cube_edge * (size_t)o->cube_edge;
  if (o->cube_edge) {
    texels = calloc(6, face);
    cube.imageBufferSize = (uint32_t)face;
    cube.imageBufferRight = texels, cube.imageBufferLeft = texels + face, cube.imageBufferTop = texels + 2 * face;
    cube.imageBufferBottom = texels + 3 * face, cube.imageBufferFront = texels + 4 * face;
    cube.imageBufferBack = texels + 5 * face;
    directional.next = &cube;
  }
  XrLightEstimateGetInfoANDROID info = {XR_TYPE_LIGHT_ESTIMATE_GET_INFO_ANDROID};
  info.space = s->space;
  info.time = time;
  XrSpaceLocation location = {XR_TYPE_SPACE_LOCATION};
  check("xrLocateSpace", xrLocateSpace(s->local, s->space, time, &location));
  const int64_t now_ns = host_now_ns();
  const XrResult result = get(s->estimator, &info, &estimate);
  const int64_t took_ns = host_now_ns() - now_ns;
  printf("light %d %" PRId64 " %" PRId64 " %" PRId64 " %d %d %" PRId64, index, now_ns, took_ns, time, (int)result,
         (int)estimate.state, estimate.lastUpdatedTime);
  print_bits(&location.pose.orientation.x, 4);
  print_bits(&location.pose.position.x, 3);
  printf(" %d", (int)directional.state);
  print_bits(&directional.intensity.x, 3);
  print_bits(&directional.direction.x, 3);
  printf(" %d", (int)ambient.state);
  print_bits(&ambient.intensity.x, 3);
  print_bits(&ambient.colorCorrection.x, 3);
  printf(" %d", (int)harmonics.state);
  print_bits(&harmonics.coefficients[0][0], 27);
  printf("\n");
  if (o->cube_edge) {
    printf("cube %d %d %" PRId64, index, (int)cube.state, cube.centerExposureTime);
    print_bits(&cube.rotation.x, 4);
    printf(" %016" PRIx64 "\n", hash_of(texels, 6 * face));
    free(texels);
  }
  fflush(stdout);
}

static void run_instance(const struct options* o) {
  const int has_light = listed(XR_ANDROID_LIGHT_ESTIMATION_EXTENSION_NAME);
  const int has_cube = listed(XR_ANDROID_LIGHT_ESTIMATION_CUBEMAP_EXTENSION_NAME);
  printf("listed %d %d\n", has_light, has_cube);
  const char* names[4];
  XrInstanceCreateInfo create = {XR_TYPE_INSTANCE_CREATE_INFO};
  strcpy(create.applicationInfo.applicationName, "light_client");
  create.applicationInfo.apiVersion = XR_CURRENT_API_VERSION;
  create.enabledExtensionNames = names;
  names[create.enabledExtensionCount++] = XR_MND_HEADLESS_EXTENSION_NAME;
  if (o->messages) names[create.enabledExtensionCount++] = XR_EXT_DEBUG_UTILS_EXTENSION_NAME;
  if (has_light && !o->plain) names[create.enabledExtensionCount++] = XR_ANDROID_LIGHT_ESTIMATION_EXTENSION_NAME;
  if (has_cube && !o->plain) names[create.enabledExtensionCount++] = XR_ANDROID_LIGHT_ESTIMATION_CUBEMAP_EXTENSION_NAME;
  XrInstance instance = XR_NULL_HANDLE;
  check("xrCreateInstance", xrCreateInstance(&create, &instance));
  XrDebugUtilsMessengerEXT messenger = XR_NULL_HANDLE;
  if (o->messages) {
    LOAD(xrCreateDebugUtilsMessengerEXT);
    XrDebugUtilsMessengerCreateInfoEXT info = {XR_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    info.messageSeverities = XR_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    info.messageTypes = XR_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT;
    info.userCallback = print_message;
    check("xrCreateDebugUtilsMessengerEXT", xrCreateDebugUtilsMessengerEXT(instance, &info, &messenger));
  }
  XrSystemGetInfo get_system = {XR_TYPE_SYSTEM_GET_INFO};
  get_system.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  XrSystemId system = XR_NULL_SYSTEM_ID;
  check("xrGetSystem", xrGetSystem(instance, &get_system, &system));
  XrSystemCubemapLightEstimationPropertiesANDROID cube = {XR_TYPE_SYSTEM_CUBEMAP_LIGHT_ESTIMATION_PROPERTIES_ANDROID};
  XrSystemLightEstimationPropertiesANDROID light = {XR_TYPE_SYSTEM_LIGHT_ESTIMATION_PROPERTIES_ANDROID, &cube};
  XrSystemProperties properties = {XR_TYPE_SYSTEM_PROPERTIES, o->plain ? NULL : &light};
  check("xrGetSystemProperties", xrGetSystemProperties(instance, system, &properties));
  printf("supported %d %d\n", (int)light.supportsLightEstimation, (int)cube.supportsCubemapLightEstimation);

  LOAD(xrCreateLightEstimatorANDROID);
  LOAD(xrDestroyLightEstimatorANDROID);
  LOAD(xrGetLightEstimateANDROID);
  struct session sessions[MAX_SESSIONS];
  for (int i = 0; i < o->sessions; ++i) {
    struct session* s = &sessions[i];
    XrSessionCreateInfo session_info = {XR_TYPE_SESSION_CREATE_INFO};
    session_info.systemId = system;
    check("xrCreateSession", xrCreateSession(instance, &session_info, &s->session));
    XrSessionBeginInfo begin = {XR_TYPE_SESSION_BEGIN_INFO};
    begin.primaryViewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
    check("xrBeginSession", xrBeginSession(s->session, &begin));
    s->space = make_space(s->session, o->space);
    s->local = make_space(s->session, XR_REFERENCE_SPACE_TYPE_LOCAL);
    s->estimator = XR_NULL_HANDLE;
    if (xrCreateLightEstimatorANDROID == NULL) continue;
    XrCubemapLightEstimatorCreateInfoANDROID cube_info = {XR_TYPE_CUBEMAP_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID};
    cube_info.cubemapResolution = (uint32_t)o->cube_edge;
    cube_info.colorFormat = (XrCubemapLightingColorFormatANDROID)o->cube_format;
    cube_info.reproject = (XrBool32)o->cube_reproject;
    XrLightEstimatorCreateInfoANDROID info = {XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID};
    if (o->cube_edge) info.next = &cube_info;
    printf("created %d\n", (int)xrCreateLightEstimatorANDROID(s->session, &info, &s->estimator));
    fflush(stdout);
  }
  for (int frame = 0; frame < o->frames; ++frame) {
    XrFrameWaitInfo wait = {XR_TYPE_FRAME_WAIT_INFO};
    XrFrameState state = {XR_TYPE_FRAME_STATE};
    check("xrWaitFrame", xrWaitFrame(sessions[0].session, &wait, &state));
    for (int i = 0; i < o->sessions; ++i)
      if (sessions[i].estimator != XR_NULL_HANDLE)
        print_light(i, &sessions[i], o, state.predictedDisplayTime + (XrTime)o->ahead_ms * 1000000,
                    xrGetLightEstimateANDROID);
  }
  for (int i = 0; i < o->sessions; ++i) {
    if (sessions[i].estimator != XR_NULL_HANDLE)
      check("xrDestroyLightEstimatorANDROID", xrDestroyLightEstimatorANDROID(sessions[i].estimator));
    check("xrDestroySpace", xrDestroySpace(sessions[i].space));
    check("xrDestroySpace", xrDestroySpace(sessions[i].local));
    check("xrDestroySession", xrDestroySession(sessions[i].session));
  }
  check("xrDestroyInstance", xrDestroyInstance(instance));
}

int main(int argc, char** argv) {
  const struct options o = read_options(argc, argv);
  for (int i = 0; i < o.instances; ++i) run_instance(&o);
  return 0;
}
