#!/usr/bin/env python3
"""The drawn scenes: numbers and lists that never change, ranges, and what may not hide what."""

import math
import sys
import unittest
from dataclasses import replace
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
import bodies  # noqa: E402
import draw  # noqa: E402
import placing  # noqa: E402

SEED_OF_CAMERA_SIZE = 0xB797DD1CEE8AA0C6
FIRST_DEV = [0, 1, 2, 3, 4, 5, 6, 9, 12, 14, 17, 18]
FIRST_UNSEEN = [7, 8, 10, 11, 13, 15, 16, 20, 21, 23, 24, 26]
SCENES = [draw.picture(name) for which in draw.SETS for name in draw.names(which)[::9]]


def hull_of(scene):
    return [bodies.turned(scene.attitude, p) for p in scene.model().vertices()]


class Numbers(unittest.TestCase):
    def test_a_number_depends_on_key_and_name_alone(self):
        # The first eight bytes that `printf scene/0/camera.size | sha256sum` prints.
        n = draw.Numbers("scene/0")
        n.uniform("another")
        self.assertEqual(n.seed("camera.size"), SEED_OF_CAMERA_SIZE)
        self.assertEqual(n.uniform("camera.size"), (SEED_OF_CAMERA_SIZE >> 11) / 2**53)
        self.assertNotEqual(n.uniform("camera.size"), draw.Numbers("scene/1").uniform("camera.size"))

    def test_ranges_keep_the_quantile(self):
        n = draw.Numbers("scene/3")
        q = n.uniform("a")
        self.assertAlmostEqual(n.uniform("a", 2, 4), 2 + 2 * q)
        self.assertAlmostEqual(n.log("a", 1, 100), 100**q)

    def test_choices_have_their_weights(self):
        taken = [draw.Numbers(f"k/{i}").choice("c", {"a": 1.0, "b": 3.0}) for i in range(2000)]
        # Standard deviation of the share: 0.0097.
        self.assertAlmostEqual(taken.count("b") / 2000, 0.75, delta=0.04)

    def test_directions_are_even(self):
        d = [draw.Numbers(f"k/{i}").direction("d") for i in range(2000)]
        for axis in range(3):
            # Standard deviation of a mean: 0.013.
            self.assertAlmostEqual(sum(v[axis] for v in d) / 2000, 0, delta=0.05)
        self.assertAlmostEqual(max(abs(bodies.length(v) - 1) for v in d), 0, delta=1e-12)


class Sets(unittest.TestCase):
    def test_half_of_all_indices_is_unseen(self):
        dev, unseen = draw.names("dev"), draw.names("unseen")
        self.assertEqual((len(dev), len(unseen)), (500, 600))
        self.assertFalse({n[-4:] for n in dev} & {n[-4:] for n in unseen})
        share = sum(draw.is_unseen(i) for i in range(4000)) / 4000
        # Standard deviation 0.008.
        self.assertAlmostEqual(share, 0.5, delta=0.03)

    def test_the_lists_never_change(self):
        self.assertEqual([int(n[-4:]) for n in draw.names("dev")[:12]], FIRST_DEV)
        self.assertEqual([int(n[-4:]) for n in draw.names("unseen")[:12]], FIRST_UNSEEN)

    def test_a_picture_of_another_half_is_refused(self):
        unseen = draw.names("unseen")[0]
        for name in (unseen.replace("unseen", "dev"), "dev/1", "defects/00_rain", "nowhere/0000"):
            with self.assertRaises(ValueError):
                draw.picture(name)

    def test_defects_differ_in_the_sensor_alone(self):
        plain = draw.picture("defects/03_none")
        for defect in draw.DEFECTS:
            other = draw.picture(f"defects/03_{defect}")
            self.assertEqual(replace(other, name=plain.name, defect="none", sensor=plain.sensor), plain)
        self.assertEqual(len({draw.picture(f"defects/03_{d}").sensor for d in draw.DEFECTS}), len(draw.DEFECTS))

    def test_a_sequence_differs_in_the_camera_alone(self):
        frames = [draw.picture(f"moving/02_{i}") for i in range(draw.SEQUENCE_FRAMES)]
        for f in frames:
            self.assertEqual(replace(f, name="", camera=frames[0].camera, size_px=0, frame=0),
                             replace(frames[0], name="", size_px=0))
        steps = [bodies.length(bodies.plus(a.camera.position, b.camera.position, -1))
                 for a, b in zip(frames, frames[1:])]
        self.assertGreater(min(steps), 0)


