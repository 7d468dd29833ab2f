#!/usr/bin/env python3
"""Draws the random scenes: bodies, tables, clutter, lamps, rooms, cameras, sensors. Standard library alone.

    draw.py --list SET    prints the pictures of a set, one a line: dev, unseen, defects, moving, small
    draw.py SET/PICTURE   prints the scene of one picture as JSON
    picture(name)         the scene of one picture, "dev/17"

Each number depends on the scene's key and the number's name alone (SHA-256), so that a new quantity or a wider range of
one quantity changes no other number and no list. World: right-handed, metres, origin in the body's centre, +Y up.
Azimuths are from +Z towards +X; the camera is at azimuth 0 except in the set `moving`.
"""

import argparse
import dataclasses
import functools
import hashlib
import json
import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import bodies
import placing
from placing import Camera, Clutter, Lamp

BODIES = Path(__file__).resolve().parents[4] / "firmware/estimate/marker/bodies"
BODY_WEIGHTS = {"dodecahedron_100mm_white": 0.30, "dodecahedron_100mm_grey": 0.20, "icosahedron_100mm_white": 0.20,
                "cube_60mm_grey": 0.15, "ball_40mm": 0.15}
TABLE_WEIGHTS = {"uniform": 0.35, "wood": 0.2, "tiles": 0.15, "cloth": 0.15, "print": 0.15}
DEV, UNSEEN = 500, 600          # pictures of these sets
DEFECT_SCENES, SMALL_SCENES = 12, 12
SEQUENCES, SEQUENCE_FRAMES = 10, 10
FRAME = (1280, 960)             # the whole sensor, px
FOLD_DEG, GLUE_M = 1.0, 0.0005  # largest errors of a face's attitude and place
LAMPS_APART_DEG = 20            # as seen from the body
TABLE_GAP_M = 2e-5              # keeps the body and the table apart for the tracer
SETS = ("dev", "unseen", "defects", "moving", "small")


class Numbers:
    """Pseudorandom numbers by name, independent of the order in which they are asked for."""

    def __init__(self, key: str):
        self.key = key

    def seed(self, name: str) -> int:
        return int.from_bytes(hashlib.sha256(f"{self.key}/{name}".encode()).digest()[:8], "big")

    def uniform(self, name: str, low: float = 0.0, high: float = 1.0) -> float:
        return low + (high - low) * (self.seed(name) >> 11) / 2**53

    def log(self, name: str, low: float, high: float) -> float:
        """Log-uniform: every octave is equally likely."""
        return math.exp(self.uniform(name, math.log(low), math.log(high)))

    def choice(self, name: str, weights: dict):
        at = self.uniform(name) * sum(weights.values())
        for option, weight in weights.items():
            at -= weight
            if at < 0:
                return option
        return option

    def direction(self, name: str) -> bodies.Vector:
        """Uniform on the sphere."""
        y, a = self.uniform(f"{name}.y", -1, 1), self.uniform(f"{name}.azimuth", 0, 2 * math.pi)
        flat = math.sqrt(1 - y * y)
        return (flat * math.sin(a), y, flat * math.cos(a))


@dataclass(frozen=True)
class Table:
    kind: str                        # of TABLE_WEIGHTS
    albedo: bodies.Vector            # mean over the texture
    contrast: float                  # relative amplitude of the texture
    scale_m: float                   # of a ring, tile, thread or line of print
    roughness: float                 # of a satin coat; 0: matte
    half_size_m: tuple[float, float]
    turn_deg: float


@dataclass(frozen=True)
class Window:
    """A bright part of the room's wall."""
    azimuth_deg: float
    elevation_deg: float
    half_width_deg: float
    half_height_deg: float
    radiance: float       # relative to the wall


@dataclass(frozen=True)
class Room:
    share: float          # of the irradiance of a surface that faces the strongest lamp
    floor: float          # radiances relative to the walls
    ceiling: float
    color: bodies.Vector
    windows: tuple[Window, ...]


@dataclass(frozen=True)
class Sensor:
    level: float             # of the brightest paper, as a fraction of full scale
    electrons: float         # at full scale; 0: no noise
    read_noise: float        # fraction of full scale
    blur_px: float           # standard deviation of a Gaussian
    vignetting: float        # loss at the corner of the whole sensor
    calibrated: bool         # whether the estimator's calibration has the vignetting
    adaptation: float        # share of the light's colour that the camera's white balance removes
    white_balance: tuple[float, float, float]  # error of its gains
    jpeg_quality: int


