"""lightwell_plot.py: labels, lines of a stream, exit statuses; the chart of a captured plane. Needs matplotlib.
usage: plot_test.py"""
import json
import math
import random
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[3] / "firmware/tools/lightwell_plot.py"
sys.path[:0] = [str(SCRIPT.parent), str(Path(__file__).resolve().parents[2] / "figure_topics")]

import lightwell_plot  # noqa: E402
import specular_chart  # noqa: E402
from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402

LENS = {"lens": 0, "share": 0.5, "pictures": 3, "width": 64, "height": 48, "columns": 4, "rows": 3,
        "lacking": [[0, 0], [3, 2]], "points": [[10, 20], [30.5, 40]]}


def placed(points, size):
    """The boxes of the labels of `points`, px, in axes that fill a picture of `size` px."""
    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, size[0]), ylim=(0, size[1]))
    labels = [lightwell_plot.Label(text, x, y, "black", "normal") for text, x, y in points]
    return [text.get_window_extent() for text in lightwell_plot.place_labels(axes, labels)]


class Labels(unittest.TestCase):
    def test_do_not_overlap_when_points_are_dense(self):
        numbers = random.Random(3)
        points = [(f"label {i}", numbers.gauss(500, 90), numbers.gauss(300, 60)) for i in range(40)]
        boxes = placed(points, (1000, 600))
        self.assertEqual(len(boxes), len(points))
        for i, box in enumerate(boxes):
            self.assertTrue(box.x0 >= 0 and box.y0 >= 0 and box.x1 <= 1000 and box.y1 <= 600, box)
            self.assertEqual(box.count_overlaps(boxes[:i]), 0, box)

    def test_are_placed_next_to_an_isolated_point(self):
        box, = placed([("alone", 100, 100)], (200, 200))
        nearest = min(max(100, box.x0), box.x1), min(max(100, box.y0), box.y1)
        self.assertLess(math.dist(nearest, (100, 100)), 15)


class Program(unittest.TestCase):
    def run_it(self, text, *arguments):
        return subprocess.run([sys.executable, "-B", SCRIPT, *arguments], input=text, capture_output=True, text=True,
                              check=False)

    def test_each_line_replaces_the_pictures(self):
        with tempfile.TemporaryDirectory() as folder:
            png, svg = Path(folder, "a.png"), Path(folder, "a.svg")
            lines = [json.dumps([{**LENS, "pictures": count, "points": LENS["points"][:count]}]) for count in (0, 7)]
            done = self.run_it("\n".join(lines) + "\n", "--output", png, "--output", svg)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(png.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
            self.assertIn("lens 0: 7 pictures, 2 points, 50 % of the cells known", svg.read_text(encoding="utf-8"))
            self.assertEqual(sorted(path.name for path in Path(folder).iterdir()), ["a.png", "a.svg"])

    def test_errors_say_what_is_wrong(self):
        with tempfile.TemporaryDirectory() as folder:
            good, picture = json.dumps([LENS]), Path(folder, "a.png")
            for text, path, why in (("", picture, "there is nothing in it"), ("hello", picture, "-:1: Expecting value"),
                                    (good + "\n{}", picture, "-:2: it is not the JSON of"),
                                    ('[{"lens": 0}]', picture, "-:1: it lacks 'pictures'"),
                                    (good, Path(folder, "no/a.png"), "No such file or directory")):
                done = self.run_it(text, "--output", path)
                self.assertEqual(done.returncode, 1, text)
                self.assertIn(why, done.stderr)
            self.assertEqual(self.run_it("", Path(folder, "no.json"), "--output", picture).returncode, 1)

    def test_usage(self):
        for wrong in ((), ("--output", "a.jpg"), ("--outptu", "a.png")):
            self.assertEqual(self.run_it("", *wrong).returncode, 2, wrong)
        self.assertIn("lightwell-eval --pareto", self.run_it("", "--help").stdout)


def capture(ms, mb, rmse, figure="trade", **more):
    return {"figure": figure, "sequence": "a room", "levels": 60, "texels": 256, "every": 1, "frames": 100, "ms": ms,
            "mb": mb, "rmse": rmse, "fill_limit": 0.1, **more}


class SpecularChart(unittest.TestCase):
    def test_the_front_is_of_time_memory_and_error_of_one_spiral(self):
        best, dominated, less_memory = capture(2, 50, 0.02), capture(2, 60, 0.02), capture(3, 40, 0.03)
        few_frames = capture(6, 90, 0.05, every=4, frames=25)
        items = [best, dominated, less_memory, few_frames, capture(9, 90, 0.5, figure="fill")]
        self.assertEqual([specular_chart.on_front(item, items) for item in items], [True, False, True, True, True])

    def test_draws_each_line(self):
        items = [capture(2, 50, 0.02), capture(1, 20, 0.04, texels=128), capture(9, 90, 0.01, figure="fill")]
        time, memory = specular_chart.panels_of(items)
        self.assertEqual([case.label for case in time.cases], ["default", "128x128", "10 % filled"])
        self.assertEqual([case.cost for case in time.cases], [0.2, 0.1, 0.9])
        self.assertEqual([case.cost for case in memory.cases], [50, 20, 90])
        with tempfile.TemporaryDirectory() as folder:
            specular_chart.draw(items, Path(folder, "a.png"))
            self.assertGreater(Path(folder, "a.png").stat().st_size, 10_000)


if __name__ == "__main__":
    unittest.main()