class Scenes(unittest.TestCase):
    def test_ranges(self):
        for s in SCENES:
            with self.subTest(s.name):
                away = bodies.length(s.camera.position)
                elevation = math.degrees(math.asin(s.camera.position[1] / away))
                self.assertTrue(20 - 1e-9 <= elevation <= 60 + 1e-9)
                self.assertTrue(500 <= s.camera.focal_px <= 1200)
                self.assertGreaterEqual(away, 1.5 * max(map(bodies.length, hull_of(s))) - 1e-6)
                self.assertTrue(0.05 <= s.room.share <= 0.5)
                self.assertTrue(all(0.01 <= a <= 0.9 for a in s.table.albedo))
                self.assertTrue(s.paper_roughness == 0 or 0.3 <= s.paper_roughness <= 0.6)
                strongest = bodies.dot(s.lamps[0].irradiance, (0.2126, 0.7152, 0.0722))
                for lamp in s.lamps:
                    self.assertTrue(10 <= lamp.elevation_deg <= 70 and 0.4 <= lamp.distance <= 3)
                    self.assertTrue(0.01 <= lamp.size_m <= 0.4)
                    self.assertLessEqual(bodies.dot(lamp.irradiance, (0.2126, 0.7152, 0.0722)), strongest + 1e-12)

    def test_sizes(self):
        sizes = [draw.picture(n).size_px for n in draw.names("dev")]
        self.assertTrue(100 - 0.1 <= min(sizes) and max(sizes) <= 900.1)
        # Even in the logarithm: half is below 300 px. Standard deviation of the share: 0.041.
        self.assertAlmostEqual(sum(v < 300 for v in sizes) / len(sizes), 0.5, delta=0.13)
        self.assertLess(max(draw.picture(n).size_px for n in draw.names("small")), 100)

    def test_the_picture_contains_the_body(self):
        for s in SCENES:
            with self.subTest(s.name):
                x, y, w, h = s.crop
                left, top, right, bottom = placing.box_of(s.camera, hull_of(s))
                self.assertTrue(0 <= x and x + w <= s.camera.width and 0 <= y and y + h <= s.camera.height)
                # A pixel less than MARGIN_PX, because the crop is rounded.
                self.assertTrue(left - x >= 7 and top - y >= 7 and x + w - right >= 7 and y + h - bottom >= 7)

    def test_the_camera_has_a_rotation(self):
        for s in SCENES:
            m = bodies.composed(s.camera.rotation, bodies.transposed(s.camera.rotation))
            self.assertAlmostEqual(max(abs(m[i][j] - (i == j)) for i in range(3) for j in range(3)), 0, delta=1e-9)
            self.assertGreater(bodies.dot(bodies.cross(*bodies.transposed(s.camera.rotation)[:2]),
                                          bodies.transposed(s.camera.rotation)[2]), 0.99)

    def test_the_body_stands_on_the_table(self):
        for s in SCENES:
            with self.subTest(s.name):
                lowest = min(p[1] for p in hull_of(s))
                # Half a millimetre of glue, and a degree at up to 50 mm from the face's centre.
                self.assertTrue(-1.5e-3 < s.table_height - lowest < 0)

    def test_folds_are_small_and_absent_where_they_should_be(self):
        for s in SCENES:
            for face, folded in zip(s.model().faces, s.faces):
                cosine = bodies.dot(face.frame.normal, folded.normal)
                off = bodies.length(bodies.plus(face.frame.origin, folded.origin, -1))
                limit = 0 if s.defect else 1
                self.assertLessEqual(math.degrees(math.acos(min(1.0, cosine))), limit + 1e-5)
                self.assertLessEqual(off, limit * 0.0005 + 1e-12)

    def test_nothing_hides_the_body(self):
        """Rays from the camera and from the middle of each lamp to the body's vertices meet no lamp and no clutter."""
        for s in SCENES:
            with self.subTest(s.name):
                balls = [(c.center(), c.radius()) for c in s.clutter]
                starts = [s.camera.position, *(lamp.position() for lamp in s.lamps)]
                for k, start in enumerate(starts):
                    lamps = [(lamp.position(), lamp.size_m / 2) for i, lamp in enumerate(s.lamps) if i != k - 1]
                    for p in hull_of(s):
                        for center, radius in (balls + lamps if k == 0 else balls):
                            self.assertGreater(distance_to_segment(center, start, p), radius)

    def test_lamps_are_above_the_table(self):
        for s in SCENES:
            for lamp in s.lamps:
                self.assertGreater(lamp.lowest(), s.table_height)