@dataclass(frozen=True)
class Scene:
    name: str
    key: str
    body: str
    paper_roughness: float    # 0: matte
    attitude: bodies.Rotation  # nominal T_world_body, without translation
    faces: tuple[bodies.Frame, ...]  # T_body_face of the folded body
    ball_center: bodies.Vector | None
    table: Table
    table_height: float       # world y
    lamps: tuple[Lamp, ...]   # the strongest first
    clutter: tuple[Clutter, ...]
    room: Room
    camera: Camera
    crop: tuple[int, int, int, int]  # x, y, width, height within the whole sensor
    size_px: float            # larger side of the body's bounding box in the picture
    sensor: Sensor
    defect: str = ""
    frame: int = 0            # within a sequence

    def model(self) -> bodies.Body:
        return body_of(self.body)

    def numbers(self) -> Numbers:
        return Numbers(self.key)


_bodies: dict[str, bodies.Body] = {}


def body_of(name: str) -> bodies.Body:
    if name not in _bodies:
        _bodies[name] = bodies.load(BODIES / f"{name}.textproto")
    return _bodies[name]


def kelvin(temperature: float) -> bodies.Vector:
    """Linear Rec. 709 colour of a black body, luminance 1 (Kim et al. 2002, US 7024034: its chromaticity)."""
    t = 1000 / temperature
    x = (-0.2661239 * t**3 - 0.2343589 * t**2 + 0.8776956 * t + 0.179910 if temperature < 4000 else
         -3.0258469 * t**3 + 2.1070379 * t**2 + 0.2226347 * t + 0.240390)
    y = (-0.9549476 * x**3 - 1.37418593 * x**2 + 2.09137015 * x - 0.16748867 if temperature < 4000 else
         3.0817580 * x**3 - 5.87338670 * x**2 + 3.75112997 * x - 0.37001483)
    big_x, big_z = x / y, (1 - x - y) / y
    return tuple(max(0.02, v) for v in (3.2406 * big_x - 1.5372 - 0.4986 * big_z,
                                        -0.9689 * big_x + 1.8758 + 0.0415 * big_z,
                                        0.0557 * big_x - 0.2040 + 1.0570 * big_z))


def luminance(c) -> float:
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]


# ---------------------------------------------------------------------------------------------------------------------
# Parts of a scene
# ---------------------------------------------------------------------------------------------------------------------
def attitude_of(n: Numbers, body: bodies.Body) -> bodies.Rotation:
    """Any face of a polyhedron may be at the bottom. The sheet below a ball always is, and the ball does not stand
    between the camera and the tag, which is on the side of +Z."""
    upright = bodies.about((1.0, 0.0, 0.0), 0.0)
    half_turn = 90 if body.ball else 180
    if not body.ball:
        bottom = body.faces[int(n.uniform("body.bottom") * len(body.faces))]
        upright = bodies.between(bottom.frame.normal, (0.0, -1.0, 0.0))
    return bodies.composed(bodies.about((0.0, 1.0, 0.0), math.radians(n.uniform("body.turn", -half_turn, half_turn))),
                           upright)


def folded(n: Numbers, body: bodies.Body, amount: float) -> tuple[tuple[bodies.Frame, ...], bodies.Vector | None]:
    """The faces and the ball as folded and glued: each face off by up to FOLD_DEG and GLUE_M. A sheet below a ball lies
    flat; the ball is glued beside its place."""
    if body.ball:
        off = n.direction("glue.ball")
        off = bodies.plus((0.0, 0.0, 0.0), (off[0], 0.0, off[2]), amount * GLUE_M * n.uniform("glue.ball.size"))
        return tuple(f.frame for f in body.faces), bodies.plus(body.ball.center, off)
    out = []
    for i, face in enumerate(body.faces):
        normal = face.frame.normal
        axis = bodies.unit(bodies.cross(normal, n.direction(f"fold.{i}")))
        tilt = bodies.about(axis, math.radians(amount * FOLD_DEG * n.uniform(f"fold.{i}.size")))
        move = n.direction(f"glue.{i}")
        origin = bodies.plus(face.frame.origin, move, amount * GLUE_M * n.uniform(f"glue.{i}.size"))
        out.append(bodies.Frame(bodies.composed(tilt, face.frame.rotation), origin))
    return tuple(out), None


