/* Arguments of queries: message bytes, struct sizes, options, times, strides. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <lightwell/lightwell.h>

#include "check.h"
#include "lamp.h"

static void decoding_is_careful(const char* vectors) {
  unsigned char bytes[LAMP_CAPACITY];
  const size_t n = vector_bytes(vectors, "v1_lamp_at_plus_x", bytes);
  lw_lighting* out = lamp(vectors);
  size_t k;
  lw_lighting_info info = {.size = sizeof info};
  /* Truncated at any position, it is rejected with a message, and the previous content is kept. */
  for (k = 0; k < n; ++k) (void)lw_lighting_decode(bytes, k, 0, out);
  CHECK(lw_lighting_decode(bytes, n - 1, 0, out) == LW_DATA_LOSS);
  CHECK(lw_lighting_decode(bytes, 0, 0, out) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_decode(bytes, n, 0, out) == LW_OK);
  CHECK(lw_lighting_decode(NULL, n, 0, out) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_decode(bytes, n, -1, out) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_get_info(out, &info) == LW_OK && info.sequence == 7);
  /* An unknown field is ignored; a newer wire version is rejected with its number. */
  memcpy(bytes + n, "\xC0\x3E\x05", 3);
  CHECK(lw_lighting_decode(bytes, n + 3, 0, out) == LW_OK);
  /* An unknown flag is reported as LW_FLAG_NEWER. */
  memcpy(bytes + n, "\x68\x63", 2);
  CHECK(lw_lighting_decode(bytes, n + 2, 0, out) == LW_OK && lw_lighting_get_info(out, &info) == LW_OK);
  CHECK(info.flags == LW_FLAG_NEWER);
  /* A known flag keeps its bit. */
  memcpy(bytes + n, "\x68\x08", 2);
  CHECK(lw_lighting_decode(bytes, n + 2, 0, out) == LW_OK && lw_lighting_get_info(out, &info) == LW_OK);
  CHECK(info.flags == LW_FLAG_UNSURE);
  memcpy(bytes + n, "\x08\x02", 2);
  CHECK(lw_lighting_decode(bytes, n + 2, 0, out) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "wire_version is 2") != NULL);
  CHECK(lw_lighting_decode(bytes, n, 300000000, out) == LW_OK);
  CHECK(lw_lighting_get_info(out, &info) == LW_OK && info.validity == LW_STALE && info.age_ns == 300000000);
  CHECK(strlen(info.reason) > 0);
  CHECK(lw_lighting_decode(bytes, n, 0, out) == LW_OK);
  lw_lighting_release(out);
}

/* A struct of a newer header, with additional fields that this library does not know. */
typedef struct {
  lw_answer known;
  unsigned char future[24];
} newer_answer;
typedef struct {
  lw_probe_options known;
  unsigned char future[16];
} newer_options;
typedef struct {
  lw_light known;
  unsigned char future[20];
} newer_light;

