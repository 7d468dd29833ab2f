"""Topic marker_scenes: the marker estimator on path-traced pictures of random scenes (sets and classes: README.md of
tests/reference/mitsuba/marker_scenes). Nothing was tuned on the set `unseen`.

Shares of pictures that are not flagged are of all pictures of a class or set: a picture without an answer counts as
flagged. Errors are those of the answers; rows say whether these are flagged.
"""

from figure_topics import aarch64
from figure_topics.marker import lines_of
from figure_topics.rows import at_least, at_most, is_measured, reported, row

TARGETS = ["measure_marker_peers", "measure_marker_scenes", "measure_marker_speed"]
WORK = (10, 30)  # Frames of the two counted runs.

REAL = "Mitsuba's pictures, simulated camera (noise, blur, vignetting, white balance, JPEG); real AprilTag"
CLASSES = {"lit_faces": ("the strongest lamp gives 60 % of two faces' light", 85),
           "shadow_behind": ("the lamp behind, its shadow in view on a plain or weakly patterned table", 60)}
MEDIAN_DEG, DECILE_DEG = 1.5, 5
# Percent, RMS over normals within 60 degrees of the camera: median, ninth decile.
IRRADIANCE = {"flagged": (12, 25), "unflagged": (6, 12)}
# Percent of the errors within a squared Mahalanobis distance of 6.18: the chi-square quantile of two degrees of freedom
# at the probability of two sigma in one dimension (95.45 %). Less: the covariances are too small; more: too large.
WITHIN_TWO_SIGMA = (85, 99)
DEFECT_DEG = 2
# The only defect with which every picture must be flagged; with the others, none may be.
BLURRED = "blur_2px"


def between(name, limits, measured, unit, real):
    valid = is_measured(measured)
    return row(name, f"{limits[0]:g} to {limits[1]:g}", measured if valid else "not measured", unit,
               valid and limits[0] <= measured <= limits[1], real)


def unseen(figures):
    get = lambda figure: figures.get(f"unseen.{figure}", {}).get("value")
    count = lambda figure: figures.get(f"unseen.{figure}", {}).get("pictures", 0)
    of = lambda figure: f"{REAL}; {count(figure):g} pictures"
    rows = [at_least("unseen pictures", 500, count("answered"), "", REAL),
            reported("pictures with an answer", get("answered"), "%", REAL),
            at_most("not flagged, and off by more than 10 deg or a squared distance of 11.83", 1.5,
                    get("confident_wrong"), "%", REAL),
            at_most("not flagged: worst direction", 20, get("confident_worst_deg"), "deg", of("confident_worst_deg"))]
    for flag in ("flagged", "unflagged"):
        figure = f"within_6.18.{flag}"
        rows.append(between(f"{flag}: errors within a squared distance of 6.18", WITHIN_TWO_SIGMA, get(figure), "%",
                            of(figure)))
    for scene_class, (what, share) in CLASSES.items():
        figure = f"{scene_class}.not_flagged"
        rows.append(at_least(f"{what}: not flagged", share, get(figure), "%", of(figure)))
        for quantile, name, limit in (("median", "median", MEDIAN_DEG), ("decile", "ninth decile", DECILE_DEG)):
            figure = f"{scene_class}.{quantile}_deg"
            rows.append(at_most(f"{what}, not flagged: direction, {name}", limit, get(figure), "deg", of(figure)))
    rows.append(reported("other scenes: not flagged", get("other.not_flagged"), "%", of("other.not_flagged")))
    for flag, limits in IRRADIANCE.items():
        for quantile, name, limit in zip(("median", "decile"), ("median", "ninth decile"), limits):
            figure = f"irradiance.{flag}.{quantile}"
            rows.append(at_most(f"{flag}: irradiance, RMS over normals within 60 deg of the camera, {name}", limit,
                                get(figure), "%", of(figure)))
    return rows


