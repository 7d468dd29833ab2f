/* Invalid handles, NULL pointers and invalid arguments: every function returns an error. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <lightwell/conventions.h>
#include <lightwell/lightwell.h>

#include "check.h"
#include "lamp.h"

/* After a failed call the struct contains no old light, for callers that ignore the status. */
static void a_failed_call_leaves_no_light(const lw_lighting* light) {
  const float up[3] = {0, 1, 0};
  float values[3] = {5, 5, 5};
  lw_answer a = {.size = sizeof a};
  lw_lighting_info info = {.size = sizeof info};
  lw_unity unity = {.size = sizeof unity};
  CHECK(lw_lighting_irradiance(light, up, &a) == LW_OK && a.validity == LW_VALID && a.value[0] != 0);
  CHECK(lw_lighting_irradiance(NULL, up, &a) == LW_INVALID_ARGUMENT);
  CHECK(a.validity == LW_INVALID_QUERY && a.value[0] == 0 && strstr(a.reason, "lw_last_error") != NULL);
  CHECK(lw_lighting_radiance(light, up, 1, &a) == LW_OK && a.validity == LW_VALID);
  CHECK(lw_lighting_radiance(light, NULL, 1, &a) == LW_INVALID_ARGUMENT && a.validity == LW_INVALID_QUERY);
  CHECK(lw_lighting_irradiance_batch(light, up, 0, 1, values, 0, &a) == LW_OK && a.validity == LW_VALID);
  values[0] = 5;
  CHECK(lw_lighting_irradiance_batch(light, up, 3, 1, values, 0, &a) == LW_INVALID_ARGUMENT);
  CHECK(a.validity == LW_INVALID_QUERY && values[0] == 5);
  CHECK(lw_lighting_get_info(light, &info) == LW_OK && info.validity == LW_VALID);
  CHECK(lw_lighting_get_info(NULL, &info) == LW_INVALID_ARGUMENT && info.validity == LW_INVALID_QUERY);
  CHECK(lw_lighting_to_unity(light, 0, 0, NULL, &unity) == LW_OK && unity.intensity > 0);
  CHECK(lw_lighting_to_unity(light, 9, 0, NULL, &unity) == LW_INVALID_ARGUMENT);
  CHECK(unity.validity == LW_INVALID_QUERY && unity.intensity == 0 && unity.sphericalHarmonicsL2[0] == 0);
}

static void versions_and_names(void) {
  size_t length = 99;
  CHECK(lw_abi_version() == LW_ABI_VERSION);
  CHECK(strlen(lw_version()) >= 5);
  CHECK(strcmp(lw_status_name(LW_UNAVAILABLE), "unavailable") == 0);
  CHECK(strcmp(lw_status_name(-1), "unknown") == 0 && strcmp(lw_status_name(8), "unknown") == 0);
  CHECK(strcmp(lw_validity_name(LW_BEFORE_HISTORY), "before_history") == 0);
  CHECK(strcmp(lw_validity_name(77), "unknown") == 0);
  CHECK(lw_last_error(&length)[length] == '\0');
  CHECK(lw_now_ns() > 0);
}

