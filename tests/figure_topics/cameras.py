"""Topic cameras: backends and calibration."""
import json
import os
import subprocess

from figure_topics.rows import at_least, at_most, equals, reported
from figure_topics.tests import run_test

SIGHTINGS = "simulated sightings, 40 pictures, 0.2 px, 100 seeds"
BENT = "simulated sightings of a board bent by 2 mm, or of spacing 0.32 that says 0.3; 25 seeds"
LENSES = "published intrinsics beyond 180 deg"
SENSOR = "simulated sensor, 100 seeds"

# Google Test programs whose tests are requirements, and what is real in them.
PROGRAMS = [
    ("calibration_test", "models, derivatives against small steps; " + LENSES),
    ("geometry_test", "simulated sightings: kinds of lenses, pairs, time offset, degenerate input"),
    ("calibrate_geometry_test", "rendered pictures, real AprilTag, from files to a lamp's direction"),
    ("tag_detector_test", "rendered pictures, real AprilTag"),
    ("mounting_test", "rendered pictures and sightings, 100 seeds"),
    ("v4l2_test", "values alone; real libjpeg-turbo"),
    ("v4l2_conformance_test", "umockdev's device, real system calls: the conformance suite"),
    ("v4l2_device_test", "umockdev's device, real system calls: controls, unplugging"),
    ("libcamera_values_test", "values alone: choices, pairing"),
    ("libcamera_backend_test", "simulated lenses behind the backend: the conformance suite"),
    ("libcamera_system_test", "real libcamera 0.0.3, no camera"),
]
TARGETS = ["measure_geometry", "measure_models", "measure_photometry", "measure_converters"]
TEST_TARGETS = [name for name, _ in PROGRAMS]


def lines_of(command, say):
    say(" ".join(str(c.name if hasattr(c, "name") else c) for c in command))
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        return {}
    return {item["figure"]: item for item in map(json.loads, done.stdout.splitlines())}


def normalized(rows, name, get):
    """Adds rows of the normalized error (error / sigma, RMS) of directions, and its mean over the model's parameters.

    It is 1 if the stated sigmas are correct."""
    for what in ("direction", "mean"):
        figure = get(f"normalized.{what}")
        rows.append(at_least(f"{name}: error / sigma, {what}, at least", 0.9, figure, "", SIGHTINGS))
        rows.append(at_most(f"{name}: error / sigma, {what}, at most", 1.1, figure, "", SIGHTINGS))


def geometry(programs, say):
    rows = []
    values = {k: v["value"] for k, v in lines_of([programs / "measure_geometry"], say).items()}
    for kind in ("kannala_brandt", "double_sphere", "mei"):
        get = lambda figure: values.get(f"geometry.{kind}.{figure}")
        name = kind.replace("_", " ")
        rows.append(equals(f"{name}: calibrations that failed", 0, get("failed"), "", SIGHTINGS))
        rows.append(
            at_most(
                f"{name}: directions, RMS over the lens up to its edge, median",
                0.05,
                get("direction_deg.median"),
                "deg",
                SIGHTINGS,
            )
        )
        rows.append(
            at_most(
                f"{name}: directions, RMS over the lens up to its edge, largest",
                0.05,
                get("direction_deg.largest"),
                "deg",
                SIGHTINGS,
            )
        )
        rows.append(
            at_least(
                f"{name}: truth within 3 sigma, of the number that is so least often",
                0.95,
                get("within_3_sigma.least"),
                "",
                SIGHTINGS,
            )
        )
        normalized(rows, name, get)
        if kind == "kannala_brandt":
            rows.append(at_most(f"{name}: focal length, median", 0.1, percent(get("focal.median")), "%", SIGHTINGS))
            rows.append(at_most(f"{name}: focal length, largest", 0.1, percent(get("focal.largest")), "%", SIGHTINGS))
        else:
            # The focal length is correlated with xi; only their combination is well determined (README of geometry).
            rows.append(reported(f"{name}: focal length, median", percent(get("focal.median")), "%", SIGHTINGS))
    for noise in ("contaminated", "by_picture", "within_tag"):
        get = lambda figure: values.get(f"geometry.noise.{noise}.{figure}")
        normalized(rows, f"noise {noise.replace('_', ' ')}", get)
    for board in ("cylinder", "sphere", "spacing"):
        get = lambda figure: values.get(f"geometry.board.{board}.{figure}")
        rows.append(at_least(f"board {board}: share in which it is found and fitted", 1, get("shaped"), "", BENT))
        rows.append(at_most(f"board {board}: directions, largest", 0.05, get("direction_deg.largest"), "deg", BENT))
    pair = lambda figure: values.get(f"geometry.pair.{figure}")
    real = "simulated sightings of four boards, 40 captures, 0.2 px, 100 seeds"
    rows.append(equals("pair: calibrations that failed", 0, pair("failed"), "", real))
    rows.append(at_most("pair: T_lens1_lens0, turn, largest", 0.1, pair("turn_deg.largest"), "deg", real))
    rows.append(at_most("pair: T_lens1_lens0, translation, largest", 1, pair("shift_mm.largest"), "mm", real))
    rows.append(
        at_least(
            "pair: truth within 3 sigma, of the number that is so least often",
            0.95,
            pair("within_3_sigma.least"),
            "",
            real,
        )
    )
    return rows