static void sizes_are_kept(lw_lighting* light, const char* recording) {
  const float east[3] = {1, 0, 0};
  lw_answer whole = {.size = sizeof whole}, shorter, wrong;
  newer_answer longer;
  newer_options options;
  newer_light lights[2];
  lw_light older[2];
  lw_probe* probe = NULL;
  char uri[1100];
  size_t count = 0;
  const size_t up_to_value = offsetof(lw_answer, value) + sizeof whole.value;
  CHECK(lw_lighting_irradiance(light, east, &whole) == LW_OK);
  /* An older application's struct ends after `value`: no byte after it is written. */
  memset(&shorter, 0x5A, sizeof shorter);
  shorter.size = (uint32_t)up_to_value;
  CHECK(lw_lighting_irradiance(light, east, &shorter) == LW_OK);
  CHECK(shorter.size == up_to_value && memcmp(shorter.value, whole.value, sizeof whole.value) == 0);
  {
    size_t k;
    for (k = up_to_value; k < sizeof shorter; ++k) CHECK(((unsigned char*)&shorter)[k] == 0x5A);
  }
  /* A newer application's struct: unknown fields become zero. */
  memset(&longer, 0x5A, sizeof longer);
  longer.known.size = sizeof longer;
  CHECK(lw_lighting_irradiance(light, east, &longer.known) == LW_OK);
  CHECK(longer.known.size == sizeof longer && memcmp(longer.known.value, whole.value, sizeof whole.value) == 0);
  CHECK(longer.known.error_bound == whole.error_bound);
  {
    size_t k;
    for (k = 0; k < sizeof longer.future; ++k) CHECK(longer.future[k] == 0);
  }
  /* No size. */
  wrong = whole;
  wrong.size = 0;
  CHECK(lw_lighting_irradiance(light, east, &wrong) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "lw_answer.size") != NULL);
  wrong.size = 0xCCCCCCCC;
  CHECK(lw_lighting_irradiance(light, east, &wrong) == LW_INVALID_ARGUMENT);
  CHECK(memcmp(wrong.value, whole.value, sizeof whole.value) == 0);
  /* Input structs: an unknown field must be zero. */
  snprintf(uri, sizeof uri, "replay:%s?speed=0", recording);
  memset(&options, 0, sizeof options);
  options.known.size = sizeof options;
  CHECK(lw_probe_connect(uri, LW_ZERO_TERMINATED, &options.known, &probe) == LW_OK);
  lw_probe_close(probe);
  probe = NULL;
  options.future[3] = 1;
  CHECK(lw_probe_connect(uri, LW_ZERO_TERMINATED, &options.known, &probe) == LW_INVALID_ARGUMENT);
  CHECK(probe == NULL && strstr(lw_last_error(NULL), "older") != NULL);
  /* An older options struct ends after max_age. */
  options.known.size = (uint32_t)offsetof(lw_probe_options, extrapolation_ns);
  options.known.extrapolation_ns = -5;
  CHECK(lw_probe_connect(uri, LW_ZERO_TERMINATED, &options.known, &probe) == LW_OK);
  lw_probe_close(probe);
  /* Elements of an array, larger and smaller. */
  memset(lights, 0x5A, sizeof lights);
  CHECK(lw_lighting_lights(light, &lights[0].known, sizeof lights[0], 2, &count) == LW_OK && count == 1);
  CHECK(lights[0].known.direction[0] == 1 && lights[0].future[0] == 0 && lights[1].known.track == 0x5A5A5A5A);
  memset(older, 0x5A, sizeof older);
  CHECK(lw_lighting_lights(light, older, offsetof(lw_light, angular_radius), 1, &count) == LW_OK);
  CHECK(older[0].irradiance[0] == 10 && ((unsigned char*)older)[offsetof(lw_light, angular_radius)] == 0x5A);
  CHECK(lw_lighting_lights(light, older, 3, 1, &count) == LW_INVALID_ARGUMENT);
}

static void options_are_checked(const char* recording, lw_probe* probe) {
  lw_probe_options options = {.size = sizeof options};
  lw_estimator_config config = {.size = sizeof config};
  lw_probe* none = NULL;
  char uri[1100];
  double factor = 3;
  const float up[3] = {0, 1, 0};
  snprintf(uri, sizeof uri, "replay:%s", recording);
  options.history = -1;
  CHECK(lw_probe_connect(uri, strlen(uri), &options, &none) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "history") != NULL && none == NULL);
  CHECK(lw_probe_connect("ftp://x", LW_ZERO_TERMINATED, NULL, &none) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_connect("replay:/nowhere/at/all", LW_ZERO_TERMINATED, NULL, &none) == LW_NOT_FOUND);
  /* The length counts, not the zero byte: "replay:" and nothing. */
  CHECK(lw_probe_connect(uri, 7, NULL, &none) != LW_OK);
  options.history = 0;
  options.connect_timeout_ns = 200000000;
  CHECK(lw_probe_connect("grpc://127.0.0.1:1", LW_ZERO_TERMINATED, &options, &none) == LW_UNAVAILABLE);
  CHECK(strstr(lw_last_error(NULL), "lightwelld") != NULL && none == NULL);

  CHECK(lw_estimator_config_defaults(&config) == LW_OK);
  CHECK(config.band == 6 && config.max_lights == 16 && config.epsilon == 0.01 && config.setting == 2);
  CHECK(lw_probe_set_estimator(probe, &config) == LW_FAILED_PRECONDITION);
  CHECK(strstr(lw_last_error(NULL), "recording") != NULL);
  config.setting = 257;
  CHECK(lw_probe_set_estimator(probe, &config) == LW_INVALID_ARGUMENT);
  config.setting = 2;
  config.epsilon = NAN;
  CHECK(lw_probe_set_estimator(probe, &config) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_report_lux(probe, NAN, up, &factor) == LW_INVALID_ARGUMENT && factor == 3);
  CHECK(lw_probe_report_lux(probe, 100, up, &factor) == LW_FAILED_PRECONDITION && factor == 3);
}

