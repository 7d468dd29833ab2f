"""Cameras, lamps and clutter in space: projection, the crop of a picture, and what may not hide what.

    Camera, camera_for, size_of, crop_for
    Lamp, Clutter
    Stage                which places are free for lamps and clutter

World: metres, origin in the body's centre, +Y up. Pixels: the centre of the top left pixel is (0, 0).
"""

import math
from dataclasses import dataclass

from bodies import Rotation, Vector, about, between, composed, cross, dot, length, plus, transposed, turned, unit

# The table around the body that the estimator reads, in radii of the body (firmware/estimate/README.md).
TABLE_RADII = 3.4
MARGIN_PX = 8          # between the body and the picture's edge
# Width of a picture as a multiple of the body's size, for the smallest and the largest body.
WIDTH_OF_SMALL, WIDTH_OF_LARGE, SMALL_PX, LARGE_PX, HEIGHT_OF_WIDTH = 3.0, 1.2, 100.0, 900.0, 0.85
UP = (0.0, 1.0, 0.0)


def towards(azimuth_deg: float, elevation_deg: float) -> Vector:
    """Unit vector; azimuths from +Z towards +X."""
    a, e = math.radians(azimuth_deg), math.radians(elevation_deg)
    return (math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e))


@dataclass(frozen=True)
class Camera:
    """A pinhole. Camera axes: x right, y up, z back."""
    focal_px: float
    width: int          # of the whole sensor, with the principal point in its middle
    height: int
    rotation: Rotation  # T_world_camera
    position: Vector

    def to_camera(self, p) -> Vector:
        return turned(transposed(self.rotation), plus(p, self.position, -1.0))

    def pixel(self, p) -> tuple[float, float] | None:
        """Of the whole sensor; None behind the camera."""
        x, y, z = self.to_camera(p)
        if z > -1e-3:
            return None
        return ((self.width - 1) / 2 + self.focal_px * x / -z, (self.height - 1) / 2 - self.focal_px * y / -z)


def box_of(camera: Camera, points) -> tuple[float, float, float, float]:
    """left, top, right, bottom of the points in front of the camera, px."""
    pixels = [q for q in (camera.pixel(p) for p in points) if q]
    return (min(q[0] for q in pixels), min(q[1] for q in pixels),
            max(q[0] for q in pixels), max(q[1] for q in pixels))


def size_of(camera: Camera, hull) -> float:
    """Larger side of the bounding box, px."""
    left, top, right, bottom = box_of(camera, hull)
    return max(right - left, bottom - top)


def camera_for(hull, size_px: float, focal_px: float, frame: tuple[int, int], azimuth_deg: float, elevation_deg: float,
               roll_deg: float, aim: tuple[float, float]) -> Camera:
    """The camera at whose distance the hull has `size_px`, at least 1.5 radii away. `aim`: where the body's centre is
    in the frame, -1 to 1 of 0.6 of the room that the body leaves there; moved so that all of the body is in it."""
    out = towards(azimuth_deg, elevation_deg)
    right = unit(cross(UP, out))
    level = composed(transposed((right, cross(out, right), out)), about((0.0, 0.0, 1.0), math.radians(roll_deg)))
    offset = [a * 0.6 * max(0.0, side / 2 - 0.62 * size_px - MARGIN_PX) for a, side in zip(aim, frame)]
    for _ in range(6):
        ray = unit((offset[0] / focal_px, -offset[1] / focal_px, -1.0))
        aimed = composed(level, transposed(between((0.0, 0.0, -1.0), ray)))
        low, high = 1.5 * max(length(p) for p in hull), 20.0
        for _ in range(50):
            middle = (low + high) / 2
            camera = Camera(focal_px, *frame, aimed, plus((0.0, 0.0, 0.0), out, middle))
            low, high = (middle, high) if size_of(camera, hull) > size_px else (low, middle)
        box = box_of(camera, hull)
        move = [max(0.0, MARGIN_PX - box[axis]) - max(0.0, box[2 + axis] + MARGIN_PX - (side - 1))
                for axis, side in enumerate(frame)]
        if move == [0.0, 0.0]:
            break
        offset = [o + m for o, m in zip(offset, move)]
    return camera


@dataclass(frozen=True)
class Lamp:
    """A ball of uniform radiance, or a disc that faces the body's centre."""
    shape: str          # "ball" or "disc"
    azimuth_deg: float
    elevation_deg: float
    distance: float     # from the body's centre
    size_m: float       # diameter
    irradiance: Vector  # at the body's centre at normal incidence, without occlusion

    def position(self) -> Vector:
        return plus((0.0, 0.0, 0.0), towards(self.azimuth_deg, self.elevation_deg), self.distance)

    def lowest(self) -> float:
        half = self.size_m / 2
        below = half * math.cos(math.radians(self.elevation_deg)) if self.shape == "disc" else half
        return self.position()[1] - below

    def form_factor(self) -> float:
        """Irradiance at the body's centre divided by the radiance."""
        q = (self.size_m / 2 / self.distance) ** 2
        return math.pi * (q if self.shape == "ball" else q / (1 + q))