def models(programs, say):
    values = {k: v["value"] for k, v in lines_of([programs / "measure_models"], say).items()}
    rows = [at_least("published lenses beyond 180 deg", 3, values.get("models.published"), "", LENSES),
            at_most("pixel to direction and back, largest", 1e-5, values.get("models.double_px"), "px", LENSES)]
    for kind in ("kannala_brandt", "double_sphere", "mei"):
        rows.append(at_most(f"light direction with calibrated parameters, {kind.replace('_', ' ')}, largest", 0.2,
                            values.get(f"light_deg.{kind}"), "deg", "simulated lens and sightings, real estimator"))
    return rows


def percent(value):
    return None if value is None else 100 * value


def photometry(programs, say):
    figures = lines_of([programs / "measure_photometry"], say)
    rows = []
    for figure, item in figures.items():
        last = figure.split(".")[-1]
        if last in ("curve", "edge"):
            what = "response, RMS of full scale" if last == "curve" else "vignetting, relative, anywhere in the field"
            rows.append(at_most(f"{what}, largest, {figure}", 1, percent(item["value"]), "%", SENSOR))
        elif item["inside"] is not None and last != "kind":
            rows.append(at_least(f"truth within 3 sigma, {figure}", 0.95, item["inside"], "", SENSOR))
    if not figures:
        rows.append(at_most("response, RMS of full scale", 1, None, "%", SENSOR))
    return rows


def converters(programs, say):
    """Times the conversions of the v4l2 backend. Raw, YUYV and NV12 buffers are passed on without conversion."""
    panorama = os.path.join(os.environ["LIGHTWELL_PANORAMA_DIR"], "interior.exr")
    rows = []
    for figure, item in lines_of([programs / "measure_converters", panorama], say).items():
        real = (f"real converter, 1280x960; {item['ms']:.3g} ms, memcpy {item['memcpy_gb_per_s']:.3g} GB/s, "
                f"{item['bytes'] / 1000:.0f} kB")
        rows.append(reported(f"time by memcpy's of the picture, {figure}", item["value"], "", real))
    if not rows:
        rows.append(reported("time by memcpy's of the picture, converters", None, "", "did not run"))
    return rows


def programs_pass(say):
    """Two rows for each program. One that did not run, or was skipped, does not hold."""
    rows = []
    for name, real in PROGRAMS:
        say(name)
        done = run_test(name)
        rows.append(equals(f"{name}: passes", 1, done["passed"], "", real))
        rows.append(reported(f"{name}: tests that ran", done["ran"], "", real))
    return rows


def measure(programs, say):
    return (
        geometry(programs, say)
        + models(programs, say)
        + photometry(programs, say)
        + converters(programs, say)
        + programs_pass(say)
    )
