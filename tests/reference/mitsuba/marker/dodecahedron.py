"""Geometry of the marker: twelve faces with a tag each, their printed pattern, and comparison with body files.

Written anew from the design, so that the frames here and Lightwell's own body files can disagree. Needs numpy alone.

    faces()              T_body_face of the twelve
    face_outline()       the pentagon in a face's frame
    ink(variant, tag)    a face as polygons of one albedo each
    albedo_at(...)       the same as a function of the place
    compare(path, ...)   a Lightwell body file against all that; raises Disagreement

The body's frame: right-handed, metres, origin in the centre, +Y the top (face 0). A face's frame is its tag's: +X
right, +Y up, +Z out.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import text_format  # noqa: E402

INRADIUS = 0.050  # 100 mm face to face
TAG = 0.024       # black edge to black edge, 8 cells
CELL = TAG / 8
RIM = 10 * CELL   # with the white rim of one cell that the family asks for
WHITE, INK = 0.80, 0.04
# Top left, top right, bottom left, bottom right: the paper's white and 75, 50 and 25 % of it.
QUADRANTS = {"white": (WHITE, WHITE, WHITE, WHITE), "grey": (0.80, 0.60, 0.40, 0.20)}
RING_ELEVATION = np.arcsin(1 / np.sqrt(5))  # 26.565 degrees: neighbouring normals are acos(1/sqrt 5) apart

# tag36h11, numbers 0 to 11: ten rows of ten cells from the top, a set bit is black, the highest bit is the left cell.
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
""".split()


class Disagreement(Exception):
    """A body file differs from the body defined here; the message says where."""


def unit(a) -> np.ndarray:
    a = np.asarray(a, float)
    return a / np.linalg.norm(a)


# ---------------------------------------------------------------------------------------------------------------------
# Where the faces are
# ---------------------------------------------------------------------------------------------------------------------
def normals() -> np.ndarray:
    """Face 0 up, 1-5 the upper ring (azimuth 72 k from +Z towards +X), 6+k opposite to 1+k, 11 down."""
    azimuth = np.radians(72 * np.arange(5))
    c, s = np.cos(RING_ELEVATION), np.sin(RING_ELEVATION)
    upper = np.stack([c * np.sin(azimuth), np.full(5, s), c * np.cos(azimuth)], 1)
    return np.concatenate([[[0, 1, 0]], upper, -upper, [[0, -1, 0]]])


def faces() -> np.ndarray:
    """(12, 4, 4): T_body_face. A tag's up is +Y as far as the face allows; -Z on face 0, +Z on face 11."""
    out = np.tile(np.eye(4), (12, 1, 1))
    for i, n in enumerate(normals()):
        hint = np.array({0: (0, 0, -1), 11: (0, 0, 1)}.get(i, (0, 1, 0)), float)
        up = unit(hint - (hint @ n) * n)
        out[i, :3, 0], out[i, :3, 1], out[i, :3, 2], out[i, :3, 3] = np.cross(up, n), up, n, INRADIUS * n
    return out


def vertices() -> np.ndarray:
    """(20, 3): the vertices, where three faces meet, from the normals alone."""
    n, found = normals(), []
    for i in range(12):
        for j in range(i):
            for k in range(j):
                m = n[[i, j, k]]
                if abs(np.linalg.det(m)) < 1e-6:
                    continue
                p = np.linalg.solve(m, np.full(3, INRADIUS))
                if (n @ p).max() < INRADIUS + 1e-9 and not any(np.allclose(p, q, atol=1e-9) for q in found):
                    found.append(p)
    return np.array(found)


def face_outline(face: int) -> np.ndarray:
    """(5, 2), counter-clockwise seen from outside: the body's vertices that lie in this face, in its frame."""
    local = (vertices() - faces()[face, :3, 3]) @ faces()[face, :3, :3]
    flat = local[np.abs(local[:, 2]) < 1e-9, :2]
    return flat[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))]


# ---------------------------------------------------------------------------------------------------------------------
# What is printed on them
# ---------------------------------------------------------------------------------------------------------------------
def bitmap(tag: int) -> np.ndarray:
    """(10, 10), row 0 at the top, true where black; the outer cells are the white rim."""
    rows = [int(row, 16) for row in TAGS[10 * tag:10 * tag + 10]]
    return np.array([[bool(row >> (9 - column) & 1) for column in range(10)] for row in rows])


def area(polygon) -> float:
    x, y = np.asarray(polygon, float).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def clip(polygon, axis: int, limit: float, keep_above: bool) -> list:
    """The part of a convex polygon on one side of x (axis 0) or y (axis 1) = limit."""
    out, sign = [], 1 if keep_above else -1
    for a, b in zip(polygon, list(polygon[1:]) + [polygon[0]]):
        da, db = sign * (a[axis] - limit), sign * (b[axis] - limit)
        if da >= 0:
            out.append(tuple(a))
        if da * db < 0:
            t = da / (da - db)
            out.append(tuple(np.asarray(a) + t * (np.asarray(b) - np.asarray(a))))
    return out


