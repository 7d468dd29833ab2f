"""Topic board: what hil/run measures on the emulated arm64 board, every figure a row."""
import json
import pathlib
import subprocess

# hil/run builds what it needs itself: for this machine with the preset dev, for the board with board-aarch64.
TARGETS = ["lightwell_cli"]
ROOT = pathlib.Path(__file__).resolve().parents[2]
REAL = (
    "arm64 Debian kernel, systemd, uvcvideo and network in QEMU (TCG); simulated USB camera outside; real lightwelld, "
    "client on this machine"
)


def measure(_programs, say):
    # Twenty minutes that were spent on this very commit are not spent again.
    done = subprocess.run(
        [ROOT / "hil/run", "--check", "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    if done.returncode == 0:
        say("hil/run: every entry has a good run of this commit, in out/hil.json")
    else:
        # The order of a published run is the same for everybody.
        say("hil/run --seed 1 (twenty minutes)")
        done = subprocess.run([ROOT / "hil/run", "--seed", "1", "--json"], stdout=subprocess.PIPE, text=True)
    if done.returncode not in (0, 1):
        why = (
            "SKIP: this machine cannot run the board"
            if done.returncode == 77
            else f"hil/run ended with {done.returncode}"
        )
        return [{"name": "hil/run", "asked": "a whole run", "measured": why, "unit": "", "holds": False, "real": REAL}]
    tests = json.loads(done.stdout)
    rows = [
        {
            "name": "the whole roster, without building",
            "asked": "<= 1200",
            "measured": sum(test["seconds"] for test in tests),
            "unit": "s",
            "holds": sum(test["seconds"] for test in tests) <= 1200,
            "real": REAL,
        }
    ]
    for test in tests:
        rows += [
            {
                "name": f"{test['test']}: {figure['name']}",
                "asked": figure["asked"] or "reported",
                "measured": figure["measured"],
                "unit": figure["unit"],
                "holds": figure["holds"],
                "real": REAL,
            }
            for figure in test["figures"]
        ]
        if not test["good"]:
            said = (test["skipped"] or test["trouble"] or "a figure does not hold").strip().splitlines()[-1]
            rows.append(
                {
                    "name": test["test"],
                    "asked": "runs to its end, each figure as asked",
                    "measured": said,
                    "unit": "",
                    "holds": False,
                    "real": REAL,
                }
            )
    return rows
