"""Topic marker: light from a marker body, compared with Straughn's algorithm ("the seed") and its published figures,
and with the shadow-based method of Arief et al.

The grid of Straughn's thesis: a body of 10 cm between opposite faces on a dark board, the lamp 35 degrees above the
board at 61 cm, path-traced; ten noisy 8-bit frames of each picture. Errors are those of the direction from the body's
centre.
"""

import json
import os
import pathlib
import resource
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor

from figure_topics.rows import at_least, at_most, equals, is_measured, known_short, reported, row

TARGETS = [
    "measure_marker",
    "measure_marker_extremes",
    "measure_marker_light",
    "measure_marker_speed",
    "measure_marker_trade",
    "lightwell-estimate",
    "lightwell-eval",
]

ENCODINGS = {"srgb": "sRGB", "linear": "linear"}
PLACES = {
    "front": "in front",
    "front_right": "front right",
    "right": "right",
    "back_right": "back right",
    "behind": "behind",
}
# Two or more visible faces are lit: shading determines the direction.
LIT = ("front", "front_right", "right")
LIT_MEAN_DEG, LIT_WORST_DEG = 3, 8
# No visible face, or only the top one, is lit: the shadow on the board must determine the direction.
BACK = ("back_right", "behind")
BACK_WORST_DEG = 10
# Percent. As in topic panorama: an accuracy row does not hold if more than a tenth of its frames is flagged.
MOST_FLAGGED = 10
GROUPS = {"grid": "", "low": ", camera 10 deg above the board"}
SEEN_LOW = {"low": "camera 10 deg above the board", "air": "camera 10 deg above, no board"}
VIEWS = ("white.straight", "white.turned", "grey.straight", "grey.turned")
SEEDS = {"seed_letter": "its perspective matrix to the letter, best fixed threshold",
         "seed_half": "threshold of 0.5",
         "seed_each": "the best threshold for each single frame"}

REAL = "Mitsuba's pictures, simulated 8-bit sensor, {encoding}; real AprilTag"

# Why all frames of a row may be flagged.
OPEN = (
    "what these faces leave open, whoever looks at them: tests/reference/mitsuba/marker/what_faces_tell.py --direction"
)


def lines_of(command, say):
    """Runs a program; returns the JSON objects that it prints by figure, {} if it failed. Objects without the key
    `figure` are skipped."""
    say(" ".join(str(getattr(c, "name", c)) for c in command))
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        return {}
    return {item["figure"]: item for item in map(json.loads, done.stdout.splitlines()) if "figure" in item}


def items_of(command, say):
    """Runs a program; returns the JSON objects that it prints, one a line; [] if it failed."""
    say(" ".join(str(getattr(c, "name", c)) for c in command))
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    return [] if done.returncode else [json.loads(line) for line in done.stdout.splitlines()]


def share_flagged(item):
    """Flagged frames in percent; a frame without an estimate counts as flagged. None without frames."""
    return 100 * (item["flagged"] + item["unanswered"]) / item["frames"] if item.get("frames") else None


def unless_flagged(figure, item):
    """The row, which does not hold if more than MOST_FLAGGED percent of the item's frames are flagged."""
    share = share_flagged(item)
    return {**figure, "holds": figure["holds"] and share is not None and share <= MOST_FLAGGED}


def right_or_flagged(name, limit, item, real):
    """A row that holds if all frames are flagged or the largest error is at most `limit` degrees."""
    if not item.get("frames"):
        return row(name, f"flagged, or <= {limit:g}", "not measured", "deg", False, real)
    if share_flagged(item) == 100:
        return row(name, f"flagged, or <= {limit:g}", "all flagged", "deg", True, real)
    worst = item["value"]
    return row(
        name,
        f"flagged, or <= {limit:g}",
        worst if is_measured(worst) else "not measured",
        "deg",
        is_measured(worst) and worst <= limit,
        real,
    )