static void no_handle_is_refused(lw_lighting* light) {
  const float up[3] = {0, 1, 0};
  double aligned_garbage[32];
  float values[3];
  double q[4] = {0, 0, 0, 1};
  lw_answer a = {.size = sizeof a};
  lw_lighting_info info = {.size = sizeof info};
  lw_probe_info probe_info = {.size = sizeof probe_info};
  lw_link_stats stats = {.size = sizeof stats};
  lw_environment map = {.size = sizeof map};
  lw_estimator_config config = {.size = sizeof config};
  lw_estimator_kind kind = 0;
  const lw_lighting* none[3];
  int i;
  size_t k;
  for (k = 0; k < 32; ++k) aligned_garbage[k] = 1.5;
  none[0] = NULL;
  none[1] = (const lw_lighting*)(const void*)aligned_garbage;
  none[2] = (const lw_lighting*)(const void*)((const char*)aligned_garbage + 1);
  for (i = 0; i < 3; ++i) {
    const lw_lighting* bad = none[i];
    lw_lighting* bad_into = (lw_lighting*)(void*)(size_t)bad;
    const lw_probe* bad_probe = (const lw_probe*)(const void*)bad;
    lw_probe* bad_target = (lw_probe*)(void*)(size_t)bad;
    CHECK(lw_lighting_irradiance(bad, up, &a) == LW_INVALID_ARGUMENT);
    CHECK(strstr(lw_last_error(NULL), "lw_lighting") != NULL);
    CHECK(lw_lighting_radiance(bad, up, 1, &a) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_irradiance_batch(bad, up, 0, 1, values, 0, NULL) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_radiance_batch(bad, up, 0, 1, 1, values, 0, NULL) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_get_info(bad, &info) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_reason(bad, NULL, 0, NULL) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_harmonics(bad, LW_RADIANCE, 0, values, NULL) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_lights(bad, NULL, 0, 0, &k) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_environment(bad, &map) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_environment_radiance(bad, 0, values, 3) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_environment_texels(bad, 0, NULL, 0) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_rotated(bad, q, light) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_rotated(light, q, bad_into) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_in_world(bad, q, q, light) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_in_world(light, q, q, bad_into) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_copy(bad, light) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_copy(light, bad_into) == LW_INVALID_ARGUMENT);
    CHECK(lw_lighting_decode("", 0, 0, bad_into) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_latest(bad_probe, light) == LW_INVALID_ARGUMENT);
    CHECK(strstr(lw_last_error(NULL), "lw_probe") != NULL);
    CHECK(lw_probe_at(bad_probe, 0, light) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_wait_for_next(bad_probe, NULL, 0, light) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_get_info(bad_probe, &probe_info) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_get_stats(bad_probe, &stats) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_text(bad_probe, LW_PROBE_NAME, NULL, 0, NULL) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_set_estimator(bad_target, &config) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_get_estimator(bad_probe, &config) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_get_estimator_kind(bad_probe, &kind) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_change_estimator(bad_target, &config, LW_FIELD_BAND) == LW_INVALID_ARGUMENT);
    CHECK(lw_probe_report_lux(bad_target, 1, up, NULL) == LW_INVALID_ARGUMENT);
    lw_probe_close(bad_target);
    lw_lighting_release(bad_into);
  }
  /* A handle of the other kind. */
  CHECK(lw_probe_latest((const lw_probe*)(const void*)light, light) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_get_info((const lw_probe*)(const void*)light, &probe_info) == LW_INVALID_ARGUMENT);
  lw_probe_close((lw_probe*)(void*)light);
  CHECK(lw_lighting_get_info(light, &info) == LW_OK);
}

