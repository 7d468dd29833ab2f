"""Topic structure: tests of the source's structure, its size, and how long a developer waits for builds and tests."""
import json
import os
import pathlib
import subprocess
import tempfile
import time

from figure_topics.rows import at_least, at_most, equals, reported
from figure_topics.tests import BUILD, PRESET, ROOT, run_test
from structure.include_direction import HERE, includes, matches, read_rules
from structure.line_counts import FOLDERS, LANGUAGES, git
from structure.line_counts import measure as count_lines

# The tests of installed SDKs need everything that is installed.
TEST_TARGETS = ["all"]

# The tests that the label `structure` has at least.
MUST_EXIST = {"code_layout", "code_layout_self_test", "glossary", "glossary_self_test", "header_self_containment",
              "header_self_containment_self_test", "include_direction", "include_direction_self_test", "packages",
              "skeleton_camera_test", "skeleton_estimator_test", "skeleton_link_test", "skeleton_pixel_format_test",
              "wire_tables", "wire_tables_self_test"}

# The first commit that is laid out by .clang-format. Its parent, the same code in another layout, has the 73,600 lines
# (empty ones counted) of which the requirement speaks.
LAID_OUT = "a74b1ef"
# The last commit before names and folders changed.
BEFORE = "68b09ad"
LEAST_SHARE_FEWER = 8
MOST_LINES = 450

# The estimator; the source that is changed; the tests that are run; the limit in seconds (None: reported only). The
# marker's extremes and panorama_test compute many scenes and take a minute or more.
MARKER_SOURCE, PANORAMA_SOURCE = "firmware/estimate/marker/light_fit.cpp", "firmware/estimate/panorama/light_finder.cpp"
CHANGES = [
    ("marker", MARKER_SOURCE, ("marker_light_test", "marker_shadow_test", "max_entropy_radiance_test"), 60),
    ("marker", MARKER_SOURCE, ("marker_extremes_test",), None),
    ("panorama", PANORAMA_SOURCE, ("panorama_test", "kernels_test"), None),
]

LAST_STAGE = "test on arm64, emulated"
# Shares of the objects that ccache supplied: below the first a run counts as without a cache, above the second as with.
COLD, WARM = 0.05, 0.9


def structure_tests(say):
    listed = subprocess.run(["ctest", "--test-dir", BUILD, "-L", "^structure$", "--show-only=json-v1"],
                            stdout=subprocess.PIPE, text=True, check=True)
    names = {test["name"] for test in json.loads(listed.stdout)["tests"]}
    rows = []
    for name in sorted(MUST_EXIST | names):
        say(name)
        rows.append(equals(f"passes: {name}", 1, run_test(name)["passed"] if name in names else None, "",
                           f"ctest of preset {PRESET}"))
    return rows


def lines_of(commit):
    """Lines of code and comments by language, and of all languages ("all"); {} if git does not have the commit."""
    lines = {}
    try:
        counts = count_lines(commit)
    except subprocess.CalledProcessError:
        return lines
    for (language, _), count in counts.items():
        for key in language, "all":
            lines[key] = lines.get(key, 0) + count["code"] + count["comments"]
    return lines


def share_fewer(now, then):
    return 100 * (1 - now["all"] / then["all"]) if now and then else None


def line_counts(say):
    say(f"line counts of {LAID_OUT}, {BEFORE} and HEAD")
    laid_out, before, now = lines_of(LAID_OUT), lines_of(BEFORE), lines_of("HEAD")
    real = "HEAD, git; code and comments, laid out by .clang-format"
    rows = [reported(f"product code lines, {language} ({before.get(language, 0)} at {BEFORE})", now.get(language), "",
                     real) for language in sorted({*before, *now})]
    rows.append(at_least(f"share fewer than the {laid_out.get('all')} lines of {LAID_OUT}", LEAST_SHARE_FEWER,
                         share_fewer(now, laid_out), "%", real))
    rows.append(reported(f"share fewer than at {BEFORE}", share_fewer(now, before), "%", real))
    return rows


def sources(*folders):
    names = git("ls-files", *folders).decode().splitlines()
    return [ROOT / name for name in names if pathlib.Path(name).suffix in LANGUAGES and (ROOT / name).is_file()]


def largest_file():
    length, path = max((path.read_text().count("\n"), path) for path in sources(*FOLDERS, "tests"))
    return at_most(f"lines of the largest file, {path.relative_to(ROOT)}", MOST_LINES, length, "",
                   "C++, Python, TypeScript and C#, tests included")


