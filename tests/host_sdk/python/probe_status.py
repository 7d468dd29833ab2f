"""Prints the calibration of a probe, and what starting and stopping a recording gives:
tests/e2e/bindings_status_test.cpp.

usage: probe_status.py URI
"""

import sys

import lightwell


def micro(value):
    return round(value * 1e6)


def write(what, recording):
    if recording is None:
        print(what, "none")
        return
    r = recording
    print(what, int(r.running), int(r.file != ""), int(r.bytes > 0), r.lost, r.faults, f"[{r.end_reason}]")


def attempt(what, call):
    try:
        call()
    except lightwell.Error as error:
        print(f"{what} {error.status.name.lower()}: {error}")


def write_calibration(probe):
    c = probe.calibration()
    print("calibration", c.id, int(c.absolute), f"[{c.file}]")
    for lens in c.lenses:
        report = "none" if lens.seen_deg is None else f"{micro(lens.seen_deg)} {micro(lens.direction_3_sigma_deg)}"
        print("lens", lens.width, lens.height, lens.model, micro(lens.max_angle_deg), lens.response,
              int(lens.vignetting), int(lens.noise), report)
    r = c.report
    print("report none" if r is None else
          f"report {r.geometry_time_s} {micro(r.rms_px)} {r.points} {r.photometry_time_s}")


with lightwell.connect(sys.argv[1]) as probe:
    attempt("calibration", lambda: write_calibration(probe))
    write("before", probe.recording())
    attempt("start", lambda: write("start", probe.start_recording()))
    attempt("again", lambda: write("again", probe.start_recording()))
    attempt("stop", lambda: write("stop", probe.stop_recording()))
    attempt("stop2", lambda: write("stop2", probe.stop_recording()))
