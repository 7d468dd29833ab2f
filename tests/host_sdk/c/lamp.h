/* Test data of the C programs: a lighting with one light at +X (golden vector v1_lamp_at_plus_x), one of a marker with
 * a near lamp (v1_near_lamp), and a recording. */
#ifndef LIGHTWELL_TESTS_LAMP_H
#define LIGHTWELL_TESTS_LAMP_H

#include <stdio.h>

#include <lightwell/lightwell.h>

#include "check.h"

enum { LAMP_CAPACITY = 4096 };

/* The bytes of a golden vector, and their number. */
static size_t vector_bytes(const char* vectors, const char* name, unsigned char bytes[LAMP_CAPACITY]) {
  char path[1024];
  size_t n;
  FILE* file;
  snprintf(path, sizeof path, "%s/%s.bin", vectors, name);
  file = fopen(path, "rb");
  CHECK(file != NULL);
  n = file == NULL ? 0 : fread(bytes, 1, LAMP_CAPACITY, file);
  if (file != NULL) fclose(file);
  return n;
}

static lw_lighting* lighting_of(const char* vectors, const char* name) {
  unsigned char bytes[LAMP_CAPACITY];
  const size_t n = vector_bytes(vectors, name, bytes);
  lw_lighting* out = NULL;
  CHECK(lw_lighting_create(&out) == LW_OK);
  CHECK(lw_lighting_decode(bytes, n, 0, out) == LW_OK);
  return out;
}

static lw_lighting* lamp(const char* vectors) { return lighting_of(vectors, "v1_lamp_at_plus_x"); }

/* A recording, played to its end. */
static lw_probe* played(const char* recording, lw_lighting* last) {
  char uri[1100];
  uint64_t seen = 0;
  lw_probe* probe = NULL;
  lw_lighting_info info = {.size = sizeof info};
  snprintf(uri, sizeof uri, "replay:%s?speed=0", recording);
  CHECK(lw_probe_connect(uri, LW_ZERO_TERMINATED, NULL, &probe) == LW_OK);
  while (lw_probe_wait_for_next(probe, &seen, 60000000000, last) == LW_OK) {
    CHECK(lw_lighting_get_info(last, &info) == LW_OK);
    seen = info.sequence;
  }
  return probe;
}

#endif
