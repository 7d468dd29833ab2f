"""Trials of a virtual object beside a real one: lamps, room, camera and places of the probe. Standard library alone.

World: right-handed, metres, +Y up; the table is y = 0, and the object stands in the origin. An azimuth is that of
(sin a, 0, cos a): 0 towards the camera, 90 to its right.
"""

import hashlib
import math
from dataclasses import asdict, dataclass

OBJECT_HEIGHT_M, OBJECT_DIAMETER_M = 0.078, 0.03  # a cylinder, as tall as the object of CubeMap360 (Table I)
OBJECT_ALBEDO = (0.5, 0.46, 0.4)
TABLE_M, TABLE_ALBEDO = (1.2, 0.9), (0.52, 0.5, 0.46)
TAG_ID, TAG_SIZE_M, TAG_PLACE = 0, 0.06, (-0.3, 0.05)  # tag36h11; edge of the black border; x, z of its centre
FLOOR_Y = -0.75
CAMERA = {"width": 1280, "height": 960, "fx": 1100.0, "fy": 1100.0, "cx": 639.5, "cy": 479.5}
CAMERA_DISTANCE_M, CAMERA_ELEVATION_DEG, CAMERA_TARGET = 0.75, 55.0, (0.0, 0.02, 0.0)
PROBE_TOP = (0.0, OBJECT_HEIGHT_M, 0.0)
PROBE_AWAY_M = 1.0
FAR_M = 60.0
LAMP_IRRADIANCE = 10.0  # luminance, of a surface at the object's top that faces the lamp

# CubeMap360, Table I: shadow lengths in m and the column "Measured", taken as azimuths.
SEED_TRIALS = ((0.06, -127.56), (0.15, 27.47), (0.18, 203.42))
DRAWN = 20
CLASSES = tuple((distance, width) for width in ("small", "wide") for distance in (1.0, 3.0, FAR_M))
# Diameter, m. Of far lamps: so that their angular radii are 0.25 to 0.5 and 1 to 2 degrees.
DIAMETERS = {"small": (0.02, 0.06), "wide": (0.1, 0.3)}
FAR_RADII_DEG = {"small": (0.25, 0.5), "wide": (1.0, 2.0)}


def number(key: str, low: float, high: float) -> float:
    """Uniform, a function of the key."""
    value = int.from_bytes(hashlib.sha256(key.encode()).digest()[:8], "big") / 2**64
    return low + (high - low) * value


def direction(azimuth_deg: float, elevation_deg: float) -> tuple[float, float, float]:
    a, e = math.radians(azimuth_deg), math.radians(elevation_deg)
    return math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)


@dataclass(frozen=True)
class Trial:
    name: str
    azimuth_deg: float    # of the lamp's centre, from the object's top
    elevation_deg: float
    distance_m: float     # from there
    width: str            # "small" or "wide"
    radius_m: float
    color: tuple          # of the lamp, luminance 1
    ambient_share: float  # of the sky: irradiance of the table per that of the lamp at normal incidence
    room_azimuth_deg: float
    away_azimuth_deg: float

    def to_lamp(self):
        return direction(self.azimuth_deg, self.elevation_deg)

    def lamp(self):
        return tuple(p + self.distance_m * d for p, d in zip(PROBE_TOP, self.to_lamp()))

    def lamp_radiance(self):
        sine = self.radius_m / self.distance_m
        return tuple(LAMP_IRRADIANCE * c / (math.pi * sine * sine) for c in self.color)

    def probe_away(self):
        a = math.radians(self.away_azimuth_deg)
        return PROBE_AWAY_M * math.sin(a), OBJECT_HEIGHT_M, PROBE_AWAY_M * math.cos(a)

    def shadow_m(self):
        """Length of the shadow of the object's axis."""
        return OBJECT_HEIGHT_M / math.tan(math.radians(self.elevation_deg))


def hidden(azimuth_deg: float, elevation_deg: float) -> bool:
    """Whether the object hides the tip of its shadow from the camera."""
    behind = math.cos(math.radians(azimuth_deg)) > math.cos(math.radians(40))
    return behind and OBJECT_HEIGHT_M / math.tan(math.radians(elevation_deg)) < 0.08


def trial(index: int) -> Trial:
    name, distance, width = f"{index:02d}", *CLASSES[index % len(CLASSES)]
    if index < len(SEED_TRIALS):
        shadow, azimuth = SEED_TRIALS[index]
        elevation = math.degrees(math.atan(OBJECT_HEIGHT_M / shadow))
    else:
        attempt = 0
        while True:
            azimuth = number(f"{name}.{attempt}.azimuth", 0, 360)
            elevation = number(f"{name}.{attempt}.elevation", 20, 65)
            if not hidden(azimuth, elevation):
                break
            attempt += 1
    if distance == FAR_M:
        radius = FAR_M * math.sin(math.radians(number(f"{name}.radius", *FAR_RADII_DEG[width])))
    else:
        radius = number(f"{name}.radius", *DIAMETERS[width]) / 2
    warm = number(f"{name}.warm", -0.25, 0.25)
    color = (1 + warm, 1.0, 1 - warm)
    luminance = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2]
    return Trial(name, azimuth, elevation, distance, width, radius, tuple(c / luminance for c in color),
                 number(f"{name}.ambient", 0.15, 0.4), azimuth + 180 + number(f"{name}.room", -30, 30),
                 number(f"{name}.away", 0, 360))


def trials() -> list[Trial]:
    return [trial(i) for i in range(len(SEED_TRIALS) + DRAWN)]


def camera_axes():
    """Position, right, up and back of the camera in the world."""
    back = direction(0.0, CAMERA_ELEVATION_DEG)
    e = math.radians(CAMERA_ELEVATION_DEG)
    position = tuple(t + CAMERA_DISTANCE_M * b for t, b in zip(CAMERA_TARGET, back))
    return position, (1.0, 0.0, 0.0), (0.0, math.cos(e), -math.sin(e)), back


def camera_pose() -> dict:
    """T_world_camera: a rotation about +X that tips the camera down."""
    half = -math.radians(CAMERA_ELEVATION_DEG) / 2
    return {"position": list(camera_axes()[0]), "rotation": [math.sin(half), 0.0, 0.0, math.cos(half)]}


def truth(t: Trial) -> dict:
    """A line of trials.jsonl."""
    return asdict(t) | {"lamp": list(t.lamp()), "lamp_radiance": list(t.lamp_radiance()),
                        "probe_top": list(PROBE_TOP), "probe_away": list(t.probe_away()), "shadow_m": t.shadow_m()}


def setup() -> dict:
    """Content of setup.json: what all trials share."""
    return {"camera": CAMERA, "T_world_camera": camera_pose(), "object_height_m": OBJECT_HEIGHT_M,
            "object_diameter_m": OBJECT_DIAMETER_M, "object_albedo": list(OBJECT_ALBEDO), "table_m": list(TABLE_M),
            "table_albedo": list(TABLE_ALBEDO),
            "tag": {"family": "tag36h11", "id": TAG_ID, "size_m": TAG_SIZE_M,
                    "position": [TAG_PLACE[0], 0.0, TAG_PLACE[1]]}}
