/* Cube maps through the C ABI: values, defaults, errors. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lightwell/cube_map.h>

#include "check.h"
#include "lamp.h"

enum { EDGE = 9, FLOATS = 6 * EDGE * EDGE * 4 };

static void the_lamp_is_on_its_face(const lw_lighting* light) {
  static float texels[FLOATS + 1], without[FLOATS];
  lw_cube_map_options options = {.size = sizeof options, .edge = EDGE, .format = LW_CUBE_RGBA32F};
  lw_cube_map_summary s = {.size = sizeof s};
  const size_t middle = 4 * (EDGE * 4 + 4);
  size_t i, brightest = 0;
  texels[FLOATS] = 7;
  CHECK(lw_lighting_cube_map(light, &options, texels, FLOATS * sizeof *texels, &s) == LW_OK);
  CHECK(texels[FLOATS] == 7 && texels[3] == 1);
  CHECK(s.size == sizeof s && s.validity == LW_VALID && strcmp(s.reason, "") == 0 && s.clamped == 0);
  for (i = 0; i < FLOATS; i += 4)
    if (texels[i] > texels[brightest]) brightest = i;
  CHECK(brightest == middle); /* Of the face +X. */
  options.lights = LW_CUBE_WITHOUT_LIGHTS;
  CHECK(lw_lighting_cube_map(light, &options, without, sizeof without, NULL) == LW_OK);
  CHECK(without[middle] < texels[middle] / 2);
  options.lights = LW_CUBE_WITH_LIGHTS;
  options.scale = 4;
  CHECK(lw_lighting_cube_map(light, &options, without, sizeof without, NULL) == LW_OK);
  CHECK(fabsf(without[middle] - 4 * texels[middle]) <= 1e-5F * without[middle]);
}

static void defaults_are_64_half_floats(const lw_lighting* light) {
  static uint16_t texels[6 * 64 * 64 * 4 + 1];
  lw_cube_map_options options = {.size = sizeof options};
  texels[6 * 64 * 64 * 4] = 7;
  CHECK(lw_lighting_cube_map(light, NULL, texels, sizeof texels, NULL) == LW_OK);
  CHECK(texels[3] == 0x3C00 && texels[6 * 64 * 64 * 4 - 1] == 0x3C00 && texels[6 * 64 * 64 * 4] == 7);
  options.format = LW_CUBE_RGB9E5;
  memset(texels, 0xFF, sizeof texels);
  CHECK(lw_lighting_cube_map(light, &options, texels, 6 * 64 * 64 * 4, NULL) == LW_OK);
  CHECK(texels[0] != 0xFFFF && texels[2 * 6 * 64 * 64] == 0xFFFF);
}

