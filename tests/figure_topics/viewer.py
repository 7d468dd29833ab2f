"""Topic viewer: virtual objects beside real ones in path-traced trials (tests/reference/mitsuba/viewer), three balls
from the SDK's map, the dashboard's latency and its many clients.

Trials, seeds and the places of the probe are in scenes.py beside the pictures; how outlines are measured, in
tests/measure/viewer_trials.hpp; ways to light the virtual object, in tests/measure/viewer_scenes.hpp. No trial is left
out, and nothing may be tuned on them. Rows of ar_viewer are not measured where its libraries are missing.
"""
import json
import math
import pathlib
import re
import statistics
import subprocess
import tempfile
from collections import defaultdict

from figure_topics.marker import items_of
from figure_topics.rows import at_most, equals, reported, row
from figure_topics.tests import ROOT, run_test

ALL_PANORAMAS = True
TARGETS = ["measure_viewer", "measure_balls", "measure_queries"]
TEST_TARGETS = ["web_link_test"]

TRIALS, PANORAMAS = 23, 26
RMS_DEG = 0.3
# CubeMap360 (Alhakamy & Tuceryan 2019), Table I: the error of the light's angle in its three trials.
SEED_ERRORS_DEG = {"00": 0.58, "01": 1.23, "02": 0.41}
DISTANCES = {1.0: "1 m", 3.0: "3 m", 60.0: "far away"}
PLACES = {"top": "probe at the object's top", "away": "probe a metre away"}
METHODS = {"constant": "constant light", "s0": "Algorithm 1 of CubeMap360", "main_light_and_sh9":
           "main light and nine coefficients", "full": "ours"}
MIRROR_OF_EXACT, MIRROR_CLIPPED = 1.15, 0.06
# si-RMSE of mirror balls by methods that see one picture, on other panoramas: StyleLight 0.55, and around it.
PUBLISHED_MIRROR = "0.44 to 0.62"
PROTOCOLS = {"si_rmse": "linear light", "si_rmse_published": "the literature's protocol", "si_rmse_clipped":
             "clipped at the 99.9th percentile"}
SDK_SHARE, SDK_FRAMES = 1.0, 60
CUBE_MAPS_PER_SECOND = 30

TRACED = "path-traced pictures of 1280x960, simulated 8-bit pair of 1280x960, three exposures, encoded descriptor"


def rms(values):
    """None if a value is missing."""
    return math.sqrt(statistics.fmean(v * v for v in values)) if values and None not in values else None


def middle(values):
    return statistics.median(values) if values and None not in values else None


def direction_rows(lines, place, what, keys, real):
    """RMS errors of elevation and azimuth, of all trials and by the distance of the lamp."""
    # A metre away the lamp's direction is another one, and a descriptor of one place does not say how far it is.
    figure = at_most if place == "top" else lambda name, limit, *rest: reported(name, *rest)
    rows = []
    for angle, key in zip(("elevation", "azimuth"), keys):
        groups = [("", lines)] + [(f", lamps {name}", [l for l in lines if l["distance_m"] == d])
                                  for d, name in DISTANCES.items()]
        for suffix, chosen in groups:
            values = [l.get(key) for l in chosen] if len(lines) == TRIALS else None
            rows.append(figure(f"{what}, RMS error of {angle}{suffix}, {PLACES[place]}", RMS_DEG, rms(values), "deg",
                               real))
    return rows


def outline_rows(lines, place, what, real):
    rows = []
    for key, name in (("outline_median_px", "median"), ("outline_95_px", "95 %")):
        values = [l.get(key) for l in lines] if len(lines) == TRIALS else None
        rows.append(reported(f"{what}, distance of the outlines, {name}, median of the trials, {PLACES[place]}",
                             middle(values), "px", real))
        if place == "top":
            for distance, near in DISTANCES.items():
                chosen = [l.get(key) for l in lines if l["distance_m"] == distance]
                rows.append(reported(f"{what}, distance of the outlines, {name}, lamps {near}, {PLACES[place]}",
                                     middle(chosen), "px", real))
    return rows


def estimates(lines):
    rows = [equals("trials", TRIALS, len(lines) / len(PLACES), "", TRACED)]
    for place in PLACES:
        chosen = [l for l in lines if l["place"] == place]
        rows += direction_rows(chosen, place, "light", ("elevation_error_deg", "azimuth_error_deg"), TRACED)
        rows += direction_rows(chosen, place, "shadow by ShadowCaster",
                               ("shadow_elevation_error_deg", "shadow_azimuth_error_deg"), TRACED)
        rows += outline_rows(chosen, place, "shadow by ShadowCaster", TRACED)
    for name, published in SEED_ERRORS_DEG.items():
        errors = [abs(l["shadow_elevation_error_deg"]) for l in lines
                  if (l["trial"], l["place"]) == (name, "top") and l["shadow_elevation_error_deg"] is not None]
        rows.append(reported(f"trial {int(name) + 1} of CubeMap360's Table I, error of the elevation by the shadow",
                             errors[0] if errors else None, "deg", TRACED, published))
    return rows