/* Fields that are not selected by the bits are not read. */
static void changes_name_their_fields(lw_probe* probe) {
  static const struct {
    uint64_t bit;
    const char* name;
  } kFields[] = {{LW_FIELD_BAND, "band"},
                 {LW_FIELD_MAX_LIGHTS, "max_lights"},
                 {LW_FIELD_SETTING, "setting"},
                 {LW_FIELD_UNSEEN, "unseen"},
                 {LW_FIELD_SMOOTHING, "smoothing"},
                 {LW_FIELD_ENVIRONMENT_EDGE, "environment_edge"},
                 {LW_FIELD_LIGHT_THRESHOLD, "light_threshold"},
                 {LW_FIELD_EPSILON, "epsilon"},
                 {LW_FIELD_RADIANCE_EPSILON, "radiance_epsilon"},
                 {LW_FIELD_ENVIRONMENT_RATE, "environment_rate"},
                 {LW_FIELD_MARKER_DECIMATION, "marker.decimation"},
                 {LW_FIELD_MARKER_SEARCH_DECIMATION, "marker.search_decimation"},
                 {LW_FIELD_MARKER_MAX_FACES, "marker.max_faces"},
                 {LW_FIELD_SPECULAR_ENVIRONMENT_EDGE, "specular.environment_edge"},
                 {LW_FIELD_INTERLEAVE, "panorama.interleave"},
                 {LW_FIELD_MAX_BYTES, "panorama.max_bytes"}};
  const lw_estimator_config wrong = {.size = sizeof wrong,
                                     .band = 9,
                                     .max_lights = -1,
                                     .setting = 257,
                                     .unseen = 258,
                                     .smoothing = -255,
                                     .environment_edge = 7,
                                     .light_threshold = NAN,
                                     .epsilon = -1,
                                     .radiance_epsilon = INFINITY,
                                     .environment_rate = -1,
                                     .marker_decimation = 99,
                                     .marker_search_decimation = 99,
                                     .marker_max_faces = -1,
                                     .specular_environment_edge = 7,
                                     .interleave = 17,
                                     .max_bytes = 95};
  lw_estimator_config config = wrong, shorter;
  size_t k;
  for (k = 0; k < sizeof kFields / sizeof kFields[0]; ++k) {
    CHECK(lw_probe_change_estimator(probe, &wrong, kFields[k].bit) == LW_INVALID_ARGUMENT);
    CHECK(strstr(lw_last_error(NULL), kFields[k].name) != NULL);
  }
  config.epsilon = 0.02;
  CHECK(lw_probe_change_estimator(probe, &config, LW_FIELD_EPSILON) == LW_FAILED_PRECONDITION);
  CHECK(strstr(lw_last_error(NULL), "recording") != NULL);
  config.setting = 4;
  CHECK(lw_probe_change_estimator(probe, &config, LW_FIELD_SETTING) == LW_FAILED_PRECONDITION);
  config.setting = 5;
  CHECK(lw_probe_change_estimator(probe, &config, LW_FIELD_SETTING) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_change_estimator(probe, &config, 0) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "no field") != NULL);
  CHECK(lw_probe_change_estimator(probe, &config, LW_FIELD_EPSILON | (uint64_t)1 << 40) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "LW_FIELD_") != NULL);
  /* An older application's struct does not have this field. */
  shorter = config;
  shorter.size = (uint32_t)offsetof(lw_estimator_config, marker_decimation);
  CHECK(lw_probe_change_estimator(probe, &shorter, LW_FIELD_EPSILON) == LW_FAILED_PRECONDITION);
  CHECK(lw_probe_change_estimator(probe, &shorter, LW_FIELD_MARKER_DECIMATION) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "size") != NULL);
  CHECK(lw_probe_get_estimator(probe, &config) == LW_FAILED_PRECONDITION && config.band == 9);
}

