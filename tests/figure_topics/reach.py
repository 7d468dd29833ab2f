"""Topic reach: Lightwell's light in applications, languages and systems that were never changed for it."""
import json
import pathlib
import re
import statistics
import subprocess
import tempfile

from figure_topics import reach_systems
from figure_topics.links import lines_of
from figure_topics.rows import at_most, equals, reported
from figure_topics.skeleton import Probe
from figure_topics.tests import BUILD, run_test

TARGETS = ["lightwelld", "measure_latency"]
# The Debian packages hold all that is installed.
TEST_TARGETS = ["all"]

LAYER = "C program, Debian's OpenXR loader, real daemon over gRPC; the runtime is simulated"
FRAME_MS = 1000 / 90
RATE = 250  # Frames a second of the comparison of links.
# What a row of OpenXR asks, the test program, and the tests that check it.
OPENXR = [
    ("OpenXR: what to_openxr gives, bit for bit: both kinds, spaces, mounting, scale, sessions, cube maps",
     "e2e_openxr_layer_test", "*ToOpenxr:*Total*:*RequestedSpace:*Mounting*:*Scale*:*Sessions*:*CubeMaps*"),
    ("OpenXR: times are honoured, lastUpdatedTime changes with the estimate alone",
     "e2e_openxr_layer_test", "*LastUpdatedTime*:*PastTime*:*BeforeTheHistory*:*ConversionOfTimes*"),
    ("OpenXR: without the extension no call of the runtime changes", "openxr_layer_process_test", "*ChangesNothing*"),
    ("OpenXR: calls of the layer pass Khronos' validation layer", "openxr_layer_process_test", "LayerValidation.*"),
    ("OpenXR: unknown probe, wrong address, wrong token, no answer: each a clear error",
     "e2e_openxr_layer_test", "*UnknownProbe*:*WrongAddress*:*WrongToken*:*DoesNotAnswer*"),
    ("OpenXR: bad arguments, chains, handles, versions of the interface", "openxr_layer_calls_test", "*"),
]
# The same for tests that are programs of Node or Mono.
NODE = [
    ("npm install of the tarball without a registry: 8 lines for Node, a page of 20 lines show the light",
     "e2e_npm_package_test", "real lightwelld, simulated camera; Node and headless Chromium"),
    ("Unity-style C# without a native library prints the light; damaged messages, tokens, TLS, reconnection",
     "e2e_unity_test", "real lightwelld, simulated camera; Mono, Unity's classes as a stub"),
    ("TypeScript in Node: golden answers and damaged messages as in C++", "typescript_test", "Node"),
    ("TypeScript in Chromium: the same tests", "e2e_chromium_answers_test", "headless Chromium"),
    ("C#: golden answers and damaged messages as in C++", "csharp_test", "Mono, liblightwell.so"),
    ("lightwell doctor: each check against folders like the system's, libraries of other versions, certificates",
     "lightwell_doctor_test", "functions of the program"),
    ("lightwell doctor: wrong token, other certificate, no TLS, nothing that listens, no frames, a clock that is off",
     "e2e_doctor_test", "real lightwelld, TLS, Linux time namespace"),
    ("Debian packages: lintian, install, use, upgrade and purge in a private root; each installed file in one package",
     "install_debian_packages", "dpkg, apt and lintian of this machine; amd64"),
    ("AR Foundation sample compiles, and gives Unity the light", "ArFoundation_sample_test",
     "Mono, AR Foundation's classes as a stub"),
    ("Godot sample compiles, and sets light and sky", "Godot_sample_test", "Mono, Godot's classes as a stub"),
    ("Unreal sample compiles, and sets light and sky", "unreal_light_sample_test",
     "GCC without exceptions and RTTI, Unreal's headers as stubs"),
    ("colour temperature, lumens, gain, fade, choice: C's answers are C++'s (Python, C#, TypeScript: rows above)",
     "c_estimate_test", "recordings"),
    ("Managed C# client: golden answers and damaged messages as in C++", "managed_test", "Mono"),
    ("Unity package: manifest, .meta files, each assembly compiles by itself", "unity_package_test", "Mono's mcs"),
]
def measured_properties(names, say):
    """The values that e2e_openxr_layer_test records, as numbers; without those that it did not record."""
    say("e2e_openxr_layer_test, times")
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "properties.json"
        program = BUILD / "tests/e2e/e2e_openxr_layer_test"
        if not program.exists():
            return {}
        subprocess.run([program, "--gtest_filter=*WithinAFrame*:*WithinHalfASecond*", f"--gtest_output=json:{out}"],
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        suites = json.loads(out.read_text())["testsuites"] if out.exists() else []
    tests = [test for suite in suites for test in suite["testsuite"]]
    return {name: float(test[name]) for test in tests for name in names if name in test}


def thousandth(value):
    return None if value is None else value / 1000


def openxr(say):
    rows = []
    for name, program, chosen in OPENXR:
        say(f"{program} {chosen}")
        rows.append(equals(name, 1, run_test(program, chosen)["passed"], "", LAYER))
    found = measured_properties(("publication_to_query_us", "invalid_after_ms", "query_us"), say)
    rows += [at_most("OpenXR: publication to the first query that shows it, median, at 90 frames a second", FRAME_MS,
                     thousandth(found.get("publication_to_query_us")), "ms", LAYER),
             at_most("OpenXR: last VALID estimate after the end of the probe", 500, found.get("invalid_after_ms"), "ms",
                     LAYER + ", killed"),
             reported("OpenXR: time of xrGetLightEstimateANDROID, median", found.get("query_us"), "us", LAYER)]
    return rows


WEBXR = "real lightwelld; headless Chromium, npm's three.js 0.187, device emulated by IWER"
PIXELS = [("lamp switched", "a lamp that is switched"), ("probe turns", "a probe that turns"),
          ("mirror", "the mirror of the environment map"), ("mirror, turned", "that mirror, the probe hung turned"),
          ("the README's page, matt", "the README's page, screenshot, matt ball"),
          ("the README's page, mirror", "the same, mirror")]


def webxr(say):
    """Pixels that e2e_webxr_pixels_test prints, `# NAME: RMS P %`; then its calls."""
    say("e2e_webxr_pixels_test")
    done = subprocess.run(["ctest", "--test-dir", BUILD, "-R", "^e2e_webxr_pixels_test$", "-V"],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    rms = dict(re.findall(r"# (\S[^:#]*): RMS ([\d.]+) %", done.stdout))
    rows = [at_most(f"WebXR: pixels lit through XREstimatedLight against toThree, RMS: {what}", 2,
                    float(rms[name]) if name in rms else None, "%", WEBXR) for name, what in PIXELS]
    say("e2e_webxr_api_test")
    rows.append(equals("WebXR: feature, spaces, formats, privacy; errors: no probe, wrong token, newer wire, misuse",
                       1, run_test("e2e_webxr_api_test")["passed"], "", WEBXR))
    return rows


def node(say):
    rows = []
    for name, test, real in NODE:
        say(test)
        rows.append(equals(name, 1, run_test(test)["passed"], "", real))
    return rows


def latency(programs, say):
    """p99 of five runs of 10,000 frames each, with one client of each link, which receive the same frames."""
    with Probe(programs, "sim:city", "--size", "160x120", "--frame-rate", str(RATE), "--web", "127.0.0.1:0") as probe:
        web = probe.process.stdout.readline().split("listening on ")[1].strip()
        runs = lines_of([programs / "measure_latency", probe.address, web, "--repeats", "5",
                         "--seconds", str(10_000 / RATE)], say)
    grpc = [run["p99"] for run in runs if run["uri"] == probe.address]
    above = [run["p99"] - other for run, other in zip([r for r in runs if r["uri"] == web], grpc)]
    received = min((run["received"] for run in runs), default=0)
    real = f"real lightwelld and SDK, {RATE} frames a second, received in a run at least {received}; gRPC's p99 " \
           f"{statistics.median(grpc):.2f} ms" if runs else None
    return [at_most("WebSocket against gRPC, interleaved, p99 of 10,000 messages, median of five runs: difference", 1,
                    statistics.median(above) if len(above) == 5 else None, "ms", real)]


def measure(programs, say):
    return openxr(say) + webxr(say) + reach_systems.measure(say) + node(say) + latency(programs, say)