def table_of(n: Numbers, kinds: dict) -> Table:
    kind = n.choice("table.kind", kinds)
    scale = {"uniform": (0.01, 0.01), "wood": (0.003, 0.015), "tiles": (0.03, 0.2), "cloth": (0.001, 0.003),
             "print": (0.003, 0.01)}[kind]
    strength = {"uniform": (0.0, 0.0), "wood": (0.05, 0.3), "tiles": (0.02, 0.15), "cloth": (0.05, 0.3),
                "print": (0.5, 0.95)}[kind]
    tint = kelvin(n.uniform("table.tint", 2500, 4500)) if kind == "wood" else tuple(
        1 + n.uniform("table.saturation", 0, 0.4) * n.uniform(f"table.tint.{c}", -1, 1) for c in "rgb")
    level = n.uniform("table.albedo", 0.03, 0.8)
    white = kelvin(6500)
    tint = [t / w for t, w in zip(tint, white)] if kind == "wood" else tint
    albedo = tuple(min(0.9, level * v / luminance(tint)) for v in tint)
    return Table(kind, albedo, n.uniform("table.contrast", *strength), n.log("table.scale", *scale),
                 n.uniform("table.roughness", 0.3, 0.6) if n.uniform("table.satin") < 0.4 else 0.0,
                 (n.uniform("table.width", 0.4, 1.2), n.uniform("table.depth", 0.4, 1.2)),
                 n.uniform("table.turn", 0, 360))


def room_of(n: Numbers, share: tuple[float, float]) -> Room:
    windows = tuple(Window(n.uniform(f"window.{i}.azimuth", 0, 360), n.uniform(f"window.{i}.elevation", 0, 50),
                           n.uniform(f"window.{i}.width", 10, 40), n.uniform(f"window.{i}.height", 8, 25),
                           n.uniform(f"window.{i}.radiance", 1.5, 6.0))
                    for i in range(int(n.uniform("room.windows", 0, 4))))
    return Room(n.uniform("room.share", *share), n.uniform("room.floor", 0.2, 0.8), n.uniform("room.ceiling", 0.8, 2.0),
                kelvin(n.uniform("room.temperature", 2700, 7500)), windows)


def sensor_of(n: Numbers) -> Sensor:
    return Sensor(level=n.uniform("sensor.level", 0.6, 0.95), electrons=n.log("sensor.electrons", 3000, 20000),
                  read_noise=n.log("sensor.read_noise", 0.001, 0.005), blur_px=n.uniform("sensor.blur", 0, 1),
                  vignetting=n.uniform("sensor.vignetting", 0, 0.25),
                  calibrated=n.uniform("sensor.calibrated") < 0.5, adaptation=n.uniform("sensor.adaptation", 0.6, 1),
                  white_balance=tuple(n.log(f"sensor.gain.{c}", 0.8, 1.25) if c != "g" else 1.0 for c in "rgb"),
                  jpeg_quality=round(n.uniform("sensor.jpeg", 75, 95)))


@dataclass(frozen=True)
class Ranges:
    """What a set draws from, where it differs from the sets dev and unseen."""
    size_px: tuple[float, float] = (100, 900)
    lamps: int = 3                         # at most
    azimuth_deg: float = 180               # of the strongest lamp, on both sides of the camera
    room: tuple[float, float] = (0.05, 0.5)
    bodies: tuple = tuple(BODY_WEIGHTS)
    tables: tuple = tuple(TABLE_WEIGHTS)
    folds: float = 1.0                     # share of FOLD_DEG and GLUE_M
    satin: float = 0.5                     # share of scenes with satin paper
    clutter: float = 0.65                  # share of scenes with clutter


@dataclass(frozen=True)
class View:
    """One camera of a moving sequence, relative to the scene's first."""
    azimuth_deg: float = 0.0
    elevation_deg: float = 0.0
    zoom: float = 1.0