static void the_past_and_the_far_future(lw_probe* probe, lw_lighting* scratch) {
  lw_lighting_info info = {.size = sizeof info};
  uint64_t seen = 113;
  CHECK(lw_probe_wait_for_next(probe, &seen, INT64_MAX, scratch) == LW_FAILED_PRECONDITION);
  CHECK(lw_probe_wait_for_next(probe, NULL, -1, scratch) == LW_OK);
  CHECK(lw_probe_at(probe, INT64_MIN, scratch) == LW_OK && lw_lighting_get_info(scratch, &info) == LW_OK);
  CHECK(info.validity == LW_BEFORE_HISTORY && strstr(info.reason, "history") != NULL);
  CHECK(lw_probe_at(probe, INT64_MAX, scratch) == LW_OK && lw_lighting_get_info(scratch, &info) == LW_OK);
  CHECK(info.validity == LW_STALE && info.sequence == 113);
  CHECK(info.derivation == LW_HELD);
  CHECK(lw_probe_at(probe, info.mid_exposure_ns, scratch) == LW_OK && lw_lighting_get_info(scratch, &info) == LW_OK);
  CHECK(info.validity == LW_VALID && info.age_ns == 0 && info.reason[0] == '\0' && info.derivation == LW_MEASURED);
}

/* Batch queries sum in another order: within 1e-5 of the largest irradiance, which is the light's 10. */
static int near(const float* a, const float* b) {
  int k;
  for (k = 0; k < 3; ++k)
    if (!(fabsf(a[k] - b[k]) <= 1e-4F)) return 0;
  return 1;
}

static void batches_keep_strides(lw_lighting* light) {
  /* Vertices of position and normal, and values into the middle of others. */
  float vertices[4][6] = {{9, 9, 9, 0, 1, 0}, {9, 9, 9, 1, 0, 0}, {9, 9, 9, 0, 0, 2}, {9, 9, 9, -1, 1, -1}};
  float out[4][5], packed[12];
  lw_answer a = {.size = sizeof a}, one = {.size = sizeof one};
  int i, k;
  for (i = 0; i < 4; ++i)
    for (k = 0; k < 5; ++k) out[i][k] = -7;
  CHECK(lw_lighting_irradiance_batch(light, &vertices[0][3], sizeof vertices[0], 4, &out[0][1], sizeof out[0], &a) ==
        LW_OK);
  CHECK(a.validity == LW_VALID && a.refused == 0 && a.error_bound > 0);
  for (i = 0; i < 4; ++i) {
    CHECK(lw_lighting_irradiance(light, &vertices[i][3], &one) == LW_OK);
    CHECK(near(&out[i][1], one.value));
    CHECK(out[i][0] == -7 && out[i][4] == -7);
    memcpy(packed + 3 * i, &vertices[i][3], 12);
  }
  /* More than one chunk, with some invalid normals. */
  {
    enum { kMany = 1000 };
    static float many[kMany][3], values[kMany][3];
    for (i = 0; i < kMany; ++i) {
      many[i][0] = i % 100 == 0 ? NAN : (float)(i - 500);
      many[i][1] = 30;
      many[i][2] = (float)(i % 37) - 18;
    }
    CHECK(lw_lighting_irradiance_batch(light, many[0], 0, kMany, values[0], 0, &a) == LW_OK && a.refused == 10);
    for (i = 0; i < kMany; ++i) {
      CHECK(lw_lighting_irradiance(light, many[i], &one) == LW_OK && near(values[i], one.value));
    }
    CHECK(lw_lighting_radiance_batch(light, many[0], 0, kMany, 0.5F, values[0], 0, &a) == LW_OK && a.refused == 10);
    for (i = 0; i < kMany; ++i) {
      CHECK(lw_lighting_radiance(light, many[i], 0.5F, &one) == LW_OK && memcmp(values[i], one.value, 12) == 0);
    }
  }
  /* In place, over the inputs. */
  CHECK(lw_lighting_irradiance_batch(light, packed, 0, 4, packed, 12, NULL) == LW_OK);
  for (i = 0; i < 4; ++i) CHECK(memcmp(packed + 3 * i, &out[i][1], 12) == 0);
}

