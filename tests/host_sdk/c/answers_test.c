/* Results of the C ABI are bit-exactly those of C++, for messages and for a replayed recording. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lightwell/conventions.h>
#include <lightwell/lightwell.h>

#include "check.h"

static const int64_t kTestTimeout = 60000000000;

/* Bit-exact comparison with a number of nine digits. */
static int same(const float* got, const double* expected) {
  return got[0] == (float)expected[0] && got[1] == (float)expected[1] && got[2] == (float)expected[2];
}

static int numbers(const char* text, double* out, int most) {
  int n = 0;
  char* end = NULL;
  for (; n < most; ++n, text = end) {
    out[n] = strtod(text, &end);
    if (end == text) break;
  }
  return n;
}

static void decode(const char* hex, lw_lighting* into) {
  const size_t length = strlen(hex) / 2;
  unsigned char* bytes = malloc(length + 1);
  size_t i;
  for (i = 0; i < length; ++i) {
    const char digits[3] = {hex[2 * i], hex[2 * i + 1], 0};
    bytes[i] = (unsigned char)strtoul(digits, NULL, 16);
  }
  CHECK(lw_lighting_decode(bytes, length, 0, into) == LW_OK);
  free(bytes);
}

static void play(const char* recording, lw_lighting* into) {
  char uri[1100];
  lw_probe* probe = NULL;
  uint64_t seen = 0;
  lw_status status;
  lw_lighting_info info = {.size = sizeof info};
  lw_link_stats stats = {.size = sizeof stats};
  char name[16];
  size_t length = 0;
  snprintf(uri, sizeof uri, "replay:%s?speed=0", recording);
  status = lw_probe_connect(uri, LW_ZERO_TERMINATED, NULL, &probe);
  if (status != LW_OK) fprintf(stderr, "%s\n", lw_last_error(NULL));
  CHECK(status == LW_OK);
  if (status != LW_OK) return;
  status = lw_probe_wait_for_next(probe, NULL, kTestTimeout, into);
  while (status == LW_OK) {
    CHECK(lw_lighting_get_info(into, &info) == LW_OK);
    seen = info.sequence;
    status = lw_probe_wait_for_next(probe, &seen, kTestTimeout, into);
  }
  CHECK(status == LW_FAILED_PRECONDITION);
  CHECK(strstr(lw_last_error(&length), "ended") != NULL && length > 0);
  CHECK(lw_probe_latest(probe, into) == LW_OK);
  CHECK(lw_probe_get_stats(probe, &stats) == LW_OK);
  CHECK(stats.state == LW_LINK_ENDED && stats.received == 14 && stats.gaps == 0 && stats.maps == 2);
  CHECK(lw_probe_text(probe, LW_PROBE_NAME, name, sizeof name, &length) == LW_OK);
  CHECK(strcmp(name, "attic") == 0 && length == 5);
  lw_probe_close(probe);
}

static void check_info(const lw_lighting* light, const char* line) {
  double v[6];
  char* rest = NULL;
  lw_lighting_info info = {.size = sizeof info};
  const uint64_t sequence = strtoull(line, &rest, 10);
  CHECK(numbers(rest, v, 6) == 6);
  CHECK(lw_lighting_get_info(light, &info) == LW_OK);
  CHECK(info.sequence == sequence);
  CHECK(info.units == (lw_units)v[0]);
  CHECK(info.flags == (uint32_t)v[1]);
  CHECK(info.bound_total == (float)v[2]);
  CHECK(info.band == (int32_t)v[3]);
  CHECK(info.light_count == (uint32_t)v[4]);
  CHECK(info.coverage == (float)v[5]);
}

/* The remaining numbers of an `engine` line. */
static const double* expected;
static int expected_left;

static void meet(const float* got, int count) {
  int i;
  for (i = 0; i < count && expected_left > 0; ++i, ++expected, --expected_left) CHECK(got[i] == (float)*expected);
  CHECK(i == count);
}

static void meet_number(int32_t got) {
  const float number = (float)got;
  meet(&number, 1);
}

static void meet_head(lw_validity validity, float residual) {
  meet_number(validity);
  meet(&residual, 1);
}

