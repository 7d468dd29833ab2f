"""lightwell_plot.py: labels, lines of a stream, exit statuses. usage: plot_test.py (needs matplotlib)"""
import json
import math
import random
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[3] / "firmware/tools/lightwell_plot.py"
sys.path.insert(0, str(SCRIPT.parent))

import lightwell_plot  # noqa: E402
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


if __name__ == "__main__":
    unittest.main()