/* Options without a field in the C ABI cannot be set from C. */
static void texts_of_options_arrive(void) {
  lw_probe_options options = {.size = sizeof options};
  lw_probe* none = NULL;
  options.credentials_folder = "/no/such/folder";
  CHECK(lw_probe_connect("grpcs://127.0.0.1:1", LW_ZERO_TERMINATED, &options, &none) == LW_NOT_FOUND);
  CHECK(strstr(lw_last_error(NULL), "/no/such/folder") != NULL && none == NULL);
  options.credentials_folder = NULL;
  options.mqtt_ca_file = "/no/such/ca.pem";
  CHECK(lw_probe_connect("mqtts://127.0.0.1:1/a", LW_ZERO_TERMINATED, &options, &none) == LW_NOT_FOUND);
  CHECK(strstr(lw_last_error(NULL), "/no/such/ca.pem") != NULL);
  options.mqtt_ca_file = NULL;
  options.mqtt_certificate_file = "own.pem";
  CHECK(lw_probe_connect("mqtts://127.0.0.1:1/a", LW_ZERO_TERMINATED, &options, &none) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "key_file") != NULL);
  options.mqtt_key_file = "/no/such/key.pem";
  options.mqtt_certificate_file = "/dev/null";
  CHECK(lw_probe_connect("mqtts://127.0.0.1:1/a", LW_ZERO_TERMINATED, &options, &none) == LW_NOT_FOUND);
  CHECK(strstr(lw_last_error(NULL), "/no/such/key.pem") != NULL);
  options.mqtt_certificate_file = options.mqtt_key_file = NULL;
  options.mqtt_password = "guess";
  CHECK(lw_probe_connect("mqtt://127.0.0.1:1/a", LW_ZERO_TERMINATED, &options, &none) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "user") != NULL);
  options.mqtt_user = "ann";
  options.connect_timeout_ns = 200000000;
  CHECK(lw_probe_connect("mqtt://127.0.0.1:1/a", LW_ZERO_TERMINATED, &options, &none) == LW_UNAVAILABLE);
}

/* A recording has no mounting. */
static void without_a_mounting_there_is_no_world(const lw_probe* probe, lw_lighting* scratch) {
  lw_lighting_info info = {.size = sizeof info};
  lw_probe_info probe_info = {.size = sizeof probe_info};
  lw_lighting* world = NULL;
  CHECK(lw_lighting_create(&world) == LW_OK);
  CHECK(lw_probe_latest_in_world(probe, world) == LW_OK && lw_lighting_get_info(world, &info) == LW_OK);
  CHECK(info.validity == LW_INVALID_QUERY && info.light_count == 0);
  CHECK(lw_probe_get_info(probe, &probe_info) == LW_OK && probe_info.mounted == 0 && probe_info.orientation[3] == 0);
  CHECK(lw_probe_latest_in_world(NULL, scratch) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_latest_in_world(probe, NULL) == LW_INVALID_ARGUMENT);
  lw_lighting_release(world);
}

static int is_at(const float* p, float x, float y, float z) {
  return fabsf(p[0] - x) < 1e-5F && fabsf(p[1] - y) < 1e-5F && fabsf(p[2] - z) < 1e-5F;
}

