/* A failed allocation at any point of a call gives an error status, without leaks or changes. */
#include <stddef.h>
#include <string.h>

#include <lightwell/conventions.h>
#include <lightwell/lightwell.h>
#include <lightwell/shadows.h>

#include "check.h"

/* glibc's own, under the name that it keeps for replacements. operator new of every library comes to malloc. */
void* __libc_malloc(size_t size);
void* malloc(size_t size);

/* Number of this thread's allocations that succeed before all others fail. Negative: all succeed. */
static __thread long allowed = -1;

void* malloc(size_t size) {
  if (allowed == 0) return NULL;
  if (allowed > 0) --allowed;
  return __libc_malloc(size);
}

static lw_lighting* light;
static lw_lighting* other;
static lw_probe* probe;
static lw_lighting_info newest;
static unsigned char message[4096];
static size_t length;
static const char* recording;

static lw_status create(void) {
  lw_lighting* made = NULL;
  const lw_status status = lw_lighting_create(&made);
  CHECK((status == LW_OK) == (made != NULL));
  lw_lighting_release(made);
  return status;
}
static lw_status decode(void) { return lw_lighting_decode(message, length, 0, other); }
static lw_status rotate(void) {
  const double q[4] = {0, 0.6, 0, 0.8};
  return lw_lighting_rotated(light, q, other);
}
static lw_status convert(void) {
  lw_three three = {.size = sizeof three};
  return lw_lighting_to_three(light, LW_THREE_PHYSICAL, LW_MAIN_LIGHT_APART, NULL, &three);
}
static lw_status past(void) { return lw_probe_at(probe, newest.mid_exposure_ns + 1, other); }
static lw_status texts(void) {
  char name[64];
  return lw_probe_text(probe, LW_PROBE_CAMERA, name, sizeof name, NULL);
}
/* With a caster that failed before at any point. */
static lw_shadow_caster* caster;
static float shade[3 * 8 * 8];
static lw_status shadow(void) {
  static const float corners[4][3] = {{-1, -1, 0.1F}, {1, -1, 0.1F}, {1, 1, 0.1F}, {-1, 1, -0.1F}};
  static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
  lw_shadow_mesh mesh = {.size = sizeof mesh, .positions = corners, .position_count = 4};
  lw_shadow_receiver plane = {.size = sizeof plane, .columns = 8, .rows = 8, .width = 0.1, .height = 0.1};
  lw_status status = LW_OK;
  mesh.indices = indices;
  mesh.index_count = 6;
  if (caster == NULL) status = lw_shadow_caster_create(NULL, &caster);
  if (status == LW_OK) status = lw_shadow_caster_cast(caster, light, &plane, &mesh, shade, 3 * 8 * 8, NULL);
  CHECK((status == LW_OK) == (shade[0] < 0.5F));
  return status;
}
/* Not of the connection's good end, which starts a thread: glibc takes that for granted. */
static lw_status connect_nowhere(void) {
  lw_probe* made = NULL;
  lw_status status =
      lw_probe_connect("replay:/a/path/that/is/too/long/for/a/short/string", LW_ZERO_TERMINATED, NULL, &made);
  CHECK(made == NULL);
  if (status == LW_NOT_FOUND) status = LW_OK;
  return status;
}

/* Repeats a call with one more successful allocation each time, until it succeeds. */
static void runs_out(const char* what, lw_status (*call)(void)) {
  long n;
  lw_status status = LW_RESOURCE_EXHAUSTED;
  for (n = 0; n < 10000 && status != LW_OK; ++n) {
    allowed = n;
    status = call();
    allowed = -1;
    CHECK(status == LW_OK || status == LW_RESOURCE_EXHAUSTED);
    if (status != LW_OK) CHECK(strstr(lw_last_error(NULL), "memory") != NULL);
    if (status != LW_OK && status != LW_RESOURCE_EXHAUSTED) break;
  }
  printf("%s: %ld allocations\n", what, n - 1);
  CHECK(status == LW_OK);
  CHECK(n > 1);
}

int main(int argc, char** argv) {
  char uri[1100];
  lw_lighting_info info = {.size = sizeof info};
  FILE* file;
  if (argc != 3) return 2;
  recording = argv[2];
  file = fopen(argv[1], "rb");
  CHECK(file != NULL);
  if (file == NULL) return 1;
  length = fread(message, 1, sizeof message, file);
  fclose(file);
  snprintf(uri, sizeof uri, "replay:%s?speed=0", recording);
  newest.size = sizeof newest;
  CHECK(lw_lighting_create(&light) == LW_OK && lw_lighting_create(&other) == LW_OK);
  CHECK(lw_probe_connect(uri, LW_ZERO_TERMINATED, NULL, &probe) == LW_OK);
  while (lw_probe_wait_for_next(probe, newest.sequence == 0 ? NULL : &newest.sequence, 60000000000, light) == LW_OK)
    CHECK(lw_lighting_get_info(light, &newest) == LW_OK);
  CHECK(newest.sequence == 113);
  runs_out("lw_lighting_create", create);
  runs_out("lw_lighting_decode", decode);
  runs_out("lw_lighting_rotated", rotate);
  runs_out("lw_lighting_to_three", convert);
  runs_out("lw_probe_text", texts);
  shade[0] = 1;
  runs_out("lw_shadow_caster_cast", shadow);
  lw_shadow_caster_release(caster);
  runs_out("lw_probe_connect", connect_nowhere);
  /* The previous content is kept after a failed call. */
  CHECK(decode() == LW_OK);
  allowed = 0;
  CHECK(rotate() == LW_RESOURCE_EXHAUSTED && past() != LW_INTERNAL);
  allowed = -1;
  CHECK(lw_lighting_get_info(light, &info) == LW_OK && info.sequence == 113);
  lw_lighting_release(light);
  lw_lighting_release(other);
  lw_probe_close(probe);
  return checks_failed(20);
}
