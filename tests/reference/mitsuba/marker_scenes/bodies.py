"""Lightwell's marker bodies as geometry. Standard library alone; shares no code with Lightwell.

    load(path)           a body file: faces with tag, pose, outline and patches; a ball
    Body.vertices()      points whose convex hull is the body
    Body.printed(...)    every printed polygon, with the errors of folds and glue

Vectors are tuples of three floats, rotations tuples of three rows. Metres.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import text_format  # noqa: E402

Vector = tuple[float, float, float]
Rotation = tuple[Vector, Vector, Vector]

WHITE, INK = 0.80, 0.04  # Diffuse reflectance of paper and of black ink at normal incidence.

# tag36h11, numbers 0 to 19: ten rows of ten cells from the top, a set bit is black, the highest bit is the left cell.
# Data of AprilTag 3 (AprilRobotics, BSD 2-clause) as its apriltag_to_image() gives them.
TAGS = """
000 1fe 12a 18a 19e 15e 1a6 1ee 1fe 000
000 1fe 126 1a2 10e 19e 14a 1da 1fe 000
000 1fe 122 1b6 17e 1da 1ee 1c6 1fe 000
000 1fe 11a 1e2 162 15a 136 19e 1fe 000
000 1fe 116 10e 142 1d6 17e 176 1fe 000
000 1fe 10e 13a 126 152 1c6 14e 1fe 000
000 1fe 1fa 1a6 15a 18a 1f6 1ea 1fe 000
000 1fe 1ee 1e6 1ae 146 1e2 1ae 1fe 000
000 1fe 1de 152 1e2 182 116 14a 1fe 000
000 1fe 1da 16a 152 1be 1ba 136 1fe 000
000 1fe 1ca 1c2 116 1ba 146 1e6 1fe 000
000 1fe 1c2 102 16a 176 132 1aa 1fe 000
000 1fe 1be 116 1da 1b2 1d6 196 1fe 000
000 1fe 1ba 12e 14a 1f2 17a 182 1fe 000
000 1fe 1b2 15a 12e 16e 1c2 15a 1fe 000
000 1fe 1ae 16e 19e 1ae 166 146 1fe 000
000 1fe 1a6 19a 182 12a 1ae 11e 1fe 000
000 1fe 196 1f2 146 126 13a 1ce 1fe 000
000 1fe 196 106 1b6 162 1de 1ba 1fe 000
000 1fe 182 172 1ea 19e 112 156 1fe 000
""".split()


# ---------------------------------------------------------------------------------------------------------------------
# Vectors and rotations
# ---------------------------------------------------------------------------------------------------------------------
def dot(a, b) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def plus(a, b, times: float = 1.0) -> Vector:
    """a + times b."""
    return (a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2])


def length(a) -> float:
    return math.sqrt(dot(a, a))


def unit(a) -> Vector:
    n = length(a)
    return (a[0] / n, a[1] / n, a[2] / n)


def turned(m: Rotation, v) -> Vector:
    return (dot(m[0], v), dot(m[1], v), dot(m[2], v))


def transposed(m: Rotation) -> Rotation:
    return tuple(zip(*m))


def composed(a: Rotation, b: Rotation) -> Rotation:
    """First b, then a."""
    columns = transposed(b)
    return tuple(tuple(dot(row, column) for column in columns) for row in a)


def about(axis, angle_rad: float) -> Rotation:
    """Right-handed rotation about a unit axis."""
    (x, y, z), c, s = axis, math.cos(angle_rad), math.sin(angle_rad)
    t = 1 - c
    return ((c + x * x * t, x * y * t - z * s, x * z * t + y * s),
            (y * x * t + z * s, c + y * y * t, y * z * t - x * s),
            (z * x * t - y * s, z * y * t + x * s, c + z * z * t))


def between(a, b) -> Rotation:
    """The smallest rotation from unit vector a to unit vector b."""
    axis = cross(a, b)
    sine = length(axis)
    if sine < 1e-12:
        if dot(a, b) > 0:
            return about((1.0, 0.0, 0.0), 0.0)
        other = (1.0, 0.0, 0.0) if abs(a[0]) < 0.9 else (0.0, 1.0, 0.0)
        return about(unit(cross(a, other)), math.pi)
    return about(unit(axis), math.atan2(sine, dot(a, b)))


def rotation_of(x: float, y: float, z: float, w: float) -> Rotation:
    """Hamilton quaternion to rotation."""
    n = math.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / n, y / n, z / n, w / n
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))


def quaternion_of(m: Rotation) -> tuple[float, float, float, float]:
    """x, y, z, w (Hamilton), w not negative (Shepperd 1978: the largest component first)."""
    squares = [1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2],
               1 + m[0][0] + m[1][1] + m[2][2]]
    k = squares.index(max(squares))
    if k == 3:
        q = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], squares[3]]
    else:
        a, b, c = k, (k + 1) % 3, (k + 2) % 3
        q = [0.0] * 4
        q[a], q[b], q[c], q[3] = squares[k], m[b][a] + m[a][b], m[c][a] + m[a][c], m[c][b] - m[b][c]
    n = math.copysign(math.sqrt(sum(v * v for v in q)), q[3])
    return tuple(v / n for v in q)


# ---------------------------------------------------------------------------------------------------------------------
# Bodies
# ---------------------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Frame:
    """T_parent_frame."""
    rotation: Rotation
    origin: Vector

    def at(self, p) -> Vector:
        return plus(self.origin, turned(self.rotation, p))

    @property
    def normal(self) -> Vector:
        return (self.rotation[0][2], self.rotation[1][2], self.rotation[2][2])


@dataclass(frozen=True)
class Face:
    tag: int
    frame: Frame    # T_body_face
    outline: tuple  # x, y; counter-clockwise seen from outside
    patches: tuple  # (outline, (r, g, b))

    def corners(self) -> list[Vector]:
        return [self.frame.at((x, y, 0.0)) for x, y in self.outline]


@dataclass(frozen=True)
class Ball:
    center: Vector
    radius: float
    albedo: Vector


@dataclass(frozen=True)
class Body:
    name: str
    tag_size: float
    faces: tuple[Face, ...]
    ball: Ball | None

    def vertices(self) -> list[Vector]:
        """Of a ball, the corners of the octahedron around it and of its cube, scaled to the sphere."""
        out = [p for face in self.faces for p in face.corners()]
        if self.ball:
            steps = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)]
            out += [plus(self.ball.center, unit(s), self.ball.radius) for s in steps]
        return out

    def radius(self) -> float:
        """Of the smallest sphere around the origin that contains the body."""
        return max(length(p) for p in self.vertices())


def cells_of(tag: int) -> list[list[bool]]:
    """Ten rows of ten cells from the top, true where black."""
    rows = [int(row, 16) for row in TAGS[10 * tag:10 * tag + 10]]
    return [[bool(row >> (9 - column) & 1) for column in range(10)] for row in rows]


def printed(face: Face, tag_size: float) -> list[tuple[list[tuple[float, float]], Vector, int]]:
    """Convex polygons of one albedo each, with their layer: 0 is the blank paper under the print, 1 the print. The tag
    and its rim of one cell are ink and paper, the patches as the body file says."""
    out = [(list(face.outline), (WHITE,) * 3, 0)]
    out += [(list(outline), albedo, 1) for outline, albedo in face.patches]
    cell = tag_size / 8
    for row, cells in enumerate(cells_of(face.tag)):
        top = 5 * cell - row * cell
        starts = [c for c in range(10) if c == 0 or cells[c] != cells[c - 1]] + [10]
        for a, b in zip(starts, starts[1:]):
            x0, x1 = -5 * cell + a * cell, -5 * cell + b * cell
            box = [(x0, top - cell), (x1, top - cell), (x1, top), (x0, top)]
            out.append((box, (INK if cells[a] else WHITE,) * 3, 1))
    return out


def pairs(values: list[float]) -> tuple[tuple[float, float], ...]:
    return tuple(zip(values[0::2], values[1::2]))


def color(values: list[float]) -> Vector:
    return tuple(values * 3) if len(values) == 1 else tuple(values)


def load(path: Path) -> Body:
    """Errors: OSError; KeyError for a field that is missing; ValueError for another tag family."""
    data = text_format.parse(Path(path).read_text())
    if data.get("tag_family", ["tag36h11"]) != ["tag36h11"]:
        raise ValueError(f"{path}: only tag36h11 is known here")
    faces = []
    for face in data["face"]:
        pose = face["pose"][0]
        q, t = ([pose.get(k, [0.0])[0] for k in names] for names in (("qx", "qy", "qz", "qw"), ("tx", "ty", "tz")))
        patches = tuple((pairs(p["outline_m"]), color(p["albedo"])) for p in face.get("patch", []))
        faces.append(Face(int(face.get("tag_id", [0])[0]), Frame(rotation_of(*q), tuple(t)), pairs(face["outline_m"]),
                          patches))
    ball = None
    if "ball" in data:
        b = data["ball"][0]
        ball = Ball(tuple(b["center_m"]), b["radius_m"][0], color(b["albedo"]))
    return Body(data["name"][0], data["tag_size_m"][0], tuple(faces), ball)