def grid_of_ours(figures):
    rows = []
    for encoding, encoding_name in ENCODINGS.items():
        real = REAL.format(encoding=encoding_name)
        get = lambda figure: figures.get(f"ours.{encoding}.{figure}", {})
        for place in LIT:
            mean, worst = get(f"grid.{place}.mean"), get(f"grid.{place}.worst")
            name = f"lamp {PLACES[place]}, {encoding_name}"
            rows.append(
                unless_flagged(at_most(f"{name}: direction, mean", LIT_MEAN_DEG, mean.get("value"), "deg", real), mean)
            )
            rows.append(
                unless_flagged(
                    at_most(f"{name}: direction, worst frame", LIT_WORST_DEG, worst.get("value"), "deg", real), worst
                )
            )
            rows.append(at_most(f"{name}: frames that are flagged", MOST_FLAGGED, share_flagged(mean), "%", real))
        for group, where in GROUPS.items():
            for place in BACK:
                worst = get(f"{group}.{place}.worst")
                name = f"lamp {PLACES[place]}, shadow in view{where}, {encoding_name}"
                rows.append(
                    unless_flagged(
                        at_most(f"{name}: direction, worst frame", BACK_WORST_DEG, worst.get("value"), "deg", real),
                        worst,
                    )
                )
                rows.append(at_most(f"{name}: frames that are flagged", MOST_FLAGGED, share_flagged(worst), "%", real))
        for place in BACK:
            worst = get(f"air.{place}.worst")
            name = f"lamp {PLACES[place]}, no board, {encoding_name}"
            rows.append(right_or_flagged(f"{name}: direction, worst frame", BACK_WORST_DEG, worst, real))
            rows.append(reported(f"{name}: frames that are flagged", share_flagged(worst), "%", real))
    return rows


def grid_of_seed(figures):
    """For comparison: the thesis's published errors, and its algorithm on these frames at the best fixed threshold."""
    rows = []
    thesis = lambda what: figures.get(f"thesis.{what}", {}).get("value")
    for encoding, encoding_name in ENCODINGS.items():
        real = REAL.format(encoding=encoding_name)
        name = f"seed's algorithm, {encoding_name}"
        get = lambda figure: figures.get(f"seed.{encoding}.{figure}", {})
        rows.append(reported(f"{name}: best fixed threshold", get("setting").get("value"), "", real))
        for place, place_name in PLACES.items():
            mean, worst = get(f"grid.{place}.mean").get("value"), get(f"grid.{place}.worst").get("value")
            rows.append(reported(f"{name}, lamp {place_name}: direction, mean", mean, "deg", real, thesis(place)))
            rows.append(reported(f"{name}, lamp {place_name}: direction, worst frame", worst, "deg", real))
        for group, where in SEEN_LOW.items():
            for place in BACK:
                mean = get(f"{group}.{place}.mean").get("value")
                rows.append(reported(f"{name}, lamp {PLACES[place]}, {where}: direction, mean", mean, "deg", real))
        for view in VIEWS:
            rows.append(
                reported(
                    f"{name}, {view.replace('.', ' body, ')}: direction, mean",
                    get(f"grid.{view}.mean").get("value"),
                    "deg",
                    real,
                    thesis(view),
                )
            )
        rows.append(
            reported(f"{name}: direction, mean of all", get("grid.mean").get("value"), "deg", real, thesis("mean"))
        )
        rows.append(
            reported(
                f"{name}: direction, median of all", get("grid.median").get("value"), "deg", real, thesis("median")
            )
        )
        rows.append(reported(f"{name}: frames without an answer", share_flagged(get("grid.mean")), "%", real))
        for column, what in SEEDS.items():
            value = figures.get(f"{column}.{encoding}.grid.mean", {}).get("value")
            rows.append(reported(f"{name}, {what}: direction, mean of all", value, "deg", real, thesis("mean")))
    return rows