def built_viewer(programs, say):
    """ar_viewer in the folder of the programs; None where it cannot be built."""
    done = subprocess.run(["cmake", "--build", "--preset", "bench", "--target", "ar_viewer"], cwd=ROOT,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    program = programs / "ar_viewer"
    if done.returncode == 0 and program.exists():
        return program
    say("ar_viewer: left out, it was not built")
    return None


def drawn(viewer, scene, folder, say, frames=1):
    """Draws a scene headless; returns the lines that ar_viewer prints."""
    return items_of([viewer, scene, "--headless", "--frames", str(frames), "--out", folder, "--linear", "--json"], say)


def composites(lines):
    rows, real = [], TRACED + "; ar_viewer, software Mesa"
    grouped = defaultdict(list)
    for line in lines:
        grouped[line["place"], line["method"]].append(line)
    for place in PLACES:
        ours = grouped[place, "full"]
        rows += direction_rows(ours, place, "shadow by ar_viewer",
                               ("shadow_elevation_error_deg", "shadow_azimuth_error_deg"), real)
        rows += outline_rows(ours, place, "shadow by ar_viewer", real)
        for method, name in METHODS.items():
            chosen = grouped[place, method]
            for key, what, unit, factor in (("shading_error", "shading, of the object's mean", "%", 100),
                                            ("shadow_error", "light ratio on the table around it", "%", 100)):
                values = [factor * l[key] for l in chosen] if len(chosen) == TRIALS else []
                rows.append(reported(f"mean absolute difference of {what}, {name}, {PLACES[place]}",
                                     statistics.fmean(values) if values else None, unit, real))
    return rows


def small_scene(path, light, folder):
    """The scene at 640x360 in another light, in a file of its own."""
    scene = json.loads(path.read_text())
    scale = 640 / scene["camera"]["width"]
    camera = {key: scale * scene["camera"][key] for key in ("fx", "fy")}
    scene["camera"] = camera | {"width": 640, "height": 360, "cx": 319.5, "cy": 179.5}
    del scene["background"]
    scene["light"] = str(path.parent / light)
    small = folder / "small.json"
    small.write_text(json.dumps(scene))
    return small


def timing(lines, what):
    real = f"640x360, an object and its shadow, {SDK_FRAMES} frames, software Mesa; without the first"
    # Means: the shadow of the residual is not computed in each frame.
    parts = {key: statistics.fmean(l[key] for l in lines[1:]) if lines[1:] else None
             for key in ("sdk_ms", "shadow_ms", "render_ms")}
    share = None if None in parts.values() else 100 * (parts["sdk_ms"] + parts["shadow_ms"]) / parts["render_ms"]
    return [reported(f"a frame of ar_viewer, {what}: queries of the SDK, mean", parts["sdk_ms"], "ms", real),
            reported(f"a frame of ar_viewer, {what}: the SDK's ShadowCaster, mean", parts["shadow_ms"], "ms", real),
            reported(f"a frame of ar_viewer, {what}: rendering, mean", parts["render_ms"], "ms", real),
            at_most(f"a frame of ar_viewer, {what}: both parts of the SDK by rendering", SDK_SHARE, share, "%", real)]


def timings(viewer, work, say):
    scene = next(iter(sorted(work.glob("*_top_full.json"))), None)
    rows = []
    for light, what in (("00_top.descriptor", "a light that stays"), ("turning.lwrec", "a light that changes")):
        lines = []
        if viewer and scene:
            lines = drawn(viewer, small_scene(scene, light, work), work / "small", say, SDK_FRAMES)
        rows += timing(lines, what)
    return rows


def viewer_rows(programs, work, say):
    viewer = built_viewer(programs, say)
    if viewer is None:
        return composites([]) + timings(None, work, say)
    for scene in sorted(work.glob("*.json")):
        drawn(viewer, scene, scene.with_suffix(""), say)
    lines = items_of([programs / "measure_viewer", "--compare", work], say)
    return composites(lines) + timings(viewer, work, say)


def balls(lines):
    real = "26 real panoramas, simulated ideal pair of 640x480, encoded and decoded"
    by_answer = defaultdict(dict)
    for line in lines:
        if line["ball"] == "mirror":
            by_answer[line["answer"]][line["scene"]] = line
    exact, rows = by_answer["exact_64"], []
    complete = len(exact) == PANORAMAS
    rows.append(equals("panoramas of the three balls", PANORAMAS, len(exact), "", real))
    for answer, name in (("map_64", "map of 64x64 and lights"), ("map_64_caps", "map of 64x64, all lights as caps"),
                         ("map_64_alone", "map of 64x64 alone, max_lights 0")):
        ours = by_answer[answer]
        for key, protocol in PROTOCOLS.items():
            ratios = [ours[s][key] / exact[s][key] for s in exact] if complete and len(ours) == PANORAMAS else []
            what = f"mirror ball, {name}, si-RMSE by that of exact means, {protocol}"
            rows.append(reported(what + ", median", middle(ratios), "x", real))
            largest = max(ratios, default=None)
            if answer == "map_64":
                rows.append(at_most(what + ", largest", MIRROR_OF_EXACT, largest, "x", real))
            else:
                rows.append(reported(what + ", largest", largest, "x", real))
    for answer, name in (("map_64", "map of 64x64 and lights"), ("map_64_alone", "map of 64x64 alone, max_lights 0"),
                         ("exact_64", "exact means of 64x64 texels"),
                         ("irradiance", "descriptor alone, without a map")):
        for key, protocol in PROTOCOLS.items():
            values = [line[key] for line in by_answer[answer].values()]
            value = middle(values) if len(values) == PANORAMAS else None
            what = f"mirror ball, {name}, si-RMSE, {protocol}, median"
            if (answer, key) == ("map_64", "si_rmse_clipped"):
                rows.append(at_most(what, MIRROR_CLIPPED, value, "", real))
            elif key == "si_rmse_published":
                rows.append({**reported(what, value, "", real), "asked": f"reported, published {PUBLISHED_MIRROR}"})
            else:
                rows.append(reported(what, value, "", real))
    for ball in ("diffuse", "matte silver"):
        for answer, name in (("map_64", "map of 64x64 and lights"), ("irradiance", "descriptor alone, without a map")):
            for key, protocol in PROTOCOLS.items():
                values = [l[key] for l in lines if (l["ball"], l["answer"]) == (ball, answer)]
                rows.append(reported(f"{ball} ball, {name}, si-RMSE, {protocol}, median",
                                     middle(values) if len(values) == PANORAMAS else None, "", real))
    return rows


def cube_maps(lines):
    """Of 64 texels, RGBA16F: the time of one against the pause between two."""
    times = {l["figure"]: l["value"] for l in lines if l["figure"].startswith("cube_map_ms")}
    real = "one thread, 64x64 texels, RGBA16F"
    rows = []
    for figure, name in (("map.8", "from a map, eight lights"), ("harmonics.8", "from harmonics, eight lights")):
        rows.append(at_most(f"time of a cube map, {name}: 30 a second", 1000 / CUBE_MAPS_PER_SECOND,
                            times.get(f"cube_map_ms.{figure}"), "ms", real))
    return rows


def latency_rows(table):
    """The rows of a table in Markdown: client, descriptors, p50, p99, clock uncertainty."""
    cells = re.findall(r"^\| ([^|]+) \| (\d+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", table, re.M)
    rows, real = [], "real daemon, simulated camera, TCP on this machine, 60 descriptors a second"
    for client, _, p50, p99, uncertainty in cells:
        rows += [reported(f"latency, {client}, p50", float(p50), "ms", real),
                 reported(f"latency, {client}, p99", float(p99), "ms", f"{real}; clock known to {uncertainty} ms")]
    return rows or [row("latency of browser and native client", "reported", "not measured", "", False, real)]


def latency(say):
    say("web_latency")
    done = subprocess.run(["cmake", "--build", "--preset", "dev", "--target", "web_latency"], cwd=ROOT,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return latency_rows("" if done.returncode else done.stdout)


def clients(say):
    say("web_link_test, 100 clients")
    found = run_test("web_link_test", "*OfAHundredClientsTwentyNeverRead")
    return [equals("100 sockets of which 20 never read: the others receive, memory is bounded", 1, found["passed"], "",
                   "real WebSocket link, raw clients")]


def measure(programs, say):
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        rows = estimates(items_of([programs / "measure_viewer", "--write", work], say))
        rows += viewer_rows(programs, work, say)
    rows += balls(items_of([programs / "measure_balls"], say))
    rows += cube_maps([l for l in items_of([programs / "measure_queries"], say) if "figure" in l])
    return rows + latency(say) + clients(say)
