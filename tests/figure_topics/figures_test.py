#!/usr/bin/env python3
"""The table and the exit status of tests/figures for rows that hold, fall short, and are known to fall short; lines
that measuring programs print; which recorded runs of tests/run the topic structure reports."""

import contextlib
import importlib.machinery
import importlib.util
import io
import json
import pathlib
import sys
import tempfile
import types
import unittest
from unittest import mock

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.insert(0, str(TESTS))
from figure_topics import bound_campaign, light_field_objects, light_field_relight, structure, viewer  # noqa: E402
from figure_topics.marker import lines_of  # noqa: E402
from figure_topics.programs import rows_of_program, side_by_side  # noqa: E402
from figure_topics.rows import at_most, known_short  # noqa: E402

LOADER = importlib.machinery.SourceFileLoader("figures", str(TESTS / "figures"))
figures = importlib.util.module_from_spec(importlib.util.spec_from_loader("figures", LOADER))
LOADER.exec_module(figures)

HOLDS, FALLS_SHORT = at_most("quick", 2, 1.0, "x", ""), at_most("slow", 2, 3.0, "x", "")
NOT_MEASURED = at_most("lost", 2, None, "x", "")
KNOWN = known_short(FALLS_SHORT, "until a better day")


def run_topic(topic, *arguments):
    """Runs tests/figures; returns the exit status and the text printed."""
    printed = io.StringIO()
    with mock.patch.object(figures, "build"), mock.patch.object(sys, "argv", ["figures", "panorama", *arguments]), \
            mock.patch.object(figures.importlib, "import_module", return_value=topic), \
            contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        try:
            return figures.main(), printed.getvalue()
        except (SystemExit, OSError) as error:
            return error, printed.getvalue()


def run(*rows):
    """The same for a topic with the given rows."""
    return run_topic(types.SimpleNamespace(measure=lambda folder, say: list(rows)))


class Relighting(unittest.TestCase):
    def verdict(self, scene, inputs, corrected):
        line = {"part": "accuracy", "scene": scene, "inputs": inputs, "lit_from": "one projector", "rmse_direct": 0.02,
                "rmse_corrected": corrected, "rmse_one_bounce": 0.01, "dark_direct": 2, "dark_corrected": 1,
                "dark_share": 0.5}
        return next(figures.verdict(r) for r in light_field_relight.rows_of(line) if r["asked"] == ">= 2")

    def test_reasons_of_rows_that_fall_short(self):
        self.assertEqual(self.verdict("blinds, at a basis light", "mesh", 0.009), "yes")
        self.assertEqual(self.verdict("blinds, at a basis light", "mesh", 0.011), "NO")
        self.assertEqual(self.verdict("blinds, between basis lights", "mesh", 0.011), "known short")
        self.assertEqual(self.verdict("blinds, at a basis light", "exact", 0.011), "known short")


