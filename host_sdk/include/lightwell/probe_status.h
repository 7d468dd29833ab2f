/* The recording and the calibration of a probe, for C: Probe::start_recording(), stop_recording(), info().recording and
 * calibration() of probe.hpp through the C ABI, with the rules of lightwell.h. Meanings are documented at the types of
 * the same names in status.hpp and calibration_summary.hpp. Texts are UTF-8, end with a zero byte, and are truncated
 * between two characters where they are longer. All: since LW_ABI_VERSION 0x00010006.
 */
#ifndef LIGHTWELL_PROBE_STATUS_H
#define LIGHTWELL_PROBE_STATUS_H

#include <lightwell/lightwell.h>

#ifdef __cplusplus
extern "C" {
#endif

/* As RecordingStatus: the recording that runs on the probe, otherwise its last one. */
typedef struct lw_recording {
  uint32_t size;
  int32_t available; /* 0: the probe has no folder for recordings, or its firmware is too old. All else is zero then. */
  int32_t running;   /* 1: it runs. */
  int32_t reserved;
  uint64_t bytes;
  uint64_t descriptors;
  uint64_t lost;         /* Messages that are missing in the file, because the disk was too slow. */
  uint64_t faults;       /* Recordings that a fault or a limit ended, since the start of the daemon. */
  char file[256];        /* Name in the probe's folder; empty before the first recording. */
  char end_reason[1024]; /* Why it ended although no client stopped it; otherwise empty. */
} lw_recording;

/* As ProbeInfo::recording: at most about a second old. Blocks briefly. */
LW_API lw_status lw_probe_get_recording(const lw_probe* probe, lw_recording* out);

/* As Probe::start_recording() and stop_recording(): the state after it in *out (may be NULL). Block until the probe
 * responds, at most connect_timeout_ns. LW_FAILED_PRECONDITION for a recording and over MQTT, if the probe has no
 * folder or cannot write there, if a recording runs already, or none does. LW_RESOURCE_EXHAUSTED at the probe's limits.
 */
LW_API lw_status lw_probe_start_recording(lw_probe* probe, lw_recording* out);
LW_API lw_status lw_probe_stop_recording(lw_probe* probe, lw_recording* out);

/* As CalibrationSummary and CalibrationReport. */
typedef struct lw_calibration {
  uint32_t size;
  uint32_t id;             /* lw_lighting_info.calibration_id. */
  int32_t absolute;        /* 1: cd/m² of a pixel value are known. */
  int32_t has_report;      /* 0: the file has no report, and the members of lw_lens and these are zero: */
  int64_t geometry_time_s; /* Seconds since 1970 (UTC), 0: not known. */
  int64_t photometry_time_s;
  double rms_px; /* RMS of the residuals of both coordinates. */
  uint32_t points;
  uint32_t lens_count;
  char file[256]; /* Name without its folder; empty: the camera's own calibration. */
} lw_calibration;

/* As LensSummary, with the lens's part of the report. */
typedef struct lw_lens {
  uint32_t size;
  uint32_t width;
  uint32_t height;
  int32_t vignetting; /* 1: it is corrected. */
  int32_t noise;      /* 1: read or shot noise is known. */
  int32_t reserved;
  double max_angle_deg;
  double seen_deg;              /* Of the report: 0 without one. */
  double direction_3_sigma_deg; /* Of the report: 0 without one. */
  char model[32];               /* "kannala_brandt". */
  char response[32];            /* "linear", "srgb", "table" or "gamma". */
} lw_lens;

/* As Probe::calibration(). Lenses into lenses[0 .. capacity), which are lens_size (sizeof(lw_lens)) bytes apart; the
 * library sets their `size`. lenses: NULL with capacity 0 for none. out->lens_count is the number of all lenses, even
 * if capacity is less. Blocks as lw_probe_start_recording. LW_FAILED_PRECONDITION for a recording, over MQTT, and if
 * the probe's firmware is too old. */
LW_API lw_status lw_probe_get_calibration(const lw_probe* probe, lw_calibration* out, lw_lens* lenses, size_t lens_size,
                                          size_t capacity);

#ifdef __cplusplus
}
#endif
#endif
