"""Requirements that tests check: run by ctest in the build of tests/run."""
import json
import os
import pathlib
import subprocess
import tempfile
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
PRESET = "dev"
BUILD = ROOT / "build" / PRESET


def run_test(name, chosen=None, build=BUILD):
    """Runs the ctest of that name; `chosen` is a Google Test filter that selects tests of the program.

    Returns a dict. "passed": 1 if it ran and passed (with a filter: at least one test ran and none was skipped), 0 if
    it failed or was skipped, None if there is no such ctest. "ran": the number of Google Tests that ran to their end,
    None for other programs."""
    with tempfile.TemporaryDirectory() as folder:
        report, counts = pathlib.Path(folder) / "junit.xml", pathlib.Path(folder) / "gtest.json"
        environment = os.environ | {"GTEST_OUTPUT": f"json:{counts}"} | ({"GTEST_FILTER": chosen} if chosen else {})
        subprocess.run(["ctest", "--test-dir", build, "-R", f"^{name}$", "--output-junit", report], env=environment,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        cases = list(xml.etree.ElementTree.parse(report).getroot().iter("testcase")) if report.exists() else []
        if not cases:
            return {"passed": None, "ran": None}
        suites = json.loads(counts.read_text())["testsuites"] if counts.exists() else None
    passed = all(case.get("status") == "run" for case in cases)
    if suites is None:
        return {"passed": 1 if passed and not chosen else 0, "ran": None}
    started = [test for suite in suites for test in suite["testsuite"] if test["status"] == "RUN"]
    skipped = [test for test in started if test.get("result") == "SKIPPED"]
    if chosen:
        passed = passed and started and not skipped
    return {"passed": 1 if passed else 0, "ran": len(started) - len(skipped)}