def grid_of_arief(figures):
    """For comparison: the shadow-based method of Arief et al. 2012 at the best fixed threshold."""
    rows = []
    published = figures.get("arief2012.mean", {}).get("value")
    for encoding, encoding_name in ENCODINGS.items():
        real = REAL.format(encoding=encoding_name)
        name = f"shadow-based (Arief 2012), {encoding_name}"
        get = lambda figure: figures.get(f"arief.{encoding}.{figure}", {})
        rows.append(reported(f"{name}: best fixed threshold", get("setting").get("value"), "of the ground", real))
        for place, place_name in PLACES.items():
            mean, worst = get(f"grid.{place}.mean").get("value"), get(f"grid.{place}.worst").get("value")
            rows.append(reported(f"{name}, lamp {place_name}: direction, mean", mean, "deg", real))
            rows.append(reported(f"{name}, lamp {place_name}: direction, worst frame", worst, "deg", real))
        for place in BACK:
            mean = get(f"low.{place}.mean").get("value")
            rows.append(
                reported(f"{name}, lamp {PLACES[place]}, {SEEN_LOW['low']}: direction, mean", mean, "deg", real)
            )
        mean = get("grid.mean")
        rows.append(reported(f"{name}: direction, mean of all", mean.get("value"), "deg", real, published))
        rows.append(reported(f"{name}: frames without an answer", share_flagged(mean), "%", real))
        line = figures.get(f"arief_line.{encoding}.grid.mean", {}).get("value")
        rows.append(reported(f"{name}, by the shadow's line and tip: direction, mean of all", line, "deg", real))
        each = figures.get(f"arief_each.{encoding}.grid.mean", {}).get("value")
        rows.append(reported(f"{name}, {SEEDS['seed_each']}: direction, mean of all", each, "deg", real))
    return rows


def light(items):
    """Two lamps, near and far lamps, rooms; and whether the stated sigmas match the errors. Every frame counts; the
    share of flagged ones has a row of its own."""
    real = REAL.format(encoding="sRGB")
    rows = []
    of_group = lambda group: [i for i in items if i["group"] == group]
    largest = lambda values: max(values, default=None)

    def flagged(name, of):
        share = 100 * sum(i["unsure"] for i in of) / len(of) if of else None
        rows.append(at_most(f"{name}: frames that are flagged", MOST_FLAGGED, share, "%", real))

    two = [i for i in of_group("two") if i.get("found", 0) >= 1]
    lamps = [lamp for i in two for lamp in i["lamps"]]
    rows.append(
        at_most(
            "two lamps 60 to 120 degrees apart: direction of either, worst",
            8,
            largest([x["error_deg"] for x in lamps]),
            "deg",
            real,
        )
    )
    rows.append(
        at_most(
            "two lamps: colour (channels' shares) of either, worst",
            10,
            largest([100 * x["color"] for x in lamps]),
            "%",
            real,
        )
    )
    rows.append(
        reported(
            "two lamps: irradiance of either, worst", largest([100 * abs(x["irradiance"]) for x in lamps]), "%", real
        )
    )
    rows.append(
        equals(
            "two lamps: frames in which exactly two are found",
            len(of_group("two")),
            sum(i["found"] == 2 for i in two),
            "frames",
            real,
        )
    )
    flagged("two lamps", of_group("two"))
    near = of_group("near")
    first = [i["lamps"][0] for i in near if i.get("lamps")]
    rows.append(
        equals(
            "near lamp (30 cm): frames in which it is near",
            len(near),
            sum("position" in x for x in first),
            "frames",
            real,
        )
    )
    rows.append(
        at_most(
            "near lamp: position, worst",
            10,
            largest([100 * x["position"] for x in first if "position" in x]),
            "% of 30 cm",
            real,
        )
    )
    flagged("near lamp", near)
    lamps = [lamp for i in items for lamp in i.get("lamps", [])]
    deviations = [abs(lamp["distance_deviations"]) for lamp in lamps if "distance_deviations" in lamp]
    within = 100 * sum(d < 3 for d in deviations) / len(deviations) if deviations else None
    what = f"all {len(deviations)} distances in descriptors: inverse distance within 3 sigma"
    rows.append(at_least(what, 95, within, "%", real))
    far = [i["lamps"][0] for i in of_group("far") if i.get("lamps")]
    rows.append(reported("lamp at 5 m: direction, worst", largest([x["error_deg"] for x in far]), "deg", real))
    for name in sorted({i["frame"] for i in of_group("room")}):
        of = [i for i in items if i["frame"] == name]
        unflagged = [i["error_deg"] for i in of if not i["unsure"] and "error_deg" in i]
        share = f"{100 * of[0]['strongest_share']:.0f} % of what faces it, {of[0]['faces_lit']} seen faces lit"
        if of[0]["faces_lit"] >= 2:
            rows.append(
                row(
                    f"{name}: direction of the strongest light, worst",
                    "<= 6",
                    max(unflagged) if unflagged else "all flagged",
                    "deg",
                    bool(unflagged) and len(unflagged) == len(of) and max(unflagged) <= 6,
                    f"{real}; {share}; {OPEN}",
                )
            )
        rows.append(
            equals(
                f"{name}: confident and further off than 6 deg",
                0,
                sum(e > 6 for e in unflagged),
                "frames",
                f"{real}; {share}",
            )
        )
        rows.append(at_most(f"{name}: irradiance over normals within 60 degrees of the camera, RMS", 10,
                            largest([100 * i["irradiance_rms"] for i in of if "irradiance_rms" in i]), "%", real))
    lit = [i for i in items if i["group"] != "room" and "deviations2" in i]
    # 11.83: chi-square quantile of two degrees of freedom at the probability of three sigma in one dimension (99.73 %).
    within = 100 * sum(i["deviations2"] < 11.83 for i in lit) / len(lit) if lit else None
    rows.append(at_least("errors within 3 sigma, all frames with lamps", 95, within, "%", real))
    sure = [i for i in items if not i["unsure"] and "deviations2" in i]
    within = 100 * sum(i["deviations2"] < 11.83 for i in sure) / len(sure) if sure else None
    rows.append(
        at_least("errors within 3 sigma, all frames that are not flagged, rooms included", 95, within, "%", real)
    )
    return rows


