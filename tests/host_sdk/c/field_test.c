/* The light field through the C ABI: the results of C++ (answers/field_answers.hpp), strides, errors. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lightwell/field.h>

#include "check.h"

enum { NUMBERS = 32 };

static lw_light_field* field = NULL;
static lw_lighting* light = NULL;
static size_t next_light = 0, next_probe = 0;
static int updates = 0, points = 0, irradiances = 0, lights = 0;

/* Numbers of a line; NaN as well. */
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

/* Rounding of the solver's sums depends on the alignment of memory: equal but for the last digits. */
static int same(double a, double b) { return a == b || (isnan(a) && isnan(b)) || fabs(a - b) <= 1e-9 * (1 + fabs(b)); }
static int near(float a, double b) { return same(a, (float)b) || fabs(a - b) <= 1e-6 * (1 + fabs(b)); }

static int all_near(const float* got, const double* v, int n) {
  int i;
  for (i = 0; i < n; ++i)
    if (!near(got[i], v[i])) return 0;
  return 1;
}

static int all_same(const double* got, const double* v, int n) {
  int i;
  for (i = 0; i < n; ++i)
    if (!same(got[i], v[i])) return 0;
  return 1;
}

static void decode(const char* hex) {
  static unsigned char bytes[1 << 16];
  const size_t count = strspn(hex, "0123456789abcdefABCDEF") / 2;
  size_t i;
  for (i = 0; i < count; ++i) {
    const char pair[3] = {hex[2 * i], hex[2 * i + 1], '\0'};
    bytes[i] = (unsigned char)strtoul(pair, NULL, 16);
  }
  CHECK(lw_lighting_decode(bytes, count, 0, light) == LW_OK);
}

static void set(char* rest) {
  char* name = strtok(rest, " ");
  char* hex;
  double v[NUMBERS];
  lw_light_field_sample sample = {.size = sizeof sample};
  rest = name + strlen(name) + 1;
  hex = strrchr(rest, ' ') + 1;
  hex[-1] = '\0';
  CHECK(numbers(rest, v) == 10);
  memcpy(sample.position, v, sizeof sample.position);
  memcpy(sample.orientation, v + 3, sizeof sample.orientation);
  sample.position_sigma = v[7];
  sample.orientation_sigma = v[8];
  sample.mid_exposure_ns = (int64_t)v[9];
  decode(hex);
  CHECK(lw_light_field_set(field, name, LW_ZERO_TERMINATED, light, &sample) == LW_OK);
}

static void set_geometry(const double* v) {
  /* Each vertex with something behind it. */
  float vertices[3][4];
  const uint32_t indices[3] = {0, 1, 2};
  int i;
  for (i = 0; i < 9; ++i) vertices[i / 3][i % 3] = (float)v[i];
  CHECK(lw_light_field_set_geometry(field, vertices, sizeof vertices[0], 3, indices, 3) == LW_OK);
}

static void update(const double* v) {
  lw_light_field_state state = {.size = sizeof state};
  CHECK(lw_light_field_update(field, (int64_t)v[0], &state) == LW_OK);
  CHECK(state.light_count == (uint32_t)v[1] && state.probe_count == (uint32_t)v[2] && state.units == (int)v[3]);
  next_light = next_probe = 0;
  ++updates;
}

static void check_light(const double* v) {
  lw_light_field_light got[16];
  size_t count = 0;
  const lw_light_field_light* l = &got[next_light++];
  CHECK(lw_light_field_lights(field, got, sizeof got[0], 16, &count) == LW_OK && count >= next_light);
  CHECK(l->size == sizeof *l && l->id == (uint32_t)v[0] && l->placed == (int)v[1] && l->probes == (uint32_t)v[2]);
  CHECK(all_same(l->position, v + 3, 3) && all_same(l->position_covariance, v + 6, 6));
  CHECK(all_near(l->direction, v + 12, 3) && near(l->direction_sigma, v[15]));
  CHECK(all_near(l->intensity, v + 16, 3) && all_near(l->intensity_gradient, v + 19, 9) && near(l->radius, v[28]));
  ++lights;
}

static void check_probe(char* rest) {
  char* name = strtok(rest, " ");
  char text[64];
  double v[NUMBERS];
  lw_light_field_probe got[16];
  size_t count = 0, length = 0;
  const size_t i = next_probe++;
  CHECK(numbers(name + strlen(name) + 1, v) == 8);
  CHECK(lw_light_field_probes(field, got, sizeof got[0], 16, &count) == LW_OK && count > i);
  CHECK(got[i].state == (int)v[0] && all_same(got[i].position, v + 1, 3) && same(got[i].scale, v[4]));
  CHECK(got[i].lights == v[5] && got[i].matched == v[6] && got[i].ambiguous == v[7]);
  CHECK(lw_light_field_probe_text(field, i, LW_LIGHT_FIELD_NAME, text, sizeof text, &length) == LW_OK);
  CHECK(strcmp(text, name) == 0 && length == strlen(name));
  CHECK(lw_light_field_probe_text(field, i, LW_LIGHT_FIELD_REASON, NULL, 0, &length) == LW_OK);
  CHECK((length == 0) == (got[i].state == LW_LIGHT_FIELD_USED));
}

