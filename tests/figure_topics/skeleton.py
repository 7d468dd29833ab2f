"""Topic skeleton: the whole pipeline on the desktop, from a real panorama to a lit object."""
import json
import os
import pathlib
import signal
import subprocess
import tempfile
import time

from figure_topics.rows import at_least, at_most, equals, row

TARGETS = ["lightwelld", "lightwell_cli", "lightwell-estimate", "demo_report", "measure_skeleton"]
SCENES = ["city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset"]

ORACLE = "real panorama, simulated ideal camera, double-precision oracle"
ANALYTIC = "closed form and oracle"
PROCESSES = "real daemon, gRPC on loopback, real client process; simulated camera"


class Probe:
    """lightwelld on a free port."""

    def __init__(self, programs, camera, *options):
        self.programs = programs
        self.process = subprocess.Popen(
            [programs / "lightwelld", "--camera", camera, "--listen", "127.0.0.1:0", *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        line = self.process.stdout.readline()  # Printed once clients can connect; empty if the daemon ended.
        if "listening on " not in line:
            raise RuntimeError(f"lightwelld did not start with {camera} {options}")
        self.address = line.split("listening on ")[1].strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(timeout=10)

    def watch(self, seconds, *options):
        """Runs `lightwell watch` for `seconds`; returns its summary, {} if there is none."""
        done = subprocess.run(
            [self.programs / "lightwell", "watch", self.address, "--json", "--seconds", str(seconds), *options],
            stdout=subprocess.PIPE,
            text=True,
        )
        lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
        return next((line for line in reversed(lines) if line.get("kind") == "summary"), {})


def run_measure_skeleton(programs):
    done = subprocess.run([programs / "measure_skeleton"], stdout=subprocess.PIPE, text=True)
    if done.returncode:
        return {}
    return {item["figure"]: item["value"] for item in map(json.loads, done.stdout.splitlines())}


def accuracy(values):
    percent = lambda figure: None if values.get(figure) is None else 100 * values[figure]
    rows = []
    for scene in SCENES:
        rows.append(at_most(f"irradiance error, {scene}", 2, percent(f"irradiance_error.{scene}"), "%", ORACLE))
        rows.append(at_most(f"irradiance error, {scene}, probe turned by 77 deg", 2,
                            percent(f"irradiance_error_turned.{scene}"), "%", ORACLE))
        rows.append(at_least(f"bound over error, {scene}", 1, values.get(f"bound_over_error.{scene}"), "", ORACLE))
        peak = values.get(f"peak_to_mean.{scene}")
        if peak is None or peak > 100:
            rows.append(at_most(f"light direction, {scene} (peak {peak or 0:.0f} times the mean)", 0.5,
                                values.get(f"light_direction_deg.{scene}"), "deg", ORACLE))
    rows.append(equals("band of a constant panorama", 0, values.get("constant.band"), "", ANALYTIC))
    rows.append(equals("lights of a constant panorama", 0, values.get("constant.lights"), "", ANALYTIC))
    names = {"analytic.constant": "irradiance and radiance of a constant sphere, deviation",
             "analytic.directional": "irradiance and radiance of one light at ten directions, deviation",
             "analytic.cosine_lobe": "irradiance of a cosine lobe, radiance on an even sky, deviation",
             "analytic.single_harmonics": "irradiance of each single harmonic, radiance on an even sky, deviation",
             "estimated.single_harmonics": "coefficients estimated from pictures of each single harmonic, deviation"}
    rows += [at_most(name, 1e-5, values.get(figure), "", ANALYTIC) for figure, name in names.items()]
    return rows


def real_time(programs, memory_speed, say):
    """Frame rate and latency, best of five because the machines of tests are noisy; memcpy speed is printed with it."""
    rows = []
    for size in ("640x480", "1280x960"):
        say(f"latency at {size}, five runs")
        best, uncounted = None, 0
        with Probe(programs, "sim:city", "--size", size) as probe:
            for _ in range(5):
                summary = probe.watch(3)
                if not summary:
                    continue
                # Received descriptors plus gaps (missing sequence numbers) must add up to the frames of the run.
                expected = round(30 * summary["seconds"])
                uncounted = max(uncounted, abs(summary["frames"] + summary["gaps"] - expected) - 2)
                if best is None or summary["latency_p99_ms"] < best["latency_p99_ms"]:
                    best = summary
        beside = f"{PROCESSES}; memcpy {memory_speed:.1f} GB/s" if memory_speed else PROCESSES
        best = best or {}
        # A window of three seconds misses part of one frame interval at its ends.
        rate = (best["frames"] + 1) / best["seconds"] if best else None
        rows.append(at_least(f"frame rate, two lenses of {size}", 30, rate, "1/s", beside))
        rows.append(at_most(f"latency p99, delivery to latest(), two lenses of {size}, best of five", 15,
                            best.get("latency_p99_ms"), "ms", beside))
        rows.append(
            at_most(
                f"frames neither seen nor counted as gaps, two lenses of {size}", 0, max(0, uncounted), "frames", beside
            )
        )
    return rows


def bound_over_a_run(programs, say):
    """Compares the error bound with the true error of each frame, in rotating scenes whose lamps are switched."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for scene in SCENES:
            say(f"error bound in a rotating scene: {scene}")
            camera, recording = f"sim:{scene}?yaw_rate=30deg/s&lamp_switch=1s", pathlib.Path(folder) / f"{scene}.lwr"
            with Probe(programs, camera) as probe:
                probe.watch(4, "--record", str(recording))
            done = subprocess.run([programs / "demo_report", "--recording", recording, "--camera", camera, "--json"],
                                  stdout=subprocess.PIPE, text=True)
            summary = json.loads(done.stdout) if done.stdout.startswith("{") else {}
            frames = summary.get("frames", 0)
            held = 100 * summary["held"] / frames if frames else None
            flagged = 100 * summary["flagged"] / frames if frames else None
            rows.append(
                at_least(
                    f"bound holds, {scene}, turning 30 deg/s, lamps switching ({frames} frames)",
                    99,
                    held,
                    "%",
                    PROCESSES,
                )
            )
            rows.append(at_most(f"flagged, {scene}, turning 30 deg/s, lamps switching", 10, flagged, "%", PROCESSES))
    return rows


def misbehaving_clients(programs, say):
    say("clients that are killed and that stall")
    with Probe(programs, "sim:city") as probe:
        watch = [programs / "lightwell", "watch", probe.address]
        stalled = subprocess.Popen(watch, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        vanished = subprocess.Popen(watch, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(1)
        stalled.send_signal(signal.SIGSTOP)
        vanished.kill()
        vanished.wait()
        summary = probe.watch(4)
        stalled.kill()
        stalled.wait()
    return [
        equals(
            "gaps of a client beside one that stalls and one that vanished", 0, summary.get("gaps"), "frames", PROCESSES
        )
    ]


def bad_input(programs, say):
    """Each program must exit with a status other than 0 and a message that names the defect."""
    say("bad input")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        city = pathlib.Path(os.environ["LIGHTWELL_PANORAMA_DIR"]) / "city.exr"
        (folder / "truncated.exr").write_bytes(city.read_bytes()[:100000])
        (folder / "config.textproto").write_text('camera {\n  uri: "sim:city"\n  frame_rat: 30\n}\n')
        (folder / "rig.textproto").write_text(
            "lens { width: 640 height: 480 max_angle_deg: 95 kannala_brandt { fx: 0 fy: 0 } }\n"
        )
        daemon, estimate = str(programs / "lightwelld"), str(programs / "lightwell-estimate")
        with Probe(programs, "sim:city", "--size", "64x48") as running:
            cases = {
                "missing panorama": ([daemon, "--camera", f"sim:{folder}/none.exr"], "none.exr"),
                "truncated EXR": ([estimate, "--equirect", f"{folder}/truncated.exr"], "truncated.exr"),
                "unknown configuration field": (
                    [daemon, "--config", f"{folder}/config.textproto"],
                    "config.textproto:3:",
                ),
                "its nearest name": ([daemon, "--config", f"{folder}/config.textproto"], "frame_rate"),
                "impossible calibration": ([estimate, "--calibration", f"{folder}/rig.textproto", str(city)], "fx"),
                "port in use": (
                    [
                        daemon,
                        "--camera",
                        "sim:city",
                        "--size",
                        "64x48",
                        "--listen",
                        running.address.removeprefix("grpc://"),
                    ],
                    "in use",
                ),
            }
            for what, (command, named) in cases.items():
                try:
                    done = subprocess.run(
                        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60
                    )
                    clear = done.returncode > 0 and named in done.stderr
                    message = done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "nothing"
                except subprocess.TimeoutExpired:
                    clear, message = False, "did not end"
                rows.append(
                    row(f"bad input: {what}", f"exit status not 0, names {named}", message, "", clear, "real programs")
                )
    return rows


def measure(programs, say):
    say("accuracy on the eight panoramas")
    values = run_measure_skeleton(programs)
    rows = accuracy(values)
    rows += real_time(programs, values.get("memcpy_gb_per_s"), say)
    rows += bound_over_a_run(programs, say)
    rows += misbehaving_clients(programs, say)
    rows += bad_input(programs, say)
    return rows
