"""Draws the rooms of the light field's oracle: shapes, lamps, probes and points. Standard library alone. Every number
is a function of the room's name and SEED (SHA-256).

World: right-handed, metres, +Y up, the floor at y = 0. A box is (center, size); all boxes are parallel to the axes.
"""

import hashlib
import math
import random

SEED = 23
POINTS, PROBES = 200, 4
LAMP_CLEARANCE, PROBE_CLEARANCE, POINT_CLEARANCE = 0.6, 0.35, 0.12

# name: (x, height, z) of the shell; fixed full-height or low boxes that make it another shape
SHAPES = {
    "square": ((5.2, 2.7, 4.6), []),
    "corridor": ((8.4, 2.6, 3.0), []),
    # An L: a corner is filled up to the ceiling.
    "corner": ((6.4, 3.0, 5.8), [((1.9, 1.5, 1.8), (2.6, 3.0, 2.2))]),
}


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def distance(a, b):
    return math.dist(a, b)


def distance_to_box(p, box):
    center, size = box
    return math.hypot(*(max(abs(p[i] - center[i]) - size[i] / 2, 0) for i in range(3)))


def segment_hits_box(a, b, box):
    """Slab test."""
    near, far = 0.0, 1.0
    for i in range(3):
        low, high, d = box[0][i] - box[1][i] / 2 - a[i], box[0][i] + box[1][i] / 2 - a[i], b[i] - a[i]
        if abs(d) < 1e-12:
            if low > 0 or high < 0:
                return False
            continue
        t0, t1 = sorted((low / d, high / d))
        near, far = max(near, t0), min(far, t1)
    return near < far


class Room:
    def __init__(self, name):
        self.name = name
        (self.width, self.height, self.depth), self.solids = SHAPES[name][0], list(SHAPES[name][1])
        self.random = random.Random(int.from_bytes(hashlib.sha256(f"{SEED} {name}".encode()).digest()[:8], "big"))
        self.walls = [tuple(self.random.uniform(0.3, 0.75) for _ in range(3)) for _ in range(4)]
        self.draw_occluder_and_furniture()
        self.draw_lamps()
        self.draw_window()
        self.probes = self.draw_probes()
        self.points = self.draw_points()

    def uniform(self, low, high):
        return self.random.uniform(low, high)

    def somewhere(self, margin, low, high):
        """A place at least `margin` from the walls, `low` to `high` above the floor."""
        return (self.uniform(margin - self.width / 2, self.width / 2 - margin), self.uniform(low, high),
                self.uniform(margin - self.depth / 2, self.depth / 2 - margin))

    def clearance(self, p):
        return min((distance_to_box(p, box) for box in self.solids), default=9.0)

    def until(self, draw, accept):
        for _ in range(100_000):
            value = draw()
            if accept(value):
                return value
        raise RuntimeError(f"{self.name}: no place found")

    def draw_occluder_and_furniture(self):
        """The occluder, the first of `occluders`, hides lamps from a part of the room; furniture is low."""
        size = (self.uniform(0.5, 1.0), self.uniform(1.6, 2.0), self.uniform(0.3, 0.5))
        place = self.until(lambda: self.somewhere(1.0, 0, 0), lambda p: self.clearance(p) > 0.9)
        self.occluders = [*self.solids, ((place[0], size[1] / 2, place[2]), size)]
        self.solids = list(self.occluders)
        self.furniture = []
        for _ in range(3):
            size = (self.uniform(0.4, 1.2), self.uniform(0.4, 0.75), self.uniform(0.4, 0.8))
            place = self.until(lambda: self.somewhere(0.6, 0, 0), lambda p: self.clearance(p) > 0.75)
            self.furniture.append(((place[0], size[1] / 2, place[2]), size))
            self.solids.append(self.furniture[-1])

    def draw_lamps(self):
        """Two balls, and a square panel that shines down."""
        self.lamps, places = [], []
        for kind in ("ball", "ball", "panel"):
            low, high = (1.1, self.height - 0.4) if kind == "ball" else (self.height - 0.25, self.height - 0.1)
            place = self.until(lambda: self.somewhere(0.6, low, high), lambda p: self.clearance(p) > LAMP_CLEARANCE
                               and all(distance(p, other) > 1.3 for other in places))
            places.append(place)
            radius = self.uniform(0.04, 0.1) if kind == "ball" else self.uniform(0.12, 0.25)
            power = self.uniform(3, 8)  # radiant intensity along the axis
            color = (1.0, self.uniform(0.7, 0.95), self.uniform(0.4, 0.9))
            area = math.pi * radius**2 if kind == "ball" else 4 * radius**2
            self.lamps.append({"kind": kind, "center": place, "radius": radius,
                               "radiance": tuple(power * c / area for c in color)})

    def draw_window(self):
        """In the wall at +X or -X, facing into the room."""
        side = self.random.choice((-1, 1))
        half = (self.uniform(0.35, 0.6), self.uniform(0.35, 0.6))  # along z, along y
        free = lambda z: all(distance_to_box((side * (self.width / 2 - 0.3), 1.5, z), box) > half[0] + 0.2
                             for box in self.occluders)
        z = self.until(lambda: self.uniform(half[0] + 0.2 - self.depth / 2, self.depth / 2 - half[0] - 0.2), free)
        level = self.uniform(2, 5)
        self.window = {"kind": "window", "center": (side * (self.width / 2 - 0.01), 1.5, z), "half": half,
                       "normal": (-side, 0, 0), "radiance": tuple(level * c for c in (0.85, 1.0, 1.2))}

    def draw_probes(self):
        """Four, each with a rotation (axis, angle) of its axes."""
        probes = []
        for _ in range(PROBES):
            spread = 0.42 * math.sqrt(self.width * self.depth)
            place = self.until(lambda: self.somewhere(0.6, 0.9, 1.7), lambda p: self.clearance(p) > PROBE_CLEARANCE
                               and all(distance(p, q["position"]) > spread for q in probes)
                               and all(distance(p, lamp["center"]) > 0.7 for lamp in self.lamps))
            axis = (self.uniform(-0.2, 0.2), 1.0, self.uniform(-0.2, 0.2))
            n = math.hypot(*axis)
            probes.append({"position": place, "axis": tuple(a / n for a in axis),
                           "angle": self.uniform(-math.pi, math.pi)})
        return probes

    def draw_points(self):
        return [self.until(lambda: self.somewhere(0.3, 0.3, 2.0), lambda p: self.clearance(p) > POINT_CLEARANCE
                           and all(distance(p, lamp["center"]) > 0.4 for lamp in self.lamps)) for _ in range(POINTS)]


def normals():
    """Six along the axes, eight between them."""
    s = 1 / math.sqrt(3)
    return [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)] + [
        (x * s, y * s, z * s) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
