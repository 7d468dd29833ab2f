/* Many threads ask one probe and one lighting while the reader thread writes: what they see is whole and never older
 * than what they saw. Run under the thread sanitizer, too. */
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <lightwell/lightwell.h>

#include "check.h"

enum { kReaders = 4 };

typedef struct {
  int number;
  lw_probe* probe;
  const lw_lighting* shared;
  float expected[3]; /* of `shared` at +X */
  int wrong;
  int backwards;
  int answers;
  int changes;
} reader;

static const uint64_t kLast = 3000;

/* Descriptor n of the recording has constant radiance n and a light of irradiance n from above, which detects torn
 * data. */
static void* read_on(void* argument) {
  reader* r = argument;
  lw_lighting *mine = NULL, *copy = NULL;
  uint64_t last = 0;
  lw_lighting_info info = {.size = sizeof info};
  lw_link_stats stats = {.size = sizeof stats};
  lw_answer answer = {.size = sizeof answer};
  const float east[3] = {1, 0, 0}, up[3] = {0, 1, 0};
  if (lw_lighting_create(&mine) != LW_OK || lw_lighting_create(&copy) != LW_OK) ++r->wrong;
  do {
    float c[3];
    lw_light light = {.size = sizeof light};
    size_t count = 0;
    if (lw_probe_latest(r->probe, mine) != LW_OK || lw_lighting_get_info(mine, &info) != LW_OK) ++r->wrong;
    if (lw_probe_get_stats(r->probe, &stats) != LW_OK) ++r->wrong;
    if (info.validity == LW_NONE) continue;
    if (info.sequence < last) ++r->backwards;
    if (info.sequence != last) ++r->changes;
    last = info.sequence;
    if (lw_lighting_copy(mine, copy) != LW_OK) ++r->wrong;
    if (lw_lighting_lights(copy, &light, sizeof light, 1, &count) != LW_OK || count != 1) ++r->wrong;
    if (lw_lighting_harmonics(copy, LW_RADIANCE, 0, c, NULL) != LW_OK) ++r->wrong;
    /* 3.5449 is sqrt(4 pi); both were rounded in the wire format. */
    if (light.irradiance[0] < 0.999F * (float)last || light.irradiance[0] > 1.001F * (float)last) ++r->wrong;
    if (c[0] < 0.999F * 3.5449077F * (float)last || c[0] > 1.001F * 3.5449077F * (float)last) ++r->wrong;
    if (lw_lighting_radiance(copy, up, 0.4F, &answer) != LW_OK || !(answer.value[0] > 0)) ++r->wrong;
    if (lw_lighting_irradiance(r->shared, east, &answer) != LW_OK) ++r->wrong;
    if (memcmp(answer.value, r->expected, sizeof answer.value) != 0) ++r->wrong;
    /* The last error is per thread: other threads cause other errors concurrently. */
    if (r->number % 2 == 0) {
      if (lw_lighting_irradiance(NULL, east, &answer) != LW_INVALID_ARGUMENT) ++r->wrong;
      if (strstr(lw_last_error(NULL), "not an lw_lighting") == NULL) ++r->wrong;
    } else {
      if (lw_probe_get_stats(NULL, &stats) != LW_INVALID_ARGUMENT) ++r->wrong;
      if (strstr(lw_last_error(NULL), "not an lw_probe") == NULL) ++r->wrong;
    }
    if (lw_probe_at(r->probe, info.mid_exposure_ns, mine) != LW_OK) ++r->wrong;
    ++r->answers;
  } while (last != kLast && stats.state != LW_LINK_ENDED);
  lw_lighting_release(mine);
  lw_lighting_release(copy);
  return NULL;
}

int main(int argc, char** argv) {
  pthread_t threads[kReaders];
  reader readers[kReaders];
  lw_probe* probe = NULL;
  lw_lighting* shared = NULL;
  const float east[3] = {1, 0, 0};
  char uri[1100];
  int i;
  if (argc != 2) return 2;
  snprintf(uri, sizeof uri, "replay:%s", argv[1]);
  CHECK(lw_probe_connect(uri, LW_ZERO_TERMINATED, NULL, &probe) == LW_OK);
  CHECK(lw_lighting_create(&shared) == LW_OK);
  CHECK(lw_probe_wait_for_next(probe, NULL, 60000000000, shared) == LW_OK);
  for (i = 0; i < kReaders; ++i) {
    lw_answer a = {.size = sizeof a};
    memset(&readers[i], 0, sizeof readers[i]);
    readers[i].number = i;
    readers[i].probe = probe;
    readers[i].shared = shared;
    CHECK(lw_lighting_irradiance(shared, east, &a) == LW_OK);
    memcpy(readers[i].expected, a.value, sizeof a.value);
    CHECK(pthread_create(&threads[i], NULL, read_on, &readers[i]) == 0);
  }
  for (i = 0; i < kReaders; ++i) {
    CHECK(pthread_join(threads[i], NULL) == 0);
    CHECK(readers[i].wrong == 0);
    CHECK(readers[i].backwards == 0);
    CHECK(readers[i].answers > 0);
    printf("reader %d: %d answers, %d descriptors\n", i, readers[i].answers, readers[i].changes);
  }
  lw_probe_close(probe);
  lw_lighting_release(shared);
  return checks_failed(20);
}
