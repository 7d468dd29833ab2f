"""Programs built for aarch64 as for release, and their instructions counted under qemu-user."""
import json
import shutil
import subprocess

from figure_topics.tests import ROOT

# As in the preset bench. g++ 12 gives false warnings at -O3 (-Wrestrict), which are errors in the board's preset.
OPTIMISED = ["-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O3 -DNDEBUG", "-DLIGHTWELL_WERROR=OFF"]


def build(targets, say):
    """Builds targets in a separate folder, because the preset's build is for tests.

    Returns the folder of the programs and the sysroot; None, None without a sysroot, qemu-aarch64 or a good build."""
    folder = ROOT / "build/figures-aarch64"
    sysroot = subprocess.run([ROOT / "cmake/sysroot_aarch64"], stdout=subprocess.PIPE, text=True)
    if sysroot.returncode or not shutil.which("qemu-aarch64"):
        say("aarch64: no sysroot or no qemu-aarch64: not measured")
        return None, None
    say("building for aarch64 (Release)")
    for command in (["cmake", "--fresh", "--preset", "board-aarch64", "-B", folder, *OPTIMISED],
                    ["cmake", "--build", folder, "--target", *targets]):
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode:
            say(done.stdout[-4000:] + "\naarch64: the build failed: not measured")
            return None, None
    return folder / "bin", sysroot.stdout.strip()


def instructions(command, work):
    """Instructions per unit of work of a program whose arguments have {} for the units; None if not counted.
    `work`: units of the two counted runs."""
    done = subprocess.run([ROOT / "tests/measure/count_instructions", "--json", "--work", *map(str, work), *command],
                          stdout=subprocess.PIPE, text=True)
    return None if done.returncode else json.loads(done.stdout)["per_unit"]
