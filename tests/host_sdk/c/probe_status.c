/* Prints the calibration of a probe, and what starting and stopping a recording gives:
 * tests/e2e/bindings_status_test.cpp. usage: probe_status URI */
#include <math.h>
#include <stdio.h>

#include <lightwell/probe_status.h>

static long long micro(double v) { return llround(v * 1e6); }

static void write_recording(const char* what, lw_status status, const lw_recording* r) {
  if (status != LW_OK)
    printf("%s %s: %s\n", what, lw_status_name(status), lw_last_error(NULL));
  else if (r->available == 0)
    printf("%s none\n", what);
  else
    printf("%s %d %d %d %llu %llu [%s]\n", what, r->running, r->file[0] != 0, r->bytes > 0, (unsigned long long)r->lost,
           (unsigned long long)r->faults, r->end_reason);
}

static void write_calibration(const lw_probe* probe) {
  lw_calibration c = {.size = sizeof c};
  lw_lens lenses[4];
  uint32_t k;
  const lw_status status = lw_probe_get_calibration(probe, &c, lenses, sizeof lenses[0], 4);
  if (status != LW_OK) {
    printf("calibration %s: %s\n", lw_status_name(status), lw_last_error(NULL));
    return;
  }
  printf("calibration %u %d [%s]\n", c.id, c.absolute, c.file);
  for (k = 0; k < c.lens_count && k < 4; ++k) {
    const lw_lens* l = &lenses[k];
    printf("lens %u %u %s %lld %s %d %d", l->width, l->height, l->model, micro(l->max_angle_deg), l->response,
           l->vignetting, l->noise);
    if (c.has_report)
      printf(" %lld %lld\n", micro(l->seen_deg), micro(l->direction_3_sigma_deg));
    else
      printf(" none\n");
  }
  if (c.has_report)
    printf("report %lld %lld %u %lld\n", (long long)c.geometry_time_s, micro(c.rms_px), c.points,
           (long long)c.photometry_time_s);
  else
    printf("report none\n");
}

int main(int argc, char** argv) {
  lw_probe* probe = NULL;
  lw_recording r = {.size = sizeof r};
  if (argc != 2) return 2;
  if (lw_probe_connect(argv[1], LW_ZERO_TERMINATED, NULL, &probe) != LW_OK) {
    fprintf(stderr, "%s\n", lw_last_error(NULL));
    return 1;
  }
  write_calibration(probe);
  write_recording("before", lw_probe_get_recording(probe, &r), &r);
  write_recording("start", lw_probe_start_recording(probe, &r), &r);
  write_recording("again", lw_probe_start_recording(probe, &r), &r);
  write_recording("stop", lw_probe_stop_recording(probe, &r), &r);
  write_recording("stop2", lw_probe_stop_recording(probe, &r), &r);
  lw_probe_close(probe);
  return 0;
}