static void check_point(const double* v) {
  lw_light_field_answer a = {.size = sizeof a};
  lw_lighting_info info = {.size = sizeof info};
  CHECK(lw_light_field_at(field, v, (int64_t)v[3], light, &a) == LW_OK);
  CHECK(a.validity == (int)v[4] && a.age_ns == (int64_t)v[5] && near(a.error_bound, v[6]));
  CHECK(a.flags == (uint32_t)v[7] && a.field_flags == (uint32_t)v[8] && same(a.nearest_probe, v[9]));
  CHECK(lw_lighting_get_info(light, &info) == LW_OK && info.validity == a.validity);
  CHECK(info.light_count == (uint32_t)v[10] && info.band == (int)v[11]);
  if (a.validity == LW_VALID) CHECK(all_same(info.origin_position, v, 3));
  ++points;
}

static void check_irradiance(const double* v) {
  /* Of two receivers in arrays of structs, and packed. */
  struct {
    double position[3];
    float normal[3], value[3];
  } receivers[2];
  lw_light_field_answer answers[2];
  float packed[3];
  int i;
  for (i = 0; i < 6; ++i) {
    receivers[i / 3].position[i % 3] = v[i % 3];
    receivers[i / 3].normal[i % 3] = (float)v[3 + i % 3];
  }
  CHECK(lw_light_field_irradiance(field, receivers, sizeof receivers[0], receivers[0].normal, sizeof receivers[0], 2,
                                  (int64_t)v[6], receivers[0].value, sizeof receivers[0], answers,
                                  sizeof answers[0]) == LW_OK);
  for (i = 0; i < 2; ++i) {
    CHECK(answers[i].size == sizeof answers[i] && answers[i].validity == (int)v[7]);
    CHECK(all_near(receivers[i].value, v + 8, 3));
  }
  CHECK(lw_light_field_irradiance(field, v, 0, receivers[0].normal, 0, 1, (int64_t)v[6], packed, 0, NULL, 0) == LW_OK);
  CHECK(all_near(packed, v + 8, 3));
  ++irradiances;
}

static void line_is_that_of_cpp(const char* word, char* rest) {
  double v[NUMBERS];
  if (strcmp(word, "sample") == 0) {
    set(rest);
  } else if (strcmp(word, "probe") == 0) {
    check_probe(rest);
  } else {
    const int n = numbers(rest, v);
    if (strcmp(word, "field") == 0) {
      lw_light_field_release(field);
      field = NULL;
      CHECK(lw_light_field_create(NULL, &field) == LW_OK);
    } else if (strcmp(word, "triangle") == 0 && n == 9) {
      set_geometry(v);
    } else if (strcmp(word, "update") == 0 && n == 4) {
      update(v);
    } else if (strcmp(word, "light") == 0 && n == 29) {
      check_light(v);
    } else if (strcmp(word, "at") == 0 && n == 12) {
      check_point(v);
    } else if (strcmp(word, "irradiance") == 0 && n == 11) {
      check_irradiance(v);
    } else {
      CHECK(strcmp(word, "a line of a known kind") == 0);
    }
  }
}

static void answers_are_those_of_cpp(const char* path) {
  static char line[1 << 17];
  FILE* file = fopen(path, "r");
  CHECK(file != NULL);
  while (file != NULL && fgets(line, sizeof line, file) != NULL) {
    char* rest = line + strcspn(line, " \n");
    *rest++ = '\0';
    rest[strcspn(rest, "\n")] = '\0';
    line_is_that_of_cpp(line, rest);
  }
  if (file != NULL) fclose(file);
  CHECK(updates >= 6 && points > 30 && irradiances > 90 && lights > 5);
}

static void says(lw_status status, lw_status expected, const char* text) {
  CHECK(status == expected);
  if (strstr(lw_last_error(NULL), text) == NULL) fprintf(stderr, "the error is: %s\n", lw_last_error(NULL));
  CHECK(strstr(lw_last_error(NULL), text) != NULL);
}