@dataclass(frozen=True)
class Clutter:
    kind: str       # "box", "ball" or "cylinder", standing on the table
    base: Vector    # centre of its base
    width: float    # diameter of balls and cylinders
    depth: float
    height: float
    turn_deg: float
    albedo: Vector

    def center(self) -> Vector:
        return plus(self.base, UP, self.height / 2)

    def radius(self) -> float:
        """Of the sphere around its centre that contains it."""
        if self.kind == "ball":
            return self.width / 2
        across = math.hypot(self.width, self.depth) if self.kind == "box" else self.width
        return math.hypot(across, self.height) / 2


def apart(point, radius: float, a, radius_a: float, b, radius_b: float) -> bool:
    """Whether a ball is outside of the cone between the balls around a and b (which it may touch beyond its ends)."""
    axis = plus(b, a, -1.0)
    t = min(1.0, max(0.0, dot(plus(point, a, -1.0), axis) / dot(axis, axis)))
    nearest = plus(a, axis, t)
    return length(plus(point, nearest, -1.0)) > radius + radius_a + t * (radius_b - radius_a)


class Stage:
    """The body on its table, and the places from which cameras look."""
    CENTRE = (0.0, 0.0, 0.0)

    def __init__(self, hull, table_height: float, eyes):
        self.radius = max(length(p) for p in hull)
        self.table_height = table_height
        self.eyes = list(eyes)

    def lamp_fits(self, lamp: Lamp, others, least_angle_deg: float) -> bool:
        """Above the table; not between a camera and the body with the table beside it; apart from the other lamps."""
        at, half = lamp.position(), lamp.size_m / 2
        if lamp.lowest() < self.table_height + 0.01:
            return False
        if any(length(plus(at, eye, -1.0)) < half + 0.05 or
               not apart(at, half, eye, 0.01, self.CENTRE, 1.5 * self.radius) for eye in self.eyes):
            return False
        for other in others:
            q = other.position()
            if length(plus(at, q, -1.0)) < half + other.size_m / 2 + 0.02:
                return False
            if dot(unit(at), unit(q)) > math.cos(math.radians(least_angle_deg)):
                return False
        return True

    def clutter_fits(self, thing: Clutter, lamps, others) -> bool:
        """Beside the body, and hiding it neither from a camera nor from any point of a lamp."""
        at, r = thing.center(), thing.radius()
        if math.hypot(at[0], at[2]) < self.radius + r:
            return False
        if any(not apart(at, r, eye, 0.02, self.CENTRE, self.radius) for eye in self.eyes):
            return False
        if any(not apart(at, r, lamp.position(), lamp.size_m / 2, self.CENTRE, self.radius) for lamp in lamps):
            return False
        return all(length(plus(at, other.center(), -1.0)) > r + other.radius() for other in others)


def shadow_points(hull, table_height: float, lamp: Vector) -> list[Vector]:
    """Where the hull's vertices cast their shadows on the table, at most TABLE_RADII radii from its centre."""
    reach, out = TABLE_RADII * max(length(p) for p in hull), []
    for p in hull:
        if lamp[1] <= p[1]:
            continue
        t = (lamp[1] - table_height) / (lamp[1] - p[1])
        x, z = lamp[0] + t * (p[0] - lamp[0]), lamp[2] + t * (p[2] - lamp[2])
        scale = min(1.0, reach / max(1e-9, math.hypot(x, z)))
        out.append((x * scale, table_height, z * scale))
    return out


def union(boxes) -> tuple[float, float, float, float]:
    left, top, right, bottom = zip(*boxes)
    return (min(left), min(top), max(right), max(bottom))


def crop_for(cameras, hull, table_height: float, lamp: Vector, size_px: float) -> tuple[int, int, int, int]:
    """x, y, width, height of the pictures of a sequence within the sensor: all of the body, as much of its shadow by
    `lamp` as fits, and table around. The larger the body, the less is around it."""
    body = union(box_of(c, hull) for c in cameras)
    wanted = union(box_of(c, list(hull) + shadow_points(hull, table_height, lamp)) for c in cameras)
    position = min(1.0, max(0.0, math.log(size_px / SMALL_PX) / math.log(LARGE_PX / SMALL_PX)))
    width = size_px * (WIDTH_OF_SMALL + (WIDTH_OF_LARGE - WIDTH_OF_SMALL) * position)
    out = []
    for axis, (side, most) in enumerate([(cameras[0].width, width), (cameras[0].height, HEIGHT_OF_WIDTH * width)]):
        least = body[2 + axis] - body[axis] + 2 * MARGIN_PX
        extent = min(side, 2 * math.ceil(max(most, least) / 2))
        start = (wanted[axis] + wanted[2 + axis] - extent) / 2
        start = max(min(start, body[axis] - MARGIN_PX), body[2 + axis] + MARGIN_PX - extent)
        out.append((int(min(max(0, round(start)), side - extent)), extent))
    return (out[0][0], out[1][0], out[0][1], out[1][1])