class BoundCampaign(unittest.TestCase):
    def line(self, group, **values):
        return {"group": group, "sensor": "nv12", "frames": 50, "flagged": 0, "unread": [0, 0], "beyond": 0,
                "worst": [3, 0.5, 1, 2], "ratios": [[8, 50]], **values}

    def test_rows_judge_frames_that_are_read_and_not_flagged(self):
        lines = [self.line(0, flagged=10, unread=[20, 5], ratios=[[8, 20]]),
                 self.line(1, beyond=1, worst=[4, 1.6, 8, 5])]
        rows = {r["name"]: r for r in bound_campaign.rows_of_sums("", lines)}
        self.assertAlmostEqual(rows["share of frames beyond the bound"]["measured"], 1 / 70)
        self.assertEqual(rows["error by bound, largest"]["measured"], 1.6)
        self.assertFalse(rows["error by bound, largest"]["holds"])
        median, = bound_campaign.median_rows("", lines, ("nv12", "yuyv"), 2.5)
        self.assertAlmostEqual(median["measured"], 2 ** (8.5 / 8))

    def test_an_error_without_a_finite_ratio_does_not_hold(self):
        rows = {r["name"]: r for r in bound_campaign.rows_of_sums("", [self.line(0, worst=[0, None, None, 1])])}
        self.assertFalse(rows["error by bound, largest"]["holds"])

    def test_a_group_counts_once_and_a_partial_line_is_measured_again(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "lines.jsonl"
            whole = json.dumps(self.line(0)) + "\n"
            path.write_text(whole + whole + whole[:40])
            command = importlib.machinery.SourceFileLoader("command", str(TESTS / "bound_campaign"))
            campaign = importlib.util.module_from_spec(importlib.util.spec_from_loader("command", command))
            command.exec_module(campaign)
            campaign.drop_partial_line(path)
            self.assertEqual(len(bound_campaign.kept_lines(path)), 1)
            self.assertEqual(campaign.chunks([1, 2, 4]), [[1, 3], [4, 5]])


class ImageObjects(unittest.TestCase):
    def point(self, codec, setting, size, db):
        return {"codec": codec, "setting": setting, "bytes_per_view": size, "db": db, "views": 8,
                "raw_ratio": 12e6 / size, "decode_ms": 1, "encode_ms": 1}

    def rows(self, size, jpeg):
        points = [self.point("lightwell", "default", size, 39), self.point("jpeg 4:4:4", "90", jpeg / 2, 38),
                  self.point("jpeg 4:4:4", "94", jpeg * 2, 40)]
        return {r["name"].removeprefix("default steps: "): r for r in light_field_objects.rate_rows(points)}

    def test_a_codec_is_compared_at_equal_quality(self):
        ratio = self.rows(2e5, 7e5)["JPEG of equal PSNR relative to it"]
        self.assertAlmostEqual(ratio["measured"], 3.5)
        self.assertTrue(ratio["holds"])
        self.assertFalse(self.rows(2e5, 5.9e5)["JPEG of equal PSNR relative to it"]["holds"])
        self.assertFalse(self.rows(4.1e5, 2e6)["raw pictures of 8 bits relative to it"]["holds"])

    def test_without_a_point_of_equal_quality_nothing_is_measured(self):
        self.assertIsNone(light_field_objects.bytes_at([self.point("jpeg", "1", 1, 30)], 39))
        self.assertFalse(any(r["holds"] for r in light_field_objects.rate_rows([])))


class Viewer(unittest.TestCase):
    def lines(self, error):
        return [{"distance_m": (1.0, 3.0, 60.0)[i % 3], "e": error, "a": error} for i in range(viewer.TRIALS)]

    def rows(self, lines, place="top"):
        return viewer.direction_rows(lines, place, "light", ("e", "a"), "")

    def test_directions_are_limited_at_the_object_alone(self):
        self.assertTrue(all(r["holds"] for r in self.rows(self.lines(0.29))))
        self.assertFalse(any(r["holds"] for r in self.rows(self.lines(0.31))))
        self.assertTrue(all(r["asked"] == "reported" for r in self.rows(self.lines(9.0), "away")))

    def test_a_trial_that_lacks_or_shows_no_shadow_does_not_hold(self):
        self.assertFalse(self.rows(self.lines(0.1)[1:])[0]["holds"])
        lines = self.lines(0.1)
        lines[4]["e"] = None
        self.assertFalse(self.rows(lines)[0]["holds"])

    def test_latency_is_read_from_the_table(self):
        table = "noise\n| client | descriptors | p50, ms | p99, ms | clock uncertainty, ms |\n| --- | --- | --- |\n" \
                "| C++ SDK, gRPC | 584 | 1.62 | 25.45 | 0.31 |\n"
        self.assertEqual([r["measured"] for r in viewer.latency_rows(table)], [1.62, 25.45])
        self.assertFalse(viewer.latency_rows("failed")[0]["holds"])


class Figures(unittest.TestCase):
    def test_a_row_that_falls_short_fails_the_topic(self):
        self.assertEqual(run(HOLDS)[0], 0)
        self.assertEqual(run(HOLDS, FALLS_SHORT)[0], 1)
        self.assertEqual(run()[0], 1)

    def test_a_row_known_to_fall_short_is_named_with_its_reason_and_does_not_hold(self):
        status, printed = run(HOLDS, KNOWN)
        self.assertEqual(status, 0)
        self.assertIn("known short  slow", printed)
        self.assertIn("until a better day", printed)
        self.assertIn("1 of 2 figures hold", printed)
        self.assertFalse(KNOWN["holds"])

    def test_a_known_short_row_excuses_no_other_row(self):
        self.assertEqual(run(HOLDS, KNOWN, FALLS_SHORT)[0], 1)
        self.assertEqual(run(KNOWN)[0], 1)

    def test_a_row_that_was_not_measured_is_not_excused(self):
        self.assertEqual(run(HOLDS, known_short(NOT_MEASURED, "until a better day"))[0], 1)

    def test_a_marked_row_that_holds_asks_to_remove_its_mark(self):
        status, printed = run(known_short(HOLDS, "until a better day"))
        self.assertEqual(status, 0)
        self.assertIn("yes, unmark  quick", printed)
        self.assertIn("remove their marks", printed)


class PrintedAsMeasured(unittest.TestCase):
    def printed_before(self, error, *arguments):
        def measure(folder, say):
            yield HOLDS
            yield FALLS_SHORT
            raise error

        return run_topic(types.SimpleNamespace(measure=measure), *arguments)[1]

    def test_rows_before_an_error_stay(self):
        printed = self.printed_before(OSError())
        self.assertIn("yes          quick", printed)
        self.assertIn("1 of 2 figures hold", printed)

    def test_json_is_a_whole_list_after_an_error_too(self):
        self.assertEqual(json.loads(self.printed_before(OSError(), "--json")), [HOLDS, FALLS_SHORT])

    def test_json_of_no_rows_is_an_empty_list(self):
        topic = types.SimpleNamespace(measure=lambda folder, say: [])
        self.assertEqual(json.loads(run_topic(topic, "--json")[1]), [])

    def test_a_row_is_printed_before_the_next_one_is_measured(self):
        printed = io.StringIO()
        seen = []

        def measure(folder, say):
            yield HOLDS
            seen.append(printed.getvalue())

        with mock.patch.object(figures, "build"), mock.patch.object(sys, "argv", ["figures", "panorama"]), \
                mock.patch.object(figures.importlib, "import_module",
                                  return_value=types.SimpleNamespace(measure=measure)), \
                contextlib.redirect_stdout(printed):
            figures.main()
        self.assertIn("quick", seen[0])


class Parts(unittest.TestCase):
    TOPIC = types.SimpleNamespace(PARTS=("speed", "light"), measure=lambda folder, say, only=("speed", "light"): [
        at_most(part, 2, 1.0, "x", "") for part in only])

    def test_only_the_chosen_part_is_measured(self):
        printed = run_topic(self.TOPIC, "--only", "light")[1]
        self.assertIn("light", printed)
        self.assertNotIn("speed", printed)
        self.assertIn("2 of 2", run_topic(self.TOPIC)[1])

    def test_an_unknown_part_is_refused_with_the_known_ones(self):
        status, printed = run_topic(self.TOPIC, "--only", "lihgt")
        self.assertEqual(status.code, 2)
        self.assertIn("speed, light", printed)

    def test_a_topic_without_parts_refuses(self):
        status, printed = run_topic(types.SimpleNamespace(measure=lambda folder, say: [HOLDS]), "--only", "light")
        self.assertEqual(status.code, 2)
        self.assertIn("has no parts", printed)


class ProgramsThatReport(unittest.TestCase):
    @staticmethod
    def program(text, name="light"):
        return rows_of_program([sys.executable, "-c", text], lambda line: [at_most(name, 2, line["x"], "", "")],
                               lambda text: None)

    def test_rows_of_a_program_that_fails_stay_and_a_row_says_so(self):
        rows = list(self.program("print('{\"x\": 1}'); exit(3)"))
        self.assertEqual([row["holds"] for row in rows], [True, False])
        self.assertIn("exit status 3", rows[1]["measured"])

    def test_a_program_without_figures_does_not_hold(self):
        self.assertEqual([row["holds"] for row in self.program("pass")], [False])

    def test_programs_side_by_side_report_all_their_rows(self):
        line = "print('{\"x\": 1}')"
        rows = list(side_by_side(self.program(line, name) for name in ("a", "b", "c", "d", "e")))
        self.assertEqual(sorted(row["name"] for row in rows), ["a", "b", "c", "d", "e"])

    def test_an_error_of_one_of_them_is_not_lost(self):
        with self.assertRaises(KeyError):
            list(side_by_side([self.program("print('{}')")]))


class PrintedLines(unittest.TestCase):
    LINES = '{"picture": "dev/0003"}\n{"figure": "dev.answered", "value": 99}'

    def test_lines_without_a_figure_are_skipped(self):
        printed = lines_of([sys.executable, "-c", f"print({self.LINES!r})"], lambda text: None)
        self.assertEqual(printed, {"dev.answered": {"figure": "dev.answered", "value": 99}})

    def test_a_failed_program_has_no_figures(self):
        self.assertEqual(lines_of([sys.executable, "-c", f"print({self.LINES!r}); exit(1)"], lambda text: None), {})


class RecordedRuns(unittest.TestCase):
    NATIVE = {"packages": 1, "panoramas": 1, "configure (dev)": 10, "build": 300, "test": 288}
    WHOLE = NATIVE | {"sysroot": 60, structure.LAST_STAGE: 600}
    RUN = {"commit": "abc", "preset": "dev", "tests": "without slow", "clean": True, "hits": 0, "misses": 0,
           "stages": NATIVE}

    def measured(self, *runs):
        """Minutes of native tests without cache, of native tests with cache, of a whole run with cache."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "times.jsonl"
            path.write_text("".join(json.dumps(self.RUN | run) + "\n" for run in runs))
            return [row["measured"] for row in structure.clone_to_green(structure.recorded_runs(path, "abc"))]

    def test_the_state_of_the_cache_selects_the_row(self):
        self.assertEqual(self.measured({}), [10, "not measured", "not measured"])
        self.assertEqual(self.measured({"hits": 95, "misses": 5}), ["not measured", 10, "not measured"])
        self.assertEqual(self.measured({"hits": 50, "misses": 50}), ["not measured"] * 3)

    def test_a_run_with_the_arm64_stage_is_whole_and_not_native(self):
        self.assertEqual(self.measured({"stages": self.WHOLE, "hits": 1}), ["not measured", "not measured", 21])
        self.assertEqual(self.measured({"stages": self.WHOLE}), ["not measured"] * 3)

    def test_the_last_run_counts(self):
        self.assertEqual(self.measured({}, {"stages": self.NATIVE | {"build": 0}})[0], 5)

    def test_other_commits_presets_selections_and_used_build_folders_do_not_count(self):
        for other in ({"commit": "abc-dirty"}, {"preset": "asan"}, {"tests": "all"}, {"tests": "selected"},
                      {"clean": False}):
            self.assertEqual(self.measured(other), ["not measured"] * 3)

    def test_no_file(self):
        self.assertEqual(structure.recorded_runs(pathlib.Path("/nonexistent/times.jsonl"), "abc"), [])


if __name__ == "__main__":
    unittest.main()
