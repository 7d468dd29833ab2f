"""Results of measure_bound_campaign: kept lines, their sums, and rows of figures (tests/measure/README.md)."""
import json
import math
import pathlib
import time

from figure_topics.programs import rows_of_program
from figure_topics.rows import at_least, at_most, reported

PROGRAM = "measure_bound_campaign"
RESULTS = pathlib.Path(__file__).resolve().parents[1] / "measure/results/bound_campaign.jsonl"
GROUP_FRAMES = 50
GROUPS = 2000
# What is asked of all frames, and of the fresh ones of each run.
FRAMES = GROUPS * GROUP_FRAMES
FRESH_GROUPS, FRESH_GROUP_FRAMES = 100, 20
SHARE_BEYOND, WORST = 1e-3, 1.5
IDEAL, MEDIAN_IDEAL = "rgb_f32", 2
EIGHT_BITS, MEDIAN_EIGHT_BITS = ("rgb8_linear", "rgb8", "nv12", "yuyv", "bayer8"), 2.5
TWELVE_BITS = "bayer12"
BINS_OF_OCTAVE = 8
# Fresh groups of each minute, beyond those that are kept. The time stamps of frames of higher numbers would overflow.
FIRST_FRESH, MINUTES = 10_000, 200_000
GENERATED = ("uniform", "gradient", "checker", "stripes", "windows", "lamps", "room", "dark")
# Divisions of the summary: heading, and the value of a line.
DIVISIONS = (("all", lambda line: "all groups"), ("setting", lambda line: line["setting"]),
             ("interleave", lambda line: line["interleave"]), ("max_bytes", lambda line: line["max_bytes"]),
             ("smoothing", lambda line: line["smoothing"]), ("sensor", lambda line: line["sensor"]),
             ("exposures", lambda line: f"{line['exposures']} {line['exposure']}"),
             ("lens", lambda line: line["lens"]), ("width", lambda line: line["width"]),
             ("probe", lambda line: "turning" if line["turn"] else "at rest"),
             ("scene", lambda line: line["scene"] if line["scene"] in GENERATED else "real"),
             ("code", lambda line: line.get("code", "")))
# Beyond the bound; "(beyond)": of the unread ones; the largest error / bound, the median of bound / error.
COLUMNS = "groups", "frames", "flagged", "unread", "(beyond)", "beyond", "worst e/b", "median b/e"


def kept_lines(path):
    """The results in this file, a group once."""
    if not path.exists():
        return []
    lines = (json.loads(text) for text in path.read_text().splitlines())
    return list({line["group"]: line for line in lines}.values())


class Sums:
    """Frames of some groups: judged are those that are neither flagged nor unread."""

    def __init__(self, lines):
        self.groups = len(lines)
        self.frames = sum(line["frames"] for line in lines)
        self.flagged = sum(line["flagged"] for line in lines)
        self.unread = sum(line["unread"][0] for line in lines)
        self.unread_beyond = sum(line["unread"][1] for line in lines)
        self.beyond = sum(line["beyond"] for line in lines)
        self.groups_beyond = sum(line["beyond"] > 0 for line in lines)
        self.judged = self.frames - self.flagged - self.unread
        # A ratio that is not finite is null.
        worst = [line["worst"][1] for line in lines if "worst" in line]
        self.worst = None if None in worst else max(worst, default=None)
        self.ratios = {}
        for line in lines:
            for k, count in line["ratios"]:
                self.ratios[k] = self.ratios.get(k, 0) + count

    def share_beyond(self):
        return self.beyond / self.judged if self.judged else None

    def median_ratio(self):
        """The median of bound / error, interpolated within its eighth of an octave."""
        rest = sum(self.ratios.values()) / 2
        for k in sorted(self.ratios):
            if rest <= self.ratios[k]:
                return math.exp2((k + rest / self.ratios[k]) / BINS_OF_OCTAVE)
            rest -= self.ratios[k]
        return None


def summary(lines):
    """The table of the divisions, as text."""
    out = [f"{'':24}" + "".join(f"{name:>12}" for name in COLUMNS)]
    for heading, key in DIVISIONS:
        parts = {}
        for line in lines:
            parts.setdefault(key(line), []).append(line)
        out.append(heading)
        for value in sorted(parts):
            sums = Sums(parts[value])
            numbers = (sums.groups, sums.frames, sums.flagged, sums.unread, sums.unread_beyond, sums.beyond)
            ratios = ("-" if ratio is None else f"{ratio:.2f}" for ratio in (sums.worst, sums.median_ratio()))
            out.append(f"  {value!s:22}" + "".join(f"{number!s:>12}" for number in (*numbers, *ratios)))
    return "\n".join(out)


def rows_of_sums(what, lines):
    sums = Sums(lines)
    real = (f"{sums.groups} groups, {sums.frames} frames with noise, {sums.flagged} flagged, {sums.unread} between a "
            "change of a lamp and its being read")
    yield at_most(what + "share of frames beyond the bound", SHARE_BEYOND, sums.share_beyond(), "",
                  f"{real}; {sums.beyond} frames of {sums.groups_beyond} groups")
    yield at_most(what + "error by bound, largest", WORST, sums.worst, "", real)
    yield reported(what + "frames between a change and its being read: beyond the bound", sums.unread_beyond, "",
                   f"{sums.unread} frames")


def median_rows(what, lines, sensors, limit=None):
    """The median of bound / error of these sensors together."""
    sums = Sums([line for line in lines if line["sensor"] in sensors])
    name, real = f"{what}bound by error, median, {', '.join(sensors)}", f"{sums.judged} frames of {sums.groups} groups"
    yield (reported(name, sums.median_ratio(), "", real) if limit is None else
           at_most(name, limit, sums.median_ratio(), "", real))


def rows(programs, say):
    """Rows of the kept results, and of fresh frames."""
    kept = kept_lines(RESULTS)
    yield at_least("bound, kept: frames", FRAMES, Sums(kept).frames, "", f"{RESULTS.name}, by tests/bound_campaign")
    yield from rows_of_sums("bound, kept: ", kept)
    yield from median_rows("bound, kept: ", kept, (IDEAL,), MEDIAN_IDEAL)
    for sensor in EIGHT_BITS:
        yield from median_rows("bound, kept: ", kept, (sensor,), MEDIAN_EIGHT_BITS)
    yield from median_rows("bound, kept: ", kept, (TWELVE_BITS,))
    first = FIRST_FRESH + int(time.time() / 60) % MINUTES * FRESH_GROUPS
    what, lines = f"bound, groups {first} to {first + FRESH_GROUPS - 1}: ", []

    def rows_at_end(line):
        lines.append(line)
        if line["beyond"]:
            yield reported(f"bound, group {line['group']}: frames beyond it", line["beyond"], "",
                           f"{PROGRAM} --group {line['group']}")
        if len(lines) == FRESH_GROUPS:
            yield from rows_of_sums(what, lines)
            # Too few groups of each format for a median of its own.
            yield from median_rows(what, lines, (IDEAL,), MEDIAN_IDEAL)
            yield from median_rows(what, lines, EIGHT_BITS, MEDIAN_EIGHT_BITS)

    yield from rows_of_program([programs / PROGRAM, "--groups", str(first), str(first + FRESH_GROUPS), "--frames",
                                str(FRESH_GROUP_FRAMES)], rows_at_end, say)