def speed(figures):
    real = "a path-traced frame of 1280x960, simulated sensor; real AprilTag and Ceres; time of one thread's processor"
    get = lambda what: figures.get(f"marker_speed.{what}", {}).get("value")
    rows = [at_least("1280x960 with the marker in view, one thread (the seed: 38.5)", 60, get("fps"), "frames/s",
                     f"{real}; memcpy {get('memcpy_gb_per_s')} GB/s")]
    for what in ("detection_and_pose", "sampling", "light"):
        rows.append(
            reported(f"1280x960: {what.replace('_', ' ')}, of {get('ms_all')} ms", get(f"ms_{what}"), "ms", real)
        )
    rows.append(reported("1280x960: first frame, body and lamps looked for everywhere", get("ms_first"), "ms", real))
    return rows


def still(programs, folder, say):
    """CPU time of lightwell-estimate for one picture: start of the program, decoding, search, estimate."""
    name = "CPU seconds of one still, lightwell-estimate --body, 1280x960"
    real = "a path-traced frame, simulated 8-bit sensor, as PNG; user and system time of the process, best of five"
    # The body of the frame that measure_marker_speed writes.
    body = pathlib.Path(__file__).parents[2] / "firmware/estimate/marker/bodies/dodecahedron_100mm_grey.textproto"
    say(name)
    seconds = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([programs / "lightwell-estimate", "--calibration", f"{folder}/camera.textproto",
                               "--body", body, f"{folder}/picture.png", "--json", "-"], stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode == 0:
            seconds.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    return at_most(name, 0.3, min(seconds) if len(seconds) == 5 else None, "s", real)


def extremes(items):
    """An estimate from an extreme picture must be refused, flagged or right; one from an easy picture must be right."""
    real = "oracle's pictures, simulated 8-bit sensor; real AprilTag"
    rows, cases = [], {}
    for item in items:
        cases.setdefault(item["extreme"], []).append(item)
    wrong = sum(item["outcome"] == "wrong" for item in items) if items else None
    rows.append(equals("extremes: confidently wrong", 0, wrong, "answers", f"{real}; {len(items)} answers"))
    for name, answers in cases.items():
        counts = {
            outcome: sum(a["outcome"] == outcome for a in answers)
            for outcome in ("refused", "flagged", "right", "wrong")
        }
        outcomes = ", ".join(f"{count} {outcome}" for outcome, count in counts.items() if count)
        worst = max((a["error_deg"] for a in answers if a["outcome"] == "right"), default=None)
        off = "" if worst is None else f"; right ones off by {worst:.2g} deg at most"
        easy = answers[0]["easy"]
        holds = counts["right"] == len(answers) if easy else counts["wrong"] == 0
        rows.append(
            row(f"extremes, {name}", "right" if easy else "refused, flagged or right", outcomes, "", holds, real + off)
        )
    return rows


def with_pareto_front(eval_program, cases, say):
    """The same cases, each with whether it is on their Pareto front and which cases dominate it, by lightwell-eval."""
    with tempfile.NamedTemporaryFile("w", suffix=".jsonl") as file:
        file.writelines(json.dumps(case) + "\n" for case in cases)
        file.flush()
        done = subprocess.run(
            [eval_program, "--marker", file.name, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
    if done.returncode != 0:
        say(f"lightwell-eval failed:\n{done.stderr.strip()}")
        return []
    return json.loads(done.stdout)


# Why the default may be off the front of measure_marker_trade.
ENLARGED = "the default enlarges small tags, which these pictures do not need: fixed decimation is as good and faster"


def trade(cases):
    """Time and accuracy of each option's values, and whether the default is on their Pareto front."""
    real = REAL.format(encoding="sRGB") + "; 640x480, grid, two lamps and near ones; time of one thread's processor"
    shown = lambda value, form: form.format(value) if is_measured(value) else "none"
    rows = []
    for case in cases:
        measures = (f"irradiance RMS {shown(case['rms'] and 100 * case['rms'], '{:.2f} %')}, "
                    f"direction {shown(case['direction_deg'], '{:.2f} deg')} (medians); "
                    f"{100 * case['flagged']:.0f} % flagged, {100 * case['unanswered']:.0f} % unanswered")
        rows.append(reported(f"trade, {case['what']}: ms of a followed frame", case["ms"], "ms", f"{real}; {measures}"))
    default = next((case for case in cases if case["knob"] == "setting"), None)
    name = ("trade: the default is on the measured front of time, irradiance RMS (median, worst) and frames that are "
            "not sure")
    if default is None or not is_measured(default["ms"]) or not is_measured(default["rms"]):
        return rows + [row(name, "yes", "not measured", "", False, real)]
    by = [
        f"{case['what']} ({100 * (case['ms'] / default['ms'] - 1):+.0f} % of time, "
            f"{100 * (case['rms'] / default['rms'] - 1):+.0f} % of RMS)"
        for case in cases
        if case["what"] in default["beaten_by"]
    ]
    figure = row(name, "yes", "beaten by " + ", ".join(by) if by else "yes", "", not by, real)
    return rows + [known_short(figure, ENLARGED) if by else figure]


def measure(programs, say):
    # Timing programs run one at a time; the others run in parallel.
    with tempfile.TemporaryDirectory() as folder:
        times = lines_of([programs / "measure_marker_speed", "--still", folder], say)
        of_still = still(programs, folder, say)
    cases = items_of([programs / "measure_marker_trade"], say)
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        hard = pool.submit(items_of, [programs / "measure_marker_extremes"], say)
        figures = pool.submit(lines_of, [programs / "measure_marker"], say)
        lights = pool.submit(items_of, [programs / "measure_marker_light"], say)
    grid = figures.result()
    return (grid_of_ours(grid) + grid_of_seed(grid) + grid_of_arief(grid) + light(lights.result()) + speed(times) +
            [of_still] + extremes(hard.result()) + trade(with_pareto_front(programs / "lightwell-eval", cases, say)))