def lamps_of(n: Numbers, ranges: Ranges, stage: placing.Stage) -> tuple[Lamp, ...]:
    """The first is the strongest; the others give at most nine tenths of its irradiance."""
    count, out = 1 + int(n.uniform("lamps") * ranges.lamps), []
    for i in range(count):
        level = 1.0 if i == 0 else n.uniform(f"lamp.{i}.level", 0.15, 0.9)
        color = tuple(math.pi * level * c for c in kelvin(n.uniform(f"lamp.{i}.temperature", 2700, 6500)))
        side = ranges.azimuth_deg if i == 0 else 180
        for attempt in range(1000):
            k = f"lamp.{i}.{attempt}"
            lamp = Lamp("ball" if n.uniform(f"{k}.shape") < 0.6 else "disc", n.uniform(f"{k}.azimuth", -side, side),
                        n.uniform(f"{k}.elevation", 10, 70), n.uniform(f"{k}.distance", 0.4, 3.0),
                        n.log(f"{k}.size", 0.01, 0.4), color)
            if stage.lamp_fits(lamp, out, LAMPS_APART_DEG):
                out.append(lamp)
                break
        else:
            raise RuntimeError(f"{n.key}: no place for lamp {i}")
    return tuple(out)


def clutter_of(n: Numbers, ranges: Ranges, stage: placing.Stage, lamps) -> tuple[Clutter, ...]:
    """One to six things; one without a place after 30 attempts is left out."""
    if n.uniform("clutter") >= ranges.clutter:
        return ()
    out: list[Clutter] = []
    for i in range(1 + int(n.uniform("clutter.count") * 6)):
        for attempt in range(30):
            k = f"clutter.{i}.{attempt}"
            kind = n.choice(f"{k}.kind", {"box": 0.5, "ball": 0.2, "cylinder": 0.3})
            width, depth = n.uniform(f"{k}.width", 0.01, 0.08), n.uniform(f"{k}.depth", 0.01, 0.08)
            height = width if kind == "ball" else n.uniform(f"{k}.height", 0.008, 0.12)
            away, azimuth = stage.radius * n.uniform(f"{k}.distance", 1.2, 5), n.uniform(f"{k}.azimuth", 0, 360)
            x, _, z = placing.towards(azimuth, 0)
            level = n.uniform(f"{k}.albedo", 0.05, 0.8)
            color = tuple(min(0.9, level * (1 + n.uniform(f"{k}.tint.{c}", -0.6, 0.6))) for c in "rgb")
            thing = Clutter(kind, (away * x, stage.table_height, away * z), width, depth, height,
                            n.uniform(f"{k}.turn", 0, 360), color)
            if stage.clutter_fits(thing, lamps, out):
                out.append(thing)
                break
    return tuple(out)


def scene_of(name: str, key: str, ranges: Ranges, views: tuple[View, ...] = (View(),), frame: int = 0) -> Scene:
    """`views`: every camera of the sequence, all of which see the body; `frame`: the one of this picture."""
    n = Numbers(key)
    body_name = n.choice("body", {k: BODY_WEIGHTS[k] for k in ranges.bodies})
    body = body_of(body_name)
    attitude = attitude_of(n, body)
    faces, ball = folded(n, body, ranges.folds)
    hull = [bodies.turned(attitude, p) for p in body.vertices()]
    table_height = min(bodies.turned(attitude, f.at((x, y, 0.0)))[1]
                       for f, face in zip(faces, body.faces) for x, y in face.outline) - TABLE_GAP_M
    size = n.log("camera.size", *ranges.size_px)
    focal = n.uniform("camera.focal", max(500.0, 1.02 * size), 1200)
    elevation, roll = n.uniform("camera.elevation", 20, 60), n.uniform("camera.roll", -8, 8)
    aim = (n.uniform("camera.right", -1, 1), n.uniform("camera.down", -1, 1))
    cameras = [placing.camera_for(hull, size * v.zoom, focal, FRAME, v.azimuth_deg,
                                  min(60.0, max(20.0, elevation + v.elevation_deg)), roll, aim) for v in views]
    stage = placing.Stage(hull, table_height, [c.position for c in cameras])
    lamps = lamps_of(n, ranges, stage)
    crop = placing.crop_for(cameras, hull, table_height, lamps[0].position(), size)
    paper = n.uniform("paper.roughness", 0.3, 0.6) if n.uniform("paper.satin") < ranges.satin else 0.0
    return Scene(name, key, body_name, paper, attitude, faces, ball,
                 table_of(n, {k: TABLE_WEIGHTS[k] for k in ranges.tables}), table_height, lamps,
                 clutter_of(n, ranges, stage, lamps), room_of(n, ranges.room), cameras[frame], crop,
                 placing.size_of(cameras[frame], hull), sensor_of(n), frame=frame)


