"""Rows of topic reach: the SDK built for other systems (presets windows, musl and manylinux).

The builds and their tests are those of tests/run. A row of a system whose sysroot cannot be had (cmake/sysroot_sdk)
is not measured.
"""
import pathlib
import re
import subprocess
import tempfile

from figure_topics.rows import at_most, equals, reported
from figure_topics.tests import BUILD, ROOT, run_test

# The tests of this machine that write the answers, and the programs that the tests of another system use.
NATIVE_TARGETS = ["make_answers", "lightwelld", "lightwell_cli"]
TARGETS = ["lightwell_c", "c_answers_test", "c_mutants_test", "c_cube_map_test", "codec_test", "print_light"]

SYSTEMS = {"windows": ("Windows", "mingw-w64, Wine 8"), "musl": ("Linux with musl", "zig, musl's loader"),
           "manylinux": ("Linux with glibc 2.28", "zig; this machine's glibc")}
# What a row asks, and the tests that check it.
TESTS = [("answers of 7,560 damaged descriptors and 6,120 damaged planes are those of Linux with glibc",
          ["c_mutants_test"]),
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
    # Configured anew: the sysroot may be another one than that of an earlier build.
    for command in (["cmake/sysroot_sdk", preset], ["cmake", "--fresh", "--preset", preset],
                    ["cmake", "--build", "--preset", preset, "--target", *TARGETS]):
        if not succeeds(*command):
            say("failed: " + " ".join(command))
            return None
    return ROOT / "build" / preset


def library(build_folder):
    """liblightwell of a build."""
    found = [path for path in (build_folder / "lib").glob("*lightwell.*")
             if not path.is_symlink() and path.suffix not in (".a", ".lib")]
    return max(found, key=lambda path: path.stat().st_mtime, default=None)


def stripped_bytes(path):
    """Of a library; None if there is none."""
    tool = "x86_64-w64-mingw32-strip" if path and path.suffix == ".dll" else "strip"
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "library"
        return out.stat().st_size if path and succeeds(tool, "-o", out, path) else None


def own_bytes(build_folder):
    """Code and data of all objects that liblightwell is linked from, but those of other projects: an upper bound,
    because the linker leaves out what is not used."""
    tool = "x86_64-w64-mingw32-size" if build_folder.name == "windows" else "size"
    archives = [path for path in build_folder.glob("*/liblightwell_*.a") if not path.stem.endswith("firmware")]
    objects = [*build_folder.glob("host_sdk/src/c/CMakeFiles/lightwell_c.dir/*.o*")]
    listed = subprocess.run([tool, "--totals", *archives, *objects], capture_output=True, text=True, check=True).stdout
    text, data = listed.splitlines()[-1].split()[:2]
    return int(text) + int(data)


def needed(path):
    """Names of the libraries that a library names as needed."""
    command = ["x86_64-w64-mingw32-objdump", "-p"] if path.suffix == ".dll" else ["readelf", "--wide", "--dynamic"]
    listed = subprocess.run([*command, path], capture_output=True, text=True, check=True).stdout
    return re.findall(r"DLL Name: (\S+)|\(NEEDED\).*\[(.*)\]", listed)


def needed_row(system, path, real):
    return at_most(f"{system}: libraries that liblightwell names as needed", MOST_NEEDED,
                   len(needed(path)) if path else None, "", real)


def size_rows(system, build_folder, real):
    """Of a library with the libraries of other projects inside."""
    path = library(build_folder) if build_folder else None
    return [at_most(f"{system}: bytes of liblightwell itself", LARGEST_BYTES,
                    own_bytes(build_folder) if path else None, "", "size of the project's objects"),
            reported(f"{system}: bytes of the library's file, stripped", stripped_bytes(path), "", real),
            needed_row(system, path, real)]


def glibc_rows(say):
    system = "Linux with glibc, without gRPC"
    folder = BUILD.with_name(BUILD.name + "-without-grpc")
    if not folder.is_dir():
        say("install_consumer_without_grpc, which builds it")
        run_test("install_consumer_without_grpc")
    path = library(folder) if folder.is_dir() else None
    real = "Debian's libraries; built by the test install_consumer_without_grpc"
    return [at_most(f"{system}: bytes of liblightwell, stripped", LARGEST_BYTES, stripped_bytes(path), "", real),
            needed_row(system, path, real)]


def wheel_row(folder, say):
    say("python_wheel_test")
    passed = run_test("python_wheel_test", build=folder)["passed"] if folder else None
    return equals("Python wheel: auditwheel's manylinux_2_28, NumPy alone; answers, damaged messages; 8 lines", 1,
                  passed, "", "preset manylinux, pip, auditwheel, NumPy of PyPI; real lightwelld, simulated camera")


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
        name = f"{system}: a C++ program of {lines_of_example()} lines prints the light, by ws:// and wss://"
        rows.append(equals(name, 1, passed, "", f"{tools}; real lightwelld, simulated camera"))
        rows += size_rows(system, folder, f"{tools}; protobuf, OpenSSL and libwebsockets inside")
    # The folder is now that of manylinux.
    return [*rows, wheel_row(folder, say), *glibc_rows(say)]


def lines_of_example():
    return len((ROOT / "host_sdk/examples/print_light/main.cpp").read_text().splitlines())
