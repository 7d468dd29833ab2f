/* Light estimates through the C ABI: the results of C++ (answers/estimate_answers.hpp), defaults, errors. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lightwell/light_estimate.h>

#include "check.h"

enum { NUMBERS = 64 };
static int estimates = 0, temperatures = 0, weights = 0;

static int numbers(char* text, double* v) {
  int n = 0;
  char* end = text;
  while (n < NUMBERS) {
    v[n] = strtod(text, &end);
    if (end == text) break;
    text = end;
    ++n;
  }
  return n;
}

static void decode(char* hex, lw_lighting* light) {
  static unsigned char bytes[1 << 16];
  size_t i, count = strlen(hex) / 2;
  for (i = 0; i < count; ++i) {
    const char pair[3] = {hex[2 * i], hex[2 * i + 1], '\0'};
    bytes[i] = (unsigned char)strtoul(pair, NULL, 16);
  }
  CHECK(lw_lighting_decode(bytes, count, 0, light) == LW_OK);
}

static void estimate_is_that_of_cpp(const lw_lighting* light, const double* v, int n) {
  lw_light_estimate_options options = {.size = sizeof options};
  lw_light_estimate e = {.size = sizeof e};
  int i;
  CHECK(lw_light_estimate_defaults(&options) == LW_OK);
  options.requested = (uint32_t)v[0];
  options.gain = (float)v[1];
  options.neutral_illuminance = (float)v[2];
  CHECK(n == 46 && lw_lighting_estimate(light, &options, &e) == LW_OK);
  CHECK(e.validity == (int)v[3] && e.available == (uint32_t)v[4] && e.ambient_lumens == (float)v[5]);
  CHECK(e.mean_illuminance == (float)v[6] && e.color_temperature == (float)v[7] && e.duv == (float)v[8]);
  for (i = 0; i < 3; ++i) CHECK(e.ambient_color[i] == (float)v[9 + i]);
  for (i = 0; i < 27; ++i) CHECK(e.ambient_spherical_harmonics[i] == (float)v[12 + i]);
  for (i = 0; i < 3; ++i) CHECK(e.main_light_direction[i] == (float)v[39 + i]);
  for (i = 0; i < 3; ++i) CHECK(e.main_light_color[i] == (float)v[42 + i]);
  CHECK(e.main_light_lumens == (float)v[45]);
  ++estimates;
}

static void line_is_that_of_cpp(char* word, char* rest, lw_lighting* light) {
  double v[NUMBERS];
  int n;
  if (strcmp(word, "message") == 0) {
    decode(rest, light);
    return;
  }
  n = numbers(rest, v);
  if (strcmp(word, "estimate") == 0) {
    estimate_is_that_of_cpp(light, v, n);
  } else if (strcmp(word, "temperature") == 0) {
    const float rgb[3] = {(float)v[0], (float)v[1], (float)v[2]};
    double kelvin = -1, duv = -1;
    CHECK(n == 5 && lw_color_temperature(rgb, &kelvin, &duv) == LW_OK && fabs(kelvin - v[3]) <= 1e-12 * v[3]);
    CHECK(fabs(duv - v[4]) <= 1e-14);
    ++temperatures;
  } else if (strcmp(word, "fade") == 0) {
    float weight = -1;
    CHECK(n == 4 && lw_fade_weight((int64_t)v[0], (int64_t)v[1], (int64_t)v[2], &weight) == LW_OK);
    CHECK(weight == (float)v[3]);
    ++weights;
  } else {
    CHECK(strcmp(word, "a line of a known kind") == 0);
  }
}

/* Leaves the light of the last message, which has lights. */
static void answers_are_those_of_cpp(const char* path, lw_lighting* light) {
  static char line[1 << 17];
  FILE* file = fopen(path, "r");
  CHECK(file != NULL);
  while (file != NULL && fgets(line, sizeof line, file) != NULL) {
    char* rest = strpbrk(line, " \n");
    CHECK(rest != NULL);
    if (rest == NULL) break;
    *rest++ = '\0';
    rest[strcspn(rest, "\n")] = '\0';
    line_is_that_of_cpp(line, rest, light);
  }
  if (file != NULL) fclose(file);
  CHECK(estimates > 500 && temperatures > 300 && weights > 70);
}

static void options_are_checked(const lw_lighting* light) {
  lw_light_estimate_options good = {.size = sizeof good}, options;
  lw_light_estimate e = {.size = sizeof e};
  const float bad[] = {0, -1, NAN, INFINITY};
  size_t i;
  CHECK(lw_light_estimate_defaults(&good) == LW_OK && good.requested == LW_REQUEST_ALL && good.gain == 1);
  CHECK(good.neutral_illuminance == 1000);
  CHECK(lw_lighting_estimate(light, NULL, &e) == LW_OK && e.available == LW_REQUEST_ALL && e.ambient_lumens > 0);
  for (i = 0; i < sizeof bad / sizeof *bad; ++i) {
    options = good;
    options.gain = bad[i];
    CHECK(lw_lighting_estimate(light, &options, &e) == LW_INVALID_ARGUMENT && e.validity == LW_INVALID_QUERY);
    CHECK(strstr(lw_last_error(NULL), "gain") != NULL && e.ambient_lumens == 0);
    options = good;
    options.neutral_illuminance = bad[i];
    CHECK(lw_lighting_estimate(light, &options, &e) == LW_INVALID_ARGUMENT);
    CHECK(strstr(lw_last_error(NULL), "neutral_illuminance") != NULL);
  }
  options = good;
  options.requested = 32;
  CHECK(lw_lighting_estimate(light, &options, &e) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "requested") != NULL);
  CHECK(lw_lighting_estimate(NULL, &good, &e) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_estimate(light, &good, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_light_estimate_defaults(NULL) == LW_INVALID_ARGUMENT);
}

static void pointers_and_times_are_checked(const lw_lighting* light) {
  float weight = 7;
  const float black[3] = {0, 0, 0}, white[3] = {1, 1, 1};
  double kelvin = 7;
  CHECK(lw_color_temperature(NULL, &kelvin, NULL) == LW_INVALID_ARGUMENT && kelvin == 7);
  CHECK(lw_color_temperature(black, &kelvin, NULL) == LW_OK && kelvin == 0);
  CHECK(lw_color_temperature(white, NULL, NULL) == LW_OK);
  CHECK(lw_fade_weight(0, -1, 0, &weight) == LW_INVALID_ARGUMENT && weight == 7);
  CHECK(strstr(lw_last_error(NULL), "hold") != NULL);
  CHECK(lw_fade_weight(0, 0, -1, &weight) == LW_INVALID_ARGUMENT && strstr(lw_last_error(NULL), "fade") != NULL);
  CHECK(lw_fade_weight(0, 0, 0, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_fade_weight(light, 1000000, 1000000, &weight) == LW_OK && weight == 1);
  CHECK(lw_lighting_fade_weight(NULL, 1, 1, &weight) == LW_INVALID_ARGUMENT);
}

int main(int argc, char** argv) {
  lw_lighting* light = NULL;
  if (argc != 2) return 2;
  CHECK(lw_lighting_create(&light) == LW_OK);
  answers_are_those_of_cpp(argv[1], light);
  options_are_checked(light);
  pointers_and_times_are_checked(light);
  lw_lighting_release(light);
  return checks_failed(20000);
}
