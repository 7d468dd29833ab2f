/* Damaged messages: the C ABI accepts and refuses the same ones as C++ on the machine that wrote the answers, which may
 * be one of another system, and gives the same values of those that it accepts. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lightwell/lightwell.h>
#include <lightwell/plane_appearance.h>

#include "check.h"

/* Messages and answers of more systems than one: sine and cosine of a mathematical library may differ in the last bit.
 * Measured between glibc, musl and Windows: see the printed number. */
static const double kMaxDifference = 1e-6;
static double largest_difference = 0;

static lw_status status_named(const char* name, size_t length) {
  static const char* const kNames[] = {"ok", "invalid_argument", "not_found", "data_loss", "failed_precondition"};
  int i;
  for (i = 0; i < 5; ++i)
    if (strlen(kNames[i]) == length && strncmp(kNames[i], name, length) == 0) return i;
  return -1;
}

/* The bytes of hexadecimal digits; the caller frees them. */
static unsigned char* bytes_of(const char* hex, size_t* length) {
  unsigned char* const bytes = malloc(strlen(hex) / 2 + 1);
  size_t i;
  *length = strlen(hex) / 2;
  for (i = 0; i < *length; ++i) {
    const char digits[3] = {hex[2 * i], hex[2 * i + 1], 0};
    bytes[i] = (unsigned char)strtoul(digits, NULL, 16);
  }
  return bytes;
}

static int near_to(double got, double expected, double scale) {
  const double difference = got == expected ? 0 : fabs(got - expected) / scale;
  if (!(difference <= largest_difference)) largest_difference = difference;
  return difference <= kMaxDifference;
}

static void check_light(const lw_lighting* light, const char* word, const char* rest) {
  double v[LW_MAX_LIGHTS];
  int n = 0, k;
  char* end = NULL;
  lw_lighting_info info = {.size = sizeof info};
  for (; n < LW_MAX_LIGHTS; ++n, rest = end) {
    v[n] = strtod(rest, &end);
    if (end == rest) break;
  }
  CHECK(lw_lighting_get_info(light, &info) == LW_OK);
  if (strcmp(word, "flags") == 0) {
    CHECK(n == 1 && info.flags == (uint32_t)v[0]);
  } else if (strcmp(word, "origin") == 0) {
    CHECK(n == 7);
    for (k = 0; k < 3; ++k) CHECK(near_to(info.origin_position[k], v[k], 1 + fabs(v[k])));
    for (k = 0; k < 4; ++k) CHECK(near_to(info.origin_orientation[k], v[3 + k], 1));
  } else if (strcmp(word, "distances") == 0) {
    lw_light lights[LW_MAX_LIGHTS];
    size_t count = 0;
    CHECK(lw_lighting_lights(light, lights, sizeof *lights, LW_MAX_LIGHTS, &count) == LW_OK && count == (size_t)n);
    for (k = 0; k < n; ++k) CHECK(lights[k].distance == (float)v[k]);
  } else if (strcmp(word, "irradiance") == 0) {
    const float normal[3] = {(float)v[0], (float)v[1], (float)v[2]};
    lw_answer answer = {.size = sizeof answer};
    double scale = 1e-30;
    CHECK(n == 6 && lw_lighting_irradiance(light, normal, &answer) == LW_OK);
    for (k = 0; k < 3; ++k) scale = fmax(scale, fabs(v[3 + k]));
    for (k = 0; k < 3; ++k) CHECK(near_to(answer.value[k], v[3 + k], scale));
  } else {
    CHECK(strcmp(word, "a line of a known kind") == 0);
  }
}

static lw_status take_plane(const unsigned char* bytes, size_t length) {
  lw_plane_reader* reader = NULL;
  lw_status status;
  CHECK(lw_plane_reader_create(&reader) == LW_OK);
  status = lw_plane_reader_take(reader, bytes, length, 0);
  lw_plane_reader_release(reader);
  return status;
}

/* Returns the number of messages in the file. */
static int check_file(const char* folder, const char* name, int is_plane) {
  static char line[1 << 19];
  char path[1000];
  int messages = 0, refused = 0;
  FILE* file;
  lw_lighting* light = NULL;
  snprintf(path, sizeof path, "%s/%s", folder, name);
  file = fopen(path, "r");
  CHECK(file != NULL && lw_lighting_create(&light) == LW_OK);
  while (file != NULL && fgets(line, sizeof line, file) != NULL) {
    char* rest = strpbrk(line, " \n");
    CHECK(rest != NULL);
    if (rest == NULL) break;
    *rest++ = '\0';
    rest[strcspn(rest, "\n")] = '\0';
    if (strcmp(line, "mutant") == 0) {
      const size_t word = strcspn(rest, " ");
      const lw_status expected = status_named(rest, word);
      size_t length = 0;
      unsigned char* const bytes = bytes_of(rest + word + (rest[word] == ' '), &length);
      const lw_status status = is_plane ? take_plane(bytes, length) : lw_lighting_decode(bytes, length, 0, light);
      CHECK(expected >= 0 && status == expected);
      ++messages;
      refused += status != LW_OK;
      free(bytes);
    } else if (!is_plane) {
      check_light(light, line, rest);
    }
  }
  if (file != NULL) fclose(file);
  lw_lighting_release(light);
  CHECK(refused > 1000 && messages - refused > 1000);
  return messages;
}

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  printf("damaged descriptors: %d\n", check_file(argv[1], "mutants.txt", 0));
  printf("damaged messages of planes: %d\n", check_file(argv[1], "plane_mutants.txt", 1));
  printf("largest relative difference: %.3g\n", largest_difference);
  return checks_failed(20000);
}