def owners():
    """Rows of the third-party headers under [owners] in arrows.txt, and of the files that include one of them."""
    patterns = {pattern for rule in read_rules(HERE / "arrows.txt") if rule.section == "owners"
                for pattern in rule.left if not pattern.startswith("lightwell/")}
    owning = [path for path in sources("proto", "firmware", "host_sdk") if path.suffix in (".cpp", ".hpp", ".h")
              and any(matches(name, patterns) for _, _, name in includes(path.read_text()))]
    headers = [path for path in owning if path.suffix != ".cpp"]
    real = "include lines; arrows.txt"
    return [reported("patterns of headers of heavy libraries that have owners", len(patterns), "", real),
            reported("product files that include a heavy library", len(owning), "", real),
            reported("headers among these", len(headers), "", real)]


def loaded_libraries(program):
    done = subprocess.run(["ldd", program], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return done.stdout.count("=>") if done.returncode == 0 else None


def without_grpc(say):
    """A host that reads probes by USB, MQTT or from recordings needs no gRPC."""
    test = "install_consumer_without_grpc"
    say(test)
    rows = [equals(f"an SDK without gRPC is built and installed, and none of its programs loads gRPC: {test}", 1,
                   run_test(test)["passed"], "", "the installed SDK, ldd")]
    for what, folder in ("with", BUILD), ("without", BUILD.with_name(BUILD.name + "-without-grpc")):
        rows.append(reported(f"shared libraries that the command line {what} gRPC loads",
                             loaded_libraries(folder / "bin/lightwell"), "", "ldd"))
    return rows


def changes(say):
    """Times from a changed line to the answer of tests: ninja and ctest in a clone of HEAD, whose other objects are
    compiled before (from the cache). What the change compiles and links is neither read from the cache nor stored."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        clone = pathlib.Path(folder)
        # The same place in the clone as in the tree, so that ccache finds the tree's objects.
        build = clone / "build" / PRESET
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": clone}

        def succeeds(*command, **options):
            return subprocess.run(command, **quiet, **options).returncode == 0

        subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True)
        panoramas = os.environ["LIGHTWELL_PANORAMA_DIR"]
        configured = succeeds("cmake", "--preset", PRESET, f"-DLIGHTWELL_PANORAMA_DIR={panoramas}")
        for estimator, source, tests, limit in CHANGES:
            say(f"a changed line of {source}: {' '.join(tests)}")
            seconds = None
            if configured and (clone / source).is_file() and succeeds("ninja", "-C", build, *tests):
                with (clone / source).open("a") as file:
                    file.write("// A changed line.\n")
                begin = time.monotonic()
                if (succeeds("ninja", "-C", build, *tests, env=os.environ | {"CCACHE_DISABLE": "1"})
                        and succeeds("ctest", "--preset", PRESET, "--no-tests=error", "-R", f"^({'|'.join(tests)})$")):
                    seconds = time.monotonic() - begin
            name = f"from a changed line of the {estimator} estimator to the answer of {', '.join(tests)}"
            real = f"{source}, clone of HEAD, {os.cpu_count()} processors, change compiled without cache"
            rows.append(reported(name, seconds, "s", real) if limit is None else
                        at_most(name, limit, seconds, "s", real))
    return rows


def recorded_runs(path, commit):
    """The green runs of tests/run --without slow (mutations) at this commit, in a clean clone."""
    lines = path.read_text().splitlines() if path.exists() else []
    return [run for run in map(json.loads, lines) if run["commit"] == commit and run["preset"] == PRESET
            and run["clean"] and run["tests"] == "without slow"]


def clone_to_green(runs):
    """Rows of the last recorded run with and without a cache."""
    def minutes(warm, whole):
        for run in reversed(runs):
            share, stages = run["hits"] / max(1, run["hits"] + run["misses"]), run["stages"]
            if (share > WARM if warm else share < COLD) and (LAST_STAGE in stages) == whole:
                return sum(stages.values()) / 60, f"tests/run, {100 * share:.0f} % of objects cached"
        return None, "tests/run at this commit, not recorded"

    native = "from a clean clone to green native tests (tests/run --no-arm64 --without slow)"
    rows = []
    for name, limit, warm, whole in (
            (f"{native}, without cache", 35, False, False), (f"{native}, with cache", 12, True, False),
            ("from a clean clone to the end of tests/run --without slow, with cache", 45, True, True)):
        measured, real = minutes(warm, whole)
        rows.append(at_most(name, limit, measured, "min", real))
    return rows


def measure(_, say):
    times = pathlib.Path(os.environ.get("LIGHTWELL_TIMES", ROOT / "build/times.jsonl"))
    commit = git("rev-parse", "HEAD").decode().strip()
    return (structure_tests(say) + line_counts(say) + [largest_file()] + owners() + without_grpc(say) + changes(say)
            + clone_to_green(recorded_runs(times, commit)))
