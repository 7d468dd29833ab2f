"""Rows of topic reach: the SDK built for other systems (presets windows and musl).

The builds and their tests are those of tests/run. A row of a system whose sysroot cannot be had (cmake/sysroot_sdk) is not
measured.
"""
import pathlib
import re
import subprocess
import tempfile

from figure_topics.rows import at_most, equals
from figure_topics.tests import BUILD, ROOT, run_test

# The tests of this machine that write the answers, and the programs that the tests of another system use.
NATIVE_TARGETS = ["make_answers", "lightwelld", "lightwell_cli"]
TARGETS = ["lightwell_c", "c_answers_test", "c_mutants_test", "c_cube_map_test", "c_plane_test", "codec_test", "print_light"]

SYSTEMS = {"windows": ("Windows", "mingw-w64, Wine 8"), "musl": ("Linux with musl", "zig, musl's loader")}
# What a row asks, and the tests that check it.
TESTS = [("answers of 7,560 damaged descriptors and 6,120 damaged planes are those of Linux with glibc", ["c_mutants_test"]),
         ("answers to golden vectors and scenes are those of Linux with glibc, rounded to float",
          ["c_answers_test", "c_cube_map_test"]),
         ("golden vectors are encoded byte for byte", ["codec_test"])]
LARGEST_BYTES = 3_000_000
MOST_NEEDED = 12


def succeeds(*command):
    return subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0


def build(preset, say):
    """The folder of the build; None if it cannot be made."""
    say(f"building preset {preset}")
    if (succeeds("cmake/sysroot_sdk", preset) and succeeds("cmake", "--preset", preset)
            and succeeds("cmake", "--build", "--preset", preset, "--target", *TARGETS)):
        return ROOT / "build" / preset
    return None


def library(build_folder):
    """liblightwell of a build."""
    found = [path for path in (build_folder / "lib").glob("*lightwell.*")
             if not path.is_symlink() and path.suffix not in (".a", ".lib")]
    return max(found, key=lambda path: path.stat().st_mtime, default=None)


def stripped_bytes(path):
    tool = "x86_64-w64-mingw32-strip" if path.suffix == ".dll" else "strip"
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "library"
        return out.stat().st_size if succeeds(tool, "-o", out, path) else None


def needed(path):
    """Names of the libraries that a library names as needed."""
    command = ["x86_64-w64-mingw32-objdump", "-p"] if path.suffix == ".dll" else ["readelf", "--wide", "--dynamic"]
    listed = subprocess.run([*command, path], capture_output=True, text=True, check=True).stdout
    return re.findall(r"DLL Name: (\S+)|\(NEEDED\).*\[(.*)\]", listed)


def size_rows(system, build_folder, real):
    path = library(build_folder) if build_folder else None
    return [at_most(f"{system}: bytes of liblightwell, stripped", LARGEST_BYTES, stripped_bytes(path) if path else None, "",
                    real),
            at_most(f"{system}: libraries that liblightwell names as needed", MOST_NEEDED, len(needed(path)) if path else None,
                    "", real)]


def measure(say):
    native = succeeds("cmake", "--build", "--preset", "dev", "--target", *NATIVE_TARGETS)
    native = native and run_test("host_sdk_answers")["passed"] == 1
    rows = []
    for preset, (system, tools) in SYSTEMS.items():
        folder = build(preset, say) if native else None
        for name, tests in TESTS:
            say(f"{preset}: {' '.join(tests)}")
            passed = [run_test(test, build=folder)["passed"] if folder else None for test in tests]
            rows.append(equals(f"{system}: {name}", 1, None if None in passed else min(passed), "", tools))
        say(f"{preset}: print_light_test")
        passed = run_test("print_light_test", build=folder)["passed"] if folder else None
        rows.append(equals(f"{system}: a C++ program of {lines_of_example()} lines prints the light, by ws:// and wss://", 1,
                           passed, "", f"{tools}; real lightwelld, simulated camera"))
        rows += size_rows(system, folder, f"{tools}; protobuf, OpenSSL and libwebsockets inside")
    without_grpc = BUILD.with_name(BUILD.name + "-without-grpc")
    return rows + size_rows("Linux with glibc, without gRPC", without_grpc if library(without_grpc) else None,
                            "Debian's libraries; built by the test install_consumer_without_grpc")


def lines_of_example():
    return len((ROOT / "host_sdk/examples/print_light/main.cpp").read_text().splitlines())