static void check_renderer(const lw_lighting* light, const char* name, int32_t a, int32_t b) {
  if (strcmp(name, "unity") == 0) {
    lw_unity v = {.size = sizeof v};
    CHECK(lw_lighting_to_unity(light, a, b, NULL, &v) == LW_OK);
    meet_head(v.validity, v.residual);
    meet(v.sphericalHarmonicsL2, 27), meet(v.forward, 3), meet(v.color, 3), meet(&v.intensity, 1);
  } else if (strcmp(name, "three") == 0) {
    lw_three v = {.size = sizeof v};
    CHECK(lw_lighting_to_three(light, a, b, NULL, &v) == LW_OK);
    meet_head(v.validity, v.residual);
    meet(v.sh, 27), meet(&v.lightProbeIntensity, 1), meet(v.position, 3), meet(v.color, 3), meet(&v.intensity, 1);
  } else if (strcmp(name, "filament") == 0) {
    lw_filament v = {.size = sizeof v};
    CHECK(lw_lighting_to_filament(light, a, NULL, &v) == LW_OK);
    meet_head(v.validity, v.residual);
    meet(v.irradiance, 27), meet(v.radiance, 27), meet(&v.indirectIntensity, 1);
    meet(v.direction, 3), meet(v.color, 3), meet(&v.intensity, 1), meet(&v.sunAngularRadius, 1);
  } else {
    lw_unreal v = {.size = sizeof v};
    CHECK(strcmp(name, "unreal") == 0 && lw_lighting_to_unreal(light, a, NULL, &v) == LW_OK);
    meet_head(v.validity, v.residual);
    meet(v.R, 9), meet(v.G, 9), meet(v.B, 9);
    meet(v.forward, 3), meet(v.color, 3), meet(&v.intensity, 1), meet(&v.lightSourceAngle, 1);
  }
}

static void check_engine(const lw_lighting* light, char* line) {
  static double v[128];
  char* numbers_at = strchr(line, ' ');
  int32_t a, b;
  CHECK(numbers_at != NULL);
  if (numbers_at == NULL) return;
  *numbers_at++ = '\0';
  expected_left = numbers(numbers_at, v, 128) - 2;
  expected = v + 2;
  a = (int32_t)v[0], b = (int32_t)v[1];
  if (strcmp(line, "webxr") == 0) {
    lw_webxr e = {.size = sizeof e};
    CHECK(lw_lighting_to_webxr(light, a, NULL, &e) == LW_OK);
    meet_head(e.validity, e.residual);
    meet(e.sphericalHarmonicsCoefficients, 27), meet(e.primaryLightDirection, 4), meet(e.primaryLightIntensity, 4);
  } else if (strcmp(line, "arcore") == 0) {
    lw_arcore e = {.size = sizeof e};
    CHECK(lw_lighting_to_arcore(light, NULL, &e) == LW_OK);
    meet_head(e.validity, e.residual);
    meet_number(e.state), meet(e.environmentalHdrMainLightDirection, 3);
    meet(e.environmentalHdrMainLightIntensity, 3), meet(e.environmentalHdrAmbientSphericalHarmonics, 27);
  } else if (strcmp(line, "openxr") == 0) {
    lw_openxr e = {.size = sizeof e};
    CHECK(lw_lighting_to_openxr(light, a, b, NULL, &e) == LW_OK);
    meet_head(e.validity, e.residual);
    meet_number(e.state), meet_number(e.ambientLightState);
    meet(e.ambientLightIntensity, 3), meet(e.ambientLightColorCorrection, 3);
    meet_number(e.sphericalHarmonicsState), meet_number(e.sphericalHarmonicsKind);
    meet(e.sphericalHarmonicsCoefficients, 27), meet_number(e.directionalLightState);
    meet(e.directionalLightIntensity, 3), meet(e.directionalLightDirection, 3);
  } else if (strcmp(line, "arkit") == 0) {
    lw_arkit e = {.size = sizeof e};
    CHECK(lw_lighting_to_arkit(light, NULL, &e) == LW_OK);
    meet_head(e.validity, e.residual);
    meet(e.sphericalHarmonicsCoefficients, 27), meet(e.primaryLightDirection, 3);
    meet(&e.primaryLightIntensity, 1), meet(&e.ambientIntensity, 1), meet(&e.ambientColorTemperature, 1);
  } else {
    check_renderer(light, line, a, b);
  }
  CHECK(expected_left == 0);
}