class Geometry(unittest.TestCase):
    def test_a_point_on_the_right_and_above_is_on_the_right_and_above(self):
        hull = [(x, y, z) for x in (-0.03, 0.03) for y in (-0.03, 0.03) for z in (-0.03, 0.03)]
        camera = placing.camera_for(hull, 200, 800, (1280, 960), 0, 30, 0, (0, 0))
        centre = camera.pixel((0, 0, 0))
        self.assertAlmostEqual(centre[0], 639.5)
        self.assertAlmostEqual(centre[1], 479.5)
        self.assertGreater(camera.pixel((0.01, 0, 0))[0], centre[0])
        self.assertLess(camera.pixel((0, 0.01, 0))[1], centre[1])
        self.assertAlmostEqual(placing.size_of(camera, hull), 200, delta=1e-3)

    def test_quaternions(self):
        for axis, angle in [((1, 0, 0), 0.3), ((0, 1, 0), 3.1), ((0, 0, 1), -2.0), (bodies.unit((1, 2, 3)), 3.14159)]:
            m = bodies.about(axis, angle)
            back = bodies.rotation_of(*bodies.quaternion_of(m))
            self.assertAlmostEqual(max(abs(m[i][j] - back[i][j]) for i in range(3) for j in range(3)), 0, delta=1e-9)
        self.assertAlmostEqual(bodies.quaternion_of(bodies.about((0, 0, 1), 0.2))[2], math.sin(0.1))

    def test_the_print_covers_the_face_once(self):
        for name in draw.BODY_WEIGHTS:
            body = draw.body_of(name)
            for face in body.faces:
                areas = [sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(q, [*q[1:], q[0]])) / 2
                         for q, _, layer in bodies.printed(face, body.tag_size) if layer == 1]
                outline = face.outline
                whole = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(outline, outline[1:] + outline[:1])) / 2
                self.assertGreater(min(areas), 0)
                self.assertLessEqual(sum(areas), whole * (1 + 1e-6))

    def test_a_disc_and_a_ball_far_away_give_the_same_light(self):
        ball = placing.Lamp("ball", 0, 30, 3, 0.01, (1, 1, 1))
        self.assertAlmostEqual(ball.form_factor() / replace(ball, shape="disc").form_factor(), 1, delta=1e-5)
        self.assertAlmostEqual(ball.form_factor(), math.pi * (0.005 / 3) ** 2)


def distance_to_segment(p, a, b):
    axis = bodies.plus(b, a, -1)
    t = min(1.0, max(0.0, bodies.dot(bodies.plus(p, a, -1), axis) / bodies.dot(axis, axis)))
    return bodies.length(bodies.plus(p, bodies.plus(a, axis, t), -1))


if __name__ == "__main__":
    unittest.main()