def defects(figures):
    """One lamp in front, a plain table, a perfect body, one defect of the camera at a time."""
    rows = []
    for name in sorted(f.split(".")[1] for f in figures if f.startswith("defects.") and f.endswith(".worst_deg")):
        flagged = figures[f"defects.{name}.flagged"]
        real = f"{REAL}; {flagged['pictures']:g} pictures"
        if name == BLURRED:
            rows.append(at_least(f"defect {name}: flagged", 100, flagged["value"], "%", real))
            continue
        rows.append(at_most(f"defect {name}: flagged", 0, flagged["value"], "%", real))
        rows.append(at_most(f"defect {name}: direction, worst of all", DEFECT_DEG,
                            figures[f"defects.{name}.worst_of_all_deg"]["value"], "deg", real))
    return rows or [row("defects", "measured", "not measured", "", False, REAL)]


def moving(figures):
    get = lambda figure: figures.get(f"moving.{figure}", {}).get("value")
    real = f"{REAL}; {figures.get('moving.ratio', {}).get('sequences', 0):g} sequences of ten frames"
    return [reported("moving camera: direction of single frames, median", get("single_deg"), "deg", real),
            reported("moving camera: direction after ten frames, median", get("followed_deg"), "deg", real),
            at_most("moving camera: error after ten frames, relative to single frames", 0.5, get("ratio"), "x", real)]


def small(figures):
    answered = figures.get("small.answered", {})
    return [reported("bodies of 30 to 100 pixels: answered", answered.get("value"), "%", REAL),
            at_most("bodies of 30 to 100 pixels: not flagged and wrong", 0,
                    figures.get("small.confident_wrong", {}).get("value"), "%", REAL)]


def peers(figures):
    """Published methods on the dodecahedra of `unseen`; their thresholds are the best for `dev`."""
    rows = []
    methods = {"seed": "Straughn 2018", "arief": "Arief 2012", "ours": "Lightwell, flagged answers too"}
    for method, name in methods.items():
        for scene_class in ("all", *CLASSES):
            for quantile, what in (("median", "median"), ("decile", "ninth decile")):
                figure = figures.get(f"unseen.{scene_class}.{method}.{quantile}", {})
                rows.append(reported(f"{name}, {scene_class}: direction, {what}", figure.get("value"), "deg",
                                     f"{REAL}; {figure.get('pictures', 0):g} answers"))
    return rows


def speed(figures, say):
    real = "a path-traced frame of 1280x960, simulated sensor; real AprilTag and Ceres; time of one thread's processor"
    get = lambda what: figures.get(f"marker_speed.{what}", {}).get("value")
    ratio = lambda what: get("ms_all") / get(what) if get("ms_all") and get(what) else None
    rows = [at_least("followed frame, one thread", 60, get("fps"), "frames/s",
                     f"{real}; memcpy {get('memcpy_gb_per_s')} GB/s"),
            reported("followed frame, relative to memcpy of the frame", ratio("ms_memcpy"), "x", real),
            reported("followed frame, relative to AprilTag's own detection at half resolution", ratio("ms_apriltag"),
                     "x", real)]
    folder, _ = aarch64.build(["measure_marker_speed"], say)
    counted = aarch64.instructions([folder / "measure_marker_speed", "--count", "{}"], WORK) if folder else None
    rows.append(reported("aarch64 instructions a followed frame", counted and counted / 1e6, "millions",
                         "g++ -O3, qemu-user Cortex-A72, frame to descriptor"))
    return rows


def measure(programs, say):
    command = [programs / "measure_marker_scenes"]
    for name in ("unseen", "defects", "moving", "small"):
        command += ["--set", name]
    times = lines_of([programs / "measure_marker_speed"], say)
    figures = lines_of(command, say)
    published = lines_of([programs / "measure_marker_peers", "--set", "unseen"], say)
    return (speed(times, say) + unseen(figures) + defects(figures) + moving(figures) + small(figures) +
            peers(published))