/* `light` is that of a query, which has light. */
static void errors_are_named(void) {
  lw_light_field_options options = {.size = sizeof options, .typical_distance = -1};
  lw_light_field_sample sample = {.size = sizeof sample};
  lw_light_field_state state = {.size = 4};
  lw_light_field_answer a = {.size = sizeof a, .validity = LW_VALID};
  lw_lighting* dark = NULL;
  lw_light_field* other = NULL;
  size_t count = 7, i;
  const float vertices[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const double place[3] = {0, 1, 0};
  const uint32_t outside[3] = {0, 1, 3};
  float value[3] = {7, 7, 7};
  const float up[3] = {0, 1, 0};
  CHECK(lw_lighting_create(&dark) == LW_OK);
  says(lw_light_field_create(&options, &other), LW_INVALID_ARGUMENT, "typical_distance");
  options.typical_distance = 0;
  options.max_age_ns = -1;
  says(lw_light_field_create(&options, &other), LW_INVALID_ARGUMENT, "max_age");
  says(lw_light_field_create(NULL, NULL), LW_INVALID_ARGUMENT, "out");
  CHECK(other == NULL);
  says(lw_light_field_set(field, "a", 1, dark, &sample), LW_FAILED_PRECONDITION, "has no light");
  says(lw_light_field_set(field, "a", 1, NULL, &sample), LW_INVALID_ARGUMENT, "lw_lighting");
  says(lw_light_field_set(field, NULL, 1, light, &sample), LW_INVALID_ARGUMENT, "name");
  says(lw_light_field_set(field, "", 0, light, &sample), LW_INVALID_ARGUMENT, "name");
  says(lw_light_field_set(field, "a", 1, light, NULL), LW_INVALID_ARGUMENT, "lw_light_field_sample");
  sample.position_sigma = -1;
  says(lw_light_field_set(field, "a", 1, light, &sample), LW_INVALID_ARGUMENT, "sigma");
  sample.position_sigma = NAN;
  says(lw_light_field_set(field, "a", 1, light, &sample), LW_INVALID_ARGUMENT, "pose of probe a");
  sample.position_sigma = 0;
  sample.position[1] = INFINITY;
  says(lw_light_field_set(field, "abc", 1, light, &sample), LW_INVALID_ARGUMENT, "pose of probe a is");
  says(lw_light_field_remove(field, "nobody", LW_ZERO_TERMINATED), LW_NOT_FOUND, "no probe");
  says(lw_light_field_set_geometry(field, vertices, 11, 3, outside, 3), LW_INVALID_ARGUMENT, "vertex_stride");
  says(lw_light_field_set_geometry(field, NULL, 0, 3, outside, 3), LW_INVALID_ARGUMENT, "vertices");
  says(lw_light_field_set_geometry(field, vertices, 0, 3, NULL, 3), LW_INVALID_ARGUMENT, "indices");
  says(lw_light_field_update(field, 0, &state), LW_INVALID_ARGUMENT, "lw_light_field_state");
  says(lw_light_field_lights(field, NULL, 0, 1, &count), LW_INVALID_ARGUMENT, "NULL");
  says(lw_light_field_probes(field, (lw_light_field_probe*)value, 3, 1, &count), LW_INVALID_ARGUMENT, "sizeof");
  CHECK(count == 7 && lw_light_field_probes(field, NULL, 0, 0, &count) == LW_OK && count > 3);
  says(lw_light_field_probe_text(field, count, LW_LIGHT_FIELD_NAME, NULL, 0, &i), LW_NOT_FOUND, "probes");
  says(lw_light_field_probe_text(field, 0, 5, NULL, 0, &i), LW_INVALID_ARGUMENT, "5");
  says(lw_light_field_at(field, NULL, 0, light, &a), LW_INVALID_ARGUMENT, "position");
  CHECK(a.validity == LW_INVALID_QUERY);
  says(lw_light_field_at(NULL, place, 0, NULL, NULL), LW_INVALID_ARGUMENT, "lw_light_field");
  says(lw_light_field_at((const lw_light_field*)light, place, 0, NULL, NULL), LW_INVALID_ARGUMENT, "lw_light_field");
  CHECK(lw_light_field_at(field, place, 0, NULL, NULL) == LW_OK);
  says(lw_light_field_irradiance(field, place, 23, up, 0, 1, 0, value, 0, NULL, 0), LW_INVALID_ARGUMENT, "24");
  says(lw_light_field_irradiance(field, place, 0, up, 3, 1, 0, value, 0, NULL, 0), LW_INVALID_ARGUMENT,
       "normal_stride");
  says(lw_light_field_irradiance(field, place, 0, up, 0, 1, 0, value, 3, NULL, 0), LW_INVALID_ARGUMENT, "value_stride");
  says(lw_light_field_irradiance(field, place, 0, NULL, 0, 1, 0, value, 0, NULL, 0), LW_INVALID_ARGUMENT, "normals");
  says(lw_light_field_irradiance(field, place, 0, up, 0, 1, 0, value, 0, &a, 4), LW_INVALID_ARGUMENT, "sizeof");
  CHECK(value[0] == 7 && lw_light_field_irradiance(field, NULL, 0, NULL, 0, 0, 0, NULL, 0, NULL, 0) == LW_OK);
  lw_light_field_release(NULL);
  lw_lighting_release(dark);
}

int main(int argc, char** argv) {
  const double middle[3] = {0, 1, 0};
  if (argc != 2) return 2;
  CHECK(lw_lighting_create(&light) == LW_OK);
  answers_are_those_of_cpp(argv[1]);
  CHECK(lw_light_field_at(field, middle, 2000000000, light, NULL) == LW_OK);
  CHECK(lw_light_field_remove(field, "other", LW_ZERO_TERMINATED) == LW_OK);
  errors_are_named();
  lw_light_field_release(field);
  /* The lighting of a query outlives the field. */
  {
    const float up[3] = {0, 1, 0};
    lw_answer e = {.size = sizeof e};
    CHECK(lw_lighting_irradiance(light, up, &e) == LW_OK && e.validity == LW_VALID && e.value[0] > 0);
  }
  lw_lighting_release(light);
  return checks_failed(900);
}
