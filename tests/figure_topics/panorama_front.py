"""Topic panorama, trade-off: whether the named settings are on the Pareto front that lightwell-eval measures."""
import json
import subprocess
import tempfile
import time

from figure_topics.rows import equals, reported

REAL = "8 real panoramas, simulated pair; front of time, bytes, error and bound"


def sweep(folder, say):
    """Runs `lightwell-eval --pareto`; returns its rows, [] if it fails."""
    with tempfile.TemporaryDirectory() as out:
        say("lightwell-eval --pareto")
        start = time.monotonic()
        command = [folder / "lightwell-eval", "--pareto", "--json", "--out", out]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
        say(f"lightwell-eval --pareto: {time.monotonic() - start:.0f} s, status {done.returncode}")
    return [] if done.returncode else json.loads(done.stdout)["rows"]


def front(folder, say, unit):
    """The rows of the named settings. `unit`: name of this machine's vector unit."""
    named = [item for item in sweep(folder, say) if item["named"]]
    # Every setting with three exposures of an 8-bit sensor, and all but fastest at three sizes with the ideal one.
    rows = [equals("named settings that were measured", 13, len(named), "rows", REAL)]
    for item in named:
        name = f"{item['what']}, pair of {item['width']} pixels wide"
        rows.append(equals(f"on the measured front: {name}", 1, int(item["on_front"]), "", REAL))
        rows.append(reported(f"time by memcpy's: {name}, {unit}", item["memcpy_ratio"], "x", REAL))
        rows.append(reported(f"median error: {name}", 100 * item["rms"], "%", REAL))
        rows.append(reported(f"median bytes: {name}", item["bytes"], "B", REAL))
    return rows