# ---------------------------------------------------------------------------------------------------------------------
# Sets
# ---------------------------------------------------------------------------------------------------------------------
CLEAN = Sensor(0.85, 0.0, 0.0, 0.0, 0.0, False, 1.0, (1.0, 1.0, 1.0), 97)
# One at a time, on pictures that are otherwise CLEAN. A new defect is added at the end.
DEFECTS = {
    "none": CLEAN,
    "noise": replace(CLEAN, electrons=3000.0, read_noise=0.005),
    "jpeg": replace(CLEAN, jpeg_quality=75),
    "blur_half_px": replace(CLEAN, blur_px=0.5),
    "blur_1px": replace(CLEAN, blur_px=1.0),
    "blur_2px": replace(CLEAN, blur_px=2.0),
    "vignetting": replace(CLEAN, vignetting=0.25),
    "white_balance": replace(CLEAN, white_balance=(1.25, 1.0, 0.8)),
}
LAMP_IN_FRONT = Ranges(size_px=(200, 320), lamps=1, azimuth_deg=60, room=(0.05, 0.3), tables=("uniform",), folds=0.0,
                       satin=0.0, clutter=0.0)
MOVING = Ranges(size_px=(140, 280))
SMALL = Ranges(size_px=(30, 100))


def is_unseen(index: int) -> bool:
    """Half of all indices are never looked at before the final table."""
    return bool(hashlib.sha256(f"half/{index}".encode()).digest()[0] & 1)


@functools.cache
def names(which: str) -> list[str]:
    """The pictures of a set, in their order."""
    if which in ("dev", "unseen"):
        out, index = [], 0
        while len(out) < (DEV if which == "dev" else UNSEEN):
            if is_unseen(index) == (which == "unseen"):
                out.append(f"{which}/{index:04d}")
            index += 1
        return out
    if which == "defects":
        return [f"defects/{k:02d}_{defect}" for k in range(DEFECT_SCENES) for defect in DEFECTS]
    if which == "moving":
        return [f"moving/{k:02d}_{i}" for k in range(SEQUENCES) for i in range(SEQUENCE_FRAMES)]
    if which == "small":
        return [f"small/{k:02d}" for k in range(SMALL_SCENES)]
    raise ValueError(f"no set {which!r}; there are {', '.join(SETS)}")


def path_of_camera(n: Numbers) -> tuple[View, ...]:
    """An arc: up to 50 degrees around the body, 15 degrees up or down, a fifth nearer or farther."""
    sweep, rise = n.uniform("path.sweep", -50, 50), n.uniform("path.rise", -15, 15)
    zoom = n.log("path.zoom", 0.8, 1.25)
    steps = [i / (SEQUENCE_FRAMES - 1) for i in range(SEQUENCE_FRAMES)]
    return tuple(View((t - 0.5) * sweep, t * rise, zoom ** t) for t in steps)


def picture(name: str) -> Scene:
    """ValueError for a name that no set has."""
    which, _, rest = name.partition("/")
    if name not in names(which):
        raise ValueError(f"no picture {name!r} in the set {which}")
    if which in ("dev", "unseen"):
        return scene_of(name, f"scene/{int(rest)}", Ranges())
    if which == "small":
        return scene_of(name, name, SMALL)
    number, _, part = rest.partition("_")
    key = f"{which}/{number}"
    if which == "defects":
        return replace(scene_of(name, key, LAMP_IN_FRONT), sensor=DEFECTS[part], defect=part)
    return scene_of(name, key, MOVING, path_of_camera(Numbers(key)), int(part))


def main() -> int:
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("--list", metavar="SET", choices=SETS)
    ap.add_argument("picture", nargs="?")
    args = ap.parse_args()
    if (args.list is None) == (args.picture is None):
        ap.error("give either --list SET or a picture")
    if args.list:
        print("\n".join(names(args.list)))
        return 0
    try:
        print(json.dumps(dataclasses.asdict(picture(args.picture)), indent=1))
    except ValueError as e:
        ap.error(str(e))
    return 0


if __name__ == "__main__":
    sys.exit(main())