def ink(variant: str, face: int) -> list[tuple[np.ndarray, float]]:
    """Convex polygons of one albedo each, in the face's frame, that tile the face; face i carries tag i."""
    out, half = [], RIM / 2
    for row, cells in enumerate(bitmap(face)):
        starts = [c for c in range(10) if c == 0 or cells[c] != cells[c - 1]] + [10]
        for a, b in zip(starts, starts[1:]):
            x0, x1, y1 = -half + a * CELL, -half + b * CELL, half - row * CELL
            out.append((np.array([(x0, y1 - CELL), (x1, y1 - CELL), (x1, y1), (x0, y1)]), INK if cells[a] else WHITE))
    for quadrant, albedo in enumerate(QUADRANTS[variant]):
        right, below = quadrant % 2 == 1, quadrant >= 2
        rest = clip(clip(face_outline(face), 0, 0.0, right), 1, 0.0, not below)
        beside = clip(rest, 0, half if right else -half, right)
        within = clip(rest, 0, half if right else -half, not right)
        for piece in (beside, clip(within, 1, -half if below else half, not below)):
            if len(piece) >= 3 and area(piece) > 1e-12:
                out.append((np.array(piece), albedo))
    assert abs(sum(area(p) for p, _ in out) - area(face_outline(face))) < 1e-12
    return out


def albedo_at(variant: str, face: int, x, y) -> np.ndarray:
    """The same as a formula, for numbers or arrays; valid only inside the pentagon."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    row, column = (np.clip(np.floor((RIM / 2 + q) / CELL).astype(int), 0, 9) for q in (-y, x))
    quadrant = np.take(QUADRANTS[variant], (x > 0).astype(int) + 2 * (y < 0).astype(int))
    return np.where(
        np.maximum(np.abs(x), np.abs(y)) < RIM / 2, np.where(bitmap(face)[row, column], INK, WHITE), quadrant
    )


def tag_corners(face: int) -> np.ndarray:
    """(4, 3) in the body's frame: bottom left, bottom right, top right, top left of the black edge."""
    h = TAG / 2
    m = faces()[face]
    return np.array([(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)]) @ m[:3, :3].T + m[:3, 3]


# ---------------------------------------------------------------------------------------------------------------------
# Lightwell's body files
# ---------------------------------------------------------------------------------------------------------------------
def rotation(x: float, y: float, z: float, w: float) -> np.ndarray:
    """Hamilton quaternion to matrix."""
    x, y, z, w = np.array([x, y, z, w]) / np.sqrt(x * x + y * y + z * z + w * w)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


@dataclass
class Comparison:
    """Result of compare(): the largest differences, and the share of the quadrants that the file's patches cover."""
    pose_m: float
    outline_m: float
    coverage: float


def compare(path: Path, variant: str, tolerance: float = 1e-6) -> Comparison:
    """Compares a body file with this geometry: pose, outline, tag and family exactly, patches by the albedo there."""
    def need(condition: bool, what: str) -> None:
        if not condition:
            raise Disagreement(f"{path}: {what}")

    body = text_format.parse(path.read_text())
    need(body.get("tag_family", ["tag36h11"]) == ["tag36h11"], "another tag family")
    need(abs(body["tag_size_m"][0] - TAG) < tolerance, f"tag_size_m {body['tag_size_m'][0]}, here {TAG}")
    need(sorted(int(f.get("tag_id", [0])[0]) for f in body["face"]) == list(range(12)), "tags are not 0 to 11")
    mine, worst = faces(), Comparison(0, 0, 0)
    covered = wanted = 0.0
    for face in body["face"]:
        i = int(face.get("tag_id", [0])[0])
        pose = {k: face["pose"][0].get(k, [0.0])[0] for k in ("qx", "qy", "qz", "qw", "tx", "ty", "tz")}
        theirs = np.column_stack(
            [rotation(pose["qx"], pose["qy"], pose["qz"], pose["qw"]), [pose["tx"], pose["ty"], pose["tz"]]]
        )
        # Of the rotation, what it moves at a face's rim.
        off = max(np.abs(theirs[:, 3] - mine[i, :3, 3]).max(), np.abs(theirs[:, :3] - mine[i, :3, :3]).max() * 0.04)
        need(off < tolerance, f"face {i}: T_body_face is\n{theirs}\nand here\n{mine[i, :3]}")
        outline = np.array(face["outline_m"]).reshape(-1, 2)
        need(len(outline) == 5, f"face {i}: an outline of {len(outline)} points")
        distance = np.abs(outline[:, None] - face_outline(i)[None]).max(2).min(1)
        need(distance.max() < tolerance, f"face {i}: outline\n{outline}\nand here\n{face_outline(i)}")
        need(area(outline) > 0, f"face {i}: clockwise")
        for patch in face["patch"]:
            polygon, albedo = np.array(patch["outline_m"]).reshape(-1, 2), patch["albedo"]
            need(area(polygon) > 0, f"face {i}: a patch is clockwise")
            covered += area(polygon)
            rim_points = (
                polygon
                + 1e-5 * (polygon.mean(0) - polygon) / np.linalg.norm(polygon.mean(0) - polygon, axis=1)[:, None]
            )
            inner = [polygon.mean(0) + t * (p - polygon.mean(0)) for p in rim_points for t in (0, 0.5, 1.0)]
            edges = [
                (a + b) / 2 + 1e-5 * unit(polygon.mean(0) - (a + b) / 2)
                for a, b in zip(polygon, np.roll(polygon, -1, 0))
            ]
            for x, y in [*inner, *edges]:
                here = albedo_at(variant, i, x, y)
                need(all(abs(a - here) < 1e-6 for a in albedo),
                     f"face {i}: a patch of albedo {albedo} lies at ({x:.5f}, {y:.5f}), where the sheet is {here}")
        wanted += area(face_outline(i)) - RIM ** 2
        worst.pose_m, worst.outline_m = max(worst.pose_m, off), max(worst.outline_m, float(distance.max()))
    worst.coverage = covered / wanted
    return worst
