/* Arguments and errors of probe_status.h; results of a real probe: tests/e2e/bindings_status_test.cpp. */
#include <stdlib.h>
#include <string.h>

#include <lightwell/probe_status.h>

#include "check.h"

static void a_recording_has_no_probe(const char* recording) {
  lw_probe* probe = NULL;
  char uri[1100];
  lw_recording r = {.size = sizeof r, .running = 1};
  lw_calibration c = {.size = sizeof c};
  lw_lens lens = {.size = sizeof lens};
  snprintf(uri, sizeof uri, "replay:%s?speed=0", recording);
  CHECK(lw_probe_connect(uri, LW_ZERO_TERMINATED, NULL, &probe) == LW_OK);
  CHECK(lw_probe_get_recording(probe, &r) == LW_OK && r.available == 0 && r.running == 0 && r.file[0] == 0);
  CHECK(lw_probe_start_recording(probe, &r) == LW_FAILED_PRECONDITION);
  CHECK(strstr(lw_last_error(NULL), "recording") != NULL);
  CHECK(lw_probe_stop_recording(probe, NULL) == LW_FAILED_PRECONDITION);
  c.id = 7;
  CHECK(lw_probe_get_calibration(probe, &c, &lens, sizeof lens, 1) == LW_FAILED_PRECONDITION && c.id == 7);

  /* Arguments are checked before the probe is asked. */
  r.size = 0;
  CHECK(lw_probe_start_recording(probe, &r) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "lw_recording.size") != NULL);
  CHECK(lw_probe_get_recording(probe, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_get_calibration(probe, NULL, &lens, sizeof lens, 1) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_get_calibration(probe, &c, NULL, sizeof lens, 1) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_get_calibration(probe, &c, &lens, 3, 1) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "lens_size") != NULL);
  CHECK(lw_probe_get_calibration(NULL, &c, &lens, sizeof lens, 1) == LW_INVALID_ARGUMENT);
  CHECK(lw_probe_start_recording(NULL, NULL) == LW_INVALID_ARGUMENT);
  lw_probe_close(probe);
}

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  a_recording_has_no_probe(argv[1]);
  return checks_failed(15);
}