static void null_arguments_are_refused(lw_lighting* light, lw_probe* probe) {
  const float up[3] = {0, 1, 0};
  const double identity[4] = {0, 0, 0, 1};
  float values[3];
  size_t count = 0;
  char letter = 'x';
  lw_answer a = {.size = sizeof a};
  CHECK(lw_probe_connect(NULL, 0, NULL, &probe) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_connect("replay:x", LW_ZERO_TERMINATED, NULL, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_create(NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_irradiance(light, NULL, &a) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_irradiance(light, up, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_radiance(light, NULL, 1, &a) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_radiance(light, up, 1, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_irradiance_batch(light, NULL, 0, 1, values, 0, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_irradiance_batch(light, up, 0, 1, NULL, 0, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_irradiance_batch(light, up, 11, 1, values, 0, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_irradiance_batch(light, up, 0, 1, values, 4, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_irradiance_batch(light, NULL, 0, 0, NULL, 0, &a) == LW_OK);
  CHECK(lw_lighting_get_info(light, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_reason(light, NULL, 5, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_harmonics(light, LW_RADIANCE, 0, NULL, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_harmonics(light, LW_RADIANCE, 7, values, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_harmonics(light, LW_RADIANCE, -1, values, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_harmonics(light, 2, 0, values, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_lights(light, NULL, sizeof(lw_light), 1, &count) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_lights(light, NULL, 0, 0, &count) == LW_OK && count == 1);
  CHECK(lw_lighting_environment(light, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_environment_radiance(light, 0, values, 3) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_rotated(light, NULL, light) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_in_world(light, NULL, identity, light) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_in_world(light, identity, NULL, light) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_get_info(probe, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_get_stats(probe, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_text(probe, LW_PROBE_NAME, NULL, 1, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_text(probe, 4, &letter, 1, NULL) == LW_INVALID_ARGUMENT && letter == 'x');
  CHECK(lw_probe_set_estimator(probe, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_change_estimator(probe, NULL, LW_FIELD_BAND) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_get_estimator_kind(probe, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_report_lux(probe, 100, NULL, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_estimator_config_defaults(NULL) == LW_INVALID_ARGUMENT);
}

static int zero(const float* v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }

static void no_question_is_said_so(lw_lighting* light) {
  const float bad[4][3] = {{0, 0, 0}, {NAN, 0, 1}, {0, INFINITY, 0}, {0, 0, -INFINITY}};
  const float up[3] = {0, 1, 0};
  const double no_turn[4] = {0, 0, 0, 0}, nan_turn[4] = {NAN, 0, 0, 1}, identity[4] = {0, 0, 0, 1};
  const float batch[9] = {0, 1, 0, NAN, 0, 0, 1, 0, 0};
  float values[9];
  lw_answer a = {.size = sizeof a};
  lw_lighting_info info = {.size = sizeof info};
  lw_lighting* turned = NULL;
  int i;
  for (i = 0; i < 4; ++i) {
    CHECK(lw_lighting_irradiance(light, bad[i], &a) == LW_OK);
    CHECK(a.validity == LW_INVALID_QUERY && a.refused == 1 && zero(a.value) && a.reason[0] != '\0');
    CHECK(lw_lighting_radiance(light, bad[i], 0.5F, &a) == LW_OK && a.validity == LW_INVALID_QUERY && zero(a.value));
  }
  CHECK(lw_lighting_radiance(light, up, NAN, &a) == LW_OK && a.validity == LW_INVALID_QUERY && zero(a.value));
  CHECK(lw_lighting_radiance(light, up, 7, &a) == LW_OK && a.validity == LW_VALID);
  CHECK(lw_lighting_irradiance_batch(light, batch, 0, 3, values, 0, &a) == LW_OK);
  CHECK(a.validity == LW_INVALID_QUERY && a.refused == 1 && zero(values + 3) && !zero(values) && !zero(values + 6));
  CHECK(lw_lighting_radiance_batch(light, batch, 0, 3, NAN, values, 0, &a) == LW_OK && a.refused == 3);
  CHECK(lw_lighting_create(&turned) == LW_OK);
  CHECK(lw_lighting_rotated(light, no_turn, turned) == LW_OK && lw_lighting_get_info(turned, &info) == LW_OK);
  CHECK(info.validity == LW_INVALID_QUERY);
  CHECK(lw_lighting_in_world(light, nan_turn, identity, turned) == LW_OK);
  CHECK(lw_lighting_get_info(turned, &info) == LW_OK && info.validity == LW_INVALID_QUERY);
  CHECK(lw_lighting_rotated(light, nan_turn, turned) == LW_OK);
  CHECK(lw_lighting_irradiance(turned, up, &a) == LW_OK && a.validity == LW_INVALID_QUERY && zero(a.value));
  lw_lighting_release(turned);
}

static void an_empty_lighting_says_why(void) {
  const float up[3] = {0, 1, 0};
  char reason[64];
  size_t length = 0, count = 9;
  lw_answer a = {.size = sizeof a};
  lw_lighting_info info = {.size = sizeof info};
  lw_environment map = {.size = sizeof map};
  lw_lighting* empty = NULL;
  CHECK(lw_lighting_create(&empty) == LW_OK);
  CHECK(lw_lighting_get_info(empty, &info) == LW_OK && info.validity == LW_NONE && info.light_count == 0);
  CHECK(lw_lighting_irradiance(empty, up, &a) == LW_OK && a.validity == LW_NONE && zero(a.value));
  CHECK(strcmp(a.reason, "no descriptor has come yet") == 0);
  CHECK(lw_lighting_lights(empty, NULL, 0, 0, &count) == LW_OK && count == 0);
  CHECK(lw_lighting_environment(empty, &map) == LW_OK && map.level_count == 0);
  CHECK(lw_lighting_reason(empty, reason, sizeof reason, &length) == LW_OK && strlen(reason) == length);
  /* Truncated, but zero-terminated; the length is that of the whole text. */
  CHECK(lw_lighting_reason(empty, reason, 4, &length) == LW_OK && strcmp(reason, "no ") == 0 && length > 4);
  lw_lighting_release(empty);
}

static void conversions_are_asked_well(const lw_lighting* light) {
  lw_conversion_options options = {.size = sizeof options};
  lw_lighting* empty = NULL;
  lw_unity unity = {.size = sizeof unity}, plain = {.size = sizeof plain};
  lw_three three = {.size = sizeof three};
  lw_webxr webxr = {.size = sizeof webxr};
  lw_openxr openxr = {.size = sizeof openxr};
  int i;
  CHECK(lw_lighting_to_unity(NULL, 0, 0, NULL, &unity) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_to_unity(light, 0, 0, NULL, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_to_unity(light, 2, 0, NULL, &unity) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "pipeline is 2") != NULL);
  CHECK(lw_lighting_to_three(light, 0, -1, NULL, &three) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_to_webxr(light, 7, NULL, &webxr) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_to_openxr(light, 2, 0, NULL, &openxr) == LW_INVALID_ARGUMENT);
  /* The light at +X shines towards -X; Unity's axes differ in z only. */
  CHECK(lw_lighting_to_unity(light, LW_UNITY_HIGH_DEFINITION, LW_MAIN_LIGHT_APART, NULL, &plain) == LW_OK);
  CHECK(plain.validity == LW_VALID && plain.residual >= 0 && plain.forward[0] == -1 && plain.intensity == 10);
  /* A matrix halves all colours; without LW_RESIDUAL_MEASURED there is no residual. */
  for (i = 0; i < 9; i += 4) options.color[i] = 0.5F;
  options.residual = LW_RESIDUAL_LEFT_OUT;
  CHECK(lw_lighting_to_unity(light, LW_UNITY_HIGH_DEFINITION, LW_MAIN_LIGHT_APART, &options, &unity) == LW_OK);
  CHECK(unity.intensity == 5 && unity.residual == -1);
  for (i = 0; i < 27; ++i) CHECK(fabsf(unity.sphericalHarmonicsL2[i] - plain.sphericalHarmonicsL2[i] / 2) < 1e-5F);
  options.residual = 2;
  CHECK(lw_lighting_to_three(light, 0, 0, &options, &three) == LW_INVALID_ARGUMENT);
  options.residual = 0;
  options.color[3] = NAN;
  CHECK(lw_lighting_to_three(light, 0, 0, &options, &three) == LW_OK && three.validity == LW_INVALID_QUERY);
  CHECK(three.intensity == 0 && three.lightProbeIntensity == 0);
  CHECK(lw_lighting_create(&empty) == LW_OK);
  CHECK(lw_lighting_to_three(empty, 0, 0, NULL, &three) == LW_OK && three.validity == LW_NONE && three.residual == -1);
  lw_lighting_release(empty);
}

int main(int argc, char** argv) {
  lw_lighting *light, *scratch = NULL;
  lw_probe* probe;
  if (argc != 3) return 2;
  light = lamp(argv[1]);
  CHECK(lw_lighting_create(&scratch) == LW_OK);
  probe = played(argv[2], scratch);
  a_failed_call_leaves_no_light(light);
  versions_and_names();
  no_handle_is_refused(light);
  null_arguments_are_refused(light, probe);
  no_question_is_said_so(light);
  an_empty_lighting_says_why();
  conversions_are_asked_well(light);
  lw_probe_close(probe);
  /* Lightings stay valid after the probe is closed. */
  {
    lw_lighting_info info = {.size = sizeof info};
    CHECK(lw_lighting_get_info(scratch, &info) == LW_OK && info.sequence == 113);
  }
  lw_lighting_release(light);
  lw_lighting_release(scratch);
  return checks_failed(150);
}