static void arguments_are_checked(const lw_lighting* light) {
  static float texels[FLOATS];
  const lw_cube_map_options good = {.size = sizeof good, .edge = EDGE, .format = LW_CUBE_RGBA32F};
  lw_cube_map_options options;
  lw_cube_map_summary s = {.size = sizeof s, .clamped = 9};
  const int32_t edges[] = {-1, 65, 2147483647};
  const float scales[] = {-1, NAN, INFINITY};
  size_t i;
#define REFUSED(field, wrong)                                                                     \
  options = good;                                                                                 \
  options.field = wrong;                                                                          \
  CHECK(lw_lighting_cube_map(light, &options, texels, sizeof texels, &s) == LW_INVALID_ARGUMENT); \
  CHECK(s.validity == LW_INVALID_QUERY && s.clamped == 0 && strstr(lw_last_error(NULL), #field) != NULL)
  for (i = 0; i < 3; ++i) {
    REFUSED(edge, edges[i]);
    REFUSED(scale, scales[i]);
  }
  REFUSED(format, 3);
  REFUSED(format, -1);
  REFUSED(lights, 2);
  REFUSED(size, 3);
  CHECK(lw_lighting_cube_map(light, &good, texels, sizeof texels - 1, NULL) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "7776 bytes") != NULL);
  CHECK(lw_lighting_cube_map(light, &good, NULL, sizeof texels, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_cube_map(NULL, &good, texels, sizeof texels, NULL) == LW_INVALID_ARGUMENT);
  for (i = 0; i < FLOATS; ++i) CHECK(texels[i] == 0);
}

static void without_light(void) {
  static float texels[FLOATS];
  const lw_cube_map_options options = {.size = sizeof options, .edge = EDGE, .format = LW_CUBE_RGBA32F};
  lw_cube_map_summary s = {.size = sizeof s};
  lw_lighting* empty = NULL;
  CHECK(lw_lighting_create(&empty) == LW_OK);
  CHECK(lw_lighting_cube_map(empty, &options, texels, sizeof texels, &s) == LW_OK);
  CHECK(s.validity == LW_NONE && strlen(s.reason) > 0 && texels[0] == 0 && texels[3] == 1);
  lw_lighting_release(empty);
}

static void of_a_recording(const char* recording) {
  static float texels[FLOATS];
  const lw_cube_map_options options = {.size = sizeof options, .edge = EDGE, .format = LW_CUBE_RGBA32F};
  lw_cube_map_summary s = {.size = sizeof s};
  lw_answer above = {.size = sizeof above};
  const float up[3] = {0, 1, 0};
  lw_lighting* light = NULL;
  lw_probe* probe;
  size_t i;
  CHECK(lw_lighting_create(&light) == LW_OK);
  probe = played(recording, light);
  CHECK(lw_lighting_cube_map(light, &options, texels, sizeof texels, &s) == LW_OK);
  CHECK(lw_lighting_radiance(light, up, 0, &above) == LW_OK);
  CHECK(s.validity == above.validity && s.error_bound == above.error_bound && s.flags == above.flags);
  for (i = 0; i < FLOATS; ++i) CHECK(texels[i] >= 0 && isfinite(texels[i]));
  lw_lighting_release(light);
  lw_probe_close(probe);
}

/* The map of a line of cube_answers.hpp after the word `cube`. */
static void check_line(const lw_lighting* light, char* line) {
  static float texels[FLOATS];
  lw_cube_map_options options = {.size = sizeof options, .format = LW_CUBE_RGBA32F};
  lw_cube_map_summary s = {.size = sizeof s};
  char* end = line;
  uint64_t clamped;
  int32_t i;
  options.edge = (int32_t)strtol(end, &end, 10);
  options.lights = strtol(end, &end, 10) == 1 ? LW_CUBE_WITH_LIGHTS : LW_CUBE_WITHOUT_LIGHTS;
  options.scale = strtof(end, &end);
  clamped = strtoull(end, &end, 10);
  CHECK(options.edge > 0 && options.edge <= EDGE);
  CHECK(lw_lighting_cube_map(light, &options, texels, sizeof texels, &s) == LW_OK && s.clamped == clamped);
  for (i = 0; i < 24 * options.edge * options.edge; ++i)
    CHECK(i % 4 == 3 ? texels[i] == 1 : texels[i] == strtof(end, &end));
}

static void those_of_cpp(const char* path) {
  static char line[1 << 20];
  static unsigned char bytes[1 << 19];
  FILE* file = fopen(path, "r");
  lw_lighting* light = NULL;
  int maps = 0;
  CHECK(file != NULL && lw_lighting_create(&light) == LW_OK);
  if (file == NULL) return;
  while (fgets(line, sizeof line, file) != NULL) {
    if (strncmp(line, "message ", 8) == 0) {
      size_t n = 0;
      unsigned value;
      for (; sscanf(line + 8 + 2 * n, "%2x", &value) == 1; ++n) bytes[n] = (unsigned char)value;
      CHECK(lw_lighting_decode(bytes, n, 0, light) == LW_OK);
    } else if (strncmp(line, "cube ", 5) == 0) {
      check_line(light, line + 5);
      ++maps;
    }
  }
  CHECK(maps > 20);
  lw_lighting_release(light);
  fclose(file);
}

int main(int argc, char** argv) {
  lw_lighting* light;
  if (argc != 4) return 2;
  those_of_cpp(argv[3]);
  light = lamp(argv[1]);
  the_lamp_is_on_its_face(light);
  defaults_are_64_half_floats(light);
  arguments_are_checked(light);
  without_light();
  of_a_recording(argv[2]);
  lw_lighting_release(light);
  return checks_failed(30);
}