/* One line; `light_number` counts the lines `light` and `level_number` the lines `level` of this message. */
static void check_line(const lw_lighting* light, lw_lighting* turned, const char* word, const char* rest,
                       int* light_number, int* level_number) {
  static float radiance[64 * 64 * 3];
  double v[16];
  float q[3];
  lw_answer a = {.size = sizeof a};
  const int n = numbers(rest, v, 16);
  q[0] = (float)v[0], q[1] = (float)v[1], q[2] = (float)v[2];
  if (strcmp(word, "irradiance") == 0) {
    CHECK(n == 6 && lw_lighting_irradiance(light, q, &a) == LW_OK && same(a.value, v + 3));
    CHECK(a.lights_included == 1 && a.refused == 0);
  } else if (strcmp(word, "radiance") == 0) {
    CHECK(n == 7 && lw_lighting_radiance(light, q, (float)v[3], &a) == LW_OK && same(a.value, v + 4));
    CHECK(a.lights_included == (v[3] > 0));
  } else if (strcmp(word, "coefficient") == 0) {
    float c[3 * LW_MAX_COEFFICIENTS];
    int32_t band = -1;
    CHECK(n == 5 && lw_lighting_harmonics(light, (lw_quantity)v[0], LW_MAX_BAND, c, &band) == LW_OK);
    CHECK(same(c + 3 * (int)v[1], v + 2) && (band + 1) * (band + 1) > (int)v[1]);
  } else if (strcmp(word, "light") == 0) {
    lw_light lights[LW_MAX_LIGHTS];
    size_t count = 0;
    const lw_light* l = &lights[(*light_number)++];
    CHECK(n == 16 && lw_lighting_lights(light, lights, sizeof *lights, LW_MAX_LIGHTS, &count) == LW_OK);
    CHECK(l < lights + count && same(l->direction, v) && same(l->irradiance, v + 3));
    CHECK(l->angular_radius == (float)v[6] && same(l->direction_covariance, v + 7) && l->track == (uint32_t)v[10]);
    CHECK(l->distance == (float)v[11] && l->distance_sigma == (float)v[12]);
    /* A position is computed as double and rounded to float here. */
    for (int k = 0; k < 3; ++k) CHECK(fabs(l->position[k] - v[13 + k]) <= 1e-6 * (1 + fabs(v[13 + k])));
  } else if (strcmp(word, "origin") == 0) {
    lw_lighting_info info = {.size = sizeof info};
    int k;
    CHECK(n == 7 && lw_lighting_get_info(light, &info) == LW_OK);
    /* Nine digits of numbers below 1. */
    for (k = 0; k < 3; ++k) CHECK(fabs(info.origin_position[k] - v[k]) < 1e-8);
    for (k = 0; k < 4; ++k) CHECK(fabs(info.origin_orientation[k] - v[3 + k]) < 1e-8);
  } else if (strcmp(word, "map") == 0 || strcmp(word, "level") == 0) {
    lw_environment map = {.size = sizeof map};
    CHECK(lw_lighting_environment(light, &map) == LW_OK);
    if (strcmp(word, "map") == 0) {
      CHECK(map.level_count == (uint32_t)v[0] && map.exponent == (int32_t)v[1]);
    } else {
      const int k = (*level_number)++;
      CHECK(map.edge[k] == (uint32_t)v[0] && map.roughness[k] == (float)v[1]);
    }
  } else if (strcmp(word, "texel") == 0) {
    CHECK(lw_lighting_environment_radiance(light, (uint32_t)v[0], radiance, 64 * 64 * 3) == LW_OK);
    CHECK(n == 5 && same(radiance + 3 * (int)v[1], v + 2));
  } else if (strcmp(word, "rotated") == 0) {
    const float normal[3] = {(float)v[4], (float)v[5], (float)v[6]};
    double by[4];
    /* Tolerance: the quaternion is given with nine digits only. */
    memcpy(by, v, sizeof by);
    CHECK(n == 10 && lw_lighting_rotated(light, by, turned) == LW_OK);
    CHECK(lw_lighting_irradiance(turned, normal, &a) == LW_OK);
    for (int k = 0; k < 3; ++k) CHECK(fabs(a.value[k] - v[7 + k]) <= 1e-5 * (fabs(v[7 + k]) + 1e4));
  } else {
    CHECK(strcmp(word, "a line of a known kind") == 0);
  }
}

int main(int argc, char** argv) {
  static char line[1 << 17];
  char path[1000], recording[1000];
  FILE* file = NULL;
  lw_lighting *light = NULL, *turned = NULL;
  int light_number = 0, level_number = 0;
  if (argc != 2) return 2;
  snprintf(path, sizeof path, "%s/answers.txt", argv[1]);
  snprintf(recording, sizeof recording, "%s/answers.lwrec", argv[1]);
  file = fopen(path, "r");
  CHECK(file != NULL);
  if (file == NULL) return 1;
  CHECK(lw_lighting_create(&light) == LW_OK && lw_lighting_create(&turned) == LW_OK);
  while (fgets(line, sizeof line, file) != NULL) {
    char* rest = strpbrk(line, " \n");
    CHECK(rest != NULL);
    if (rest == NULL) break;
    *rest++ = '\0';
    rest[strcspn(rest, "\n")] = '\0';
    if (strcmp(line, "message") == 0 || strcmp(line, "final") == 0) {
      light_number = level_number = 0;
      if (strcmp(line, "message") == 0) {
        decode(rest, light);
      } else {
        play(recording, light);
      }
    } else if (strcmp(line, "info") == 0) {
      check_info(light, rest);
    } else if (strcmp(line, "engine") == 0) {
      check_engine(light, rest);
    } else {
      check_line(light, turned, line, rest, &light_number, &level_number);
    }
  }
  fclose(file);
  lw_lighting_release(light);
  lw_lighting_release(turned);
  return checks_failed(2000);
}