/* The golden vector: a lamp at 0.3 m towards +X from an origin at (0.0625, -0.125, -0.75), and a distant one. */
static void near_lamps_have_positions(const char* vectors, lw_lighting* without) {
  lw_lighting* light = lighting_of(vectors, "v1_near_lamp");
  lw_light lights[2], older;
  lw_lighting_info info = {.size = sizeof info};
  size_t count = 0;
  /* A quarter to the left: +X becomes -Z, -Z becomes -X. */
  const double place[3] = {5, -2, 100}, left[4] = {0, 0.70710678118654757, 0, 0.70710678118654757};
  CHECK(lw_lighting_lights(light, lights, sizeof *lights, 2, &count) == LW_OK && count == 2);
  CHECK(lights[0].distance == 0.3F && lights[0].distance_sigma == 0.0052F);
  CHECK(is_at(lights[0].position, 0.3625F, -0.125F, -0.75F));
  CHECK(lights[1].distance == 0 && lights[1].distance_sigma == 0 && is_at(lights[1].position, 0, 0, 0));
  CHECK(lw_lighting_get_info(light, &info) == LW_OK);
  CHECK(info.origin_position[0] == 0.0625 && info.origin_position[1] == -0.125 && info.origin_position[2] == -0.75);
  CHECK(info.origin_orientation[0] == 0.5 && info.origin_orientation[1] == -0.5 && info.origin_orientation[3] == 0.5);
  CHECK(lw_lighting_rotated(light, left, light) == LW_OK);
  CHECK(lw_lighting_lights(light, lights, sizeof *lights, 2, &count) == LW_OK);
  CHECK(is_at(lights[0].position, -0.75F, -0.125F, -0.3625F));
  lw_lighting_release(light);
  light = lighting_of(vectors, "v1_near_lamp");
  CHECK(lw_lighting_in_world(light, place, left, light) == LW_OK);
  CHECK(lw_lighting_lights(light, lights, sizeof *lights, 2, &count) == LW_OK);
  CHECK(is_at(lights[0].direction, 0, 0, -1) && is_at(lights[0].position, 4.25F, -2.125F, 99.6375F));
  CHECK(lights[0].distance == 0.3F && lights[1].distance == 0);
  CHECK(lw_lighting_get_info(light, &info) == LW_OK && fabs(info.origin_position[2] - 99.9375) < 1e-9);
  /* An application of version 1.1 has a struct without the distance. */
  memset(&older, 0x5A, sizeof older);
  CHECK(lw_lighting_lights(light, &older, offsetof(lw_light, distance), 1, &count) == LW_OK);
  CHECK(older.track == 3 && ((unsigned char*)&older)[offsetof(lw_light, distance)] == 0x5A);
  memset(&info, 0x5A, sizeof info);
  info.size = (uint32_t)offsetof(lw_lighting_info, origin_position);
  CHECK(lw_lighting_get_info(light, &info) == LW_OK && info.derivation == LW_MEASURED);
  CHECK(((unsigned char*)&info)[offsetof(lw_lighting_info, origin_position)] == 0x5A);
  /* Of a probe: the origin is the probe. */
  info.size = sizeof info;
  CHECK(lw_lighting_get_info(without, &info) == LW_OK && info.origin_position[2] == 0 &&
        info.origin_orientation[3] == 1);
  CHECK(lw_lighting_lights(without, lights, sizeof *lights, 2, &count) == LW_OK && lights[0].distance == 0);
  lw_lighting_release(light);
}

int main(int argc, char** argv) {
  lw_lighting *light, *scratch = NULL;
  lw_probe* probe;
  if (argc != 3) return 2;
  light = lamp(argv[1]);
  CHECK(lw_lighting_create(&scratch) == LW_OK);
  probe = played(argv[2], scratch);
  decoding_is_careful(argv[1]);
  sizes_are_kept(light, argv[2]);
  options_are_checked(argv[2], probe);
  changes_name_their_fields(probe);
  texts_of_options_arrive();
  without_a_mounting_there_is_no_world(probe, scratch);
  the_past_and_the_far_future(probe, scratch);
  batches_keep_strides(light);
  near_lamps_have_positions(argv[1], light);
  lw_probe_close(probe);
  lw_lighting_release(light);
  lw_lighting_release(scratch);
  return checks_failed(150);
}
