"""Promises that are tests: run by ctest, in the build that tests/run makes."""
import json
import os
import pathlib
import subprocess
import tempfile
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
PRESET = "dev"
BUILD = ROOT / "build" / PRESET


def run_test(name, chosen=None):
    """Runs ctest's test of that name, of a Google Test program the chosen tests alone (a filter of Google Test).

    Returns passed: 1 where it ran and passed, with a filter at least one test of it and none skipped; 0 where it failed
    or was skipped; None where there is no such test. And ran: the tests of a Google Test program that ran to their
    end, None for other programs."""
    with tempfile.TemporaryDirectory() as folder:
        report, counts = pathlib.Path(folder) / "junit.xml", pathlib.Path(folder) / "gtest.json"
        environment = os.environ | {"GTEST_OUTPUT": f"json:{counts}"} | ({"GTEST_FILTER": chosen} if chosen else {})
        subprocess.run(["ctest", "--test-dir", BUILD, "-R", f"^{name}$", "--output-junit", report], env=environment,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        cases = list(xml.etree.ElementTree.parse(report).getroot().iter("testcase")) if report.exists() else []
        if not cases:
            return {"passed": None, "ran": None}
        suites = json.loads(counts.read_text())["testsuites"] if counts.exists() else None
    passed = all(case.get("status") == "run" for case in cases)
    if suites is None:
        return {"passed": 1 if passed and not chosen else 0, "ran": None}
    begun = [test for suite in suites for test in suite["testsuite"] if test["status"] == "RUN"]
    skipped = [test for test in begun if test.get("result") == "SKIPPED"]
    if chosen:
        passed = passed and begun and not skipped
    return {"passed": 1 if passed else 0, "ran": len(begun) - len(skipped)}
