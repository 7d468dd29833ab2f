"""The scenes: objects, lamps and camera of each frame, and the ground truth in the probe's axes. Needs numpy alone.

    FRAMES          every frame, in the order in which they are rendered
    truth(frame)    what scenes.json says of it

The scenes' world: right-handed, metres, origin in the body's centre, +Y up, the camera on the side of +Z. Azimuths are
from +Z towards +X, which is the camera's right: 0 in front of the body, 90 on its right, 180 behind it. The probe is
the camera: x right, y up, z back. Radiance is relative: a matte, white (albedo 1) surface that faces a lamp of
`brightness` 1 from the body's centre has radiance 1.
"""

from dataclasses import dataclass

import numpy as np

import dodecahedron as body
from dodecahedron import unit

BOARD_SIZE, BOARD_ALBEDO = (0.71, 0.56), 0.05
# The body's lowest face and the board share a plane; a gap that no pixel can see keeps them apart for the tracer.
BOARD_HEIGHT = -body.INRADIUS - 2e-5
LAMP_RADIUS = 0.02
AMBIENT = 0.08  # Radiance of everything around: its irradiance is 8 % of that of a lamp of brightness 1.
ELEVATION = np.degrees(body.RING_ELEVATION)
GREY = (1.0, 1.0, 1.0)
WARM, COOL = (1.0, 0.7, 0.4), (0.5, 0.75, 1.0)
PLACES = {"front": 0, "front_right": 45, "right": 90, "back_right": 135, "behind": 180}


@dataclass(frozen=True)
class Camera:
    """A pinhole whose line to the body's centre rises by `elevation_deg`. It looks `drop` metres below the centre."""
    elevation_deg: float = ELEVATION
    distance: float = 0.55
    focal_px: float = 800.0
    width: int = 640
    height: int = 480
    drop: float = 0.042

    def axes(self) -> np.ndarray:
        """(4, 4): T_world_probe."""
        e = np.radians(self.elevation_deg)
        place = self.distance * np.array([0, np.sin(e), np.cos(e)])
        forward = unit(-self.drop * np.array([0, np.cos(e), -np.sin(e)]) - place)
        right = unit(np.cross(forward, (0, 1, 0)))
        out = np.eye(4)
        out[:3, 0], out[:3, 1], out[:3, 2], out[:3, 3] = right, np.cross(right, forward), -forward, place
        return out

    def project(self, points_probe: np.ndarray) -> np.ndarray:
        """Pixels; the centre of the top left one is (0, 0)."""
        p = np.asarray(points_probe, float)
        centre = np.array([(self.width - 1) / 2, (self.height - 1) / 2])
        return centre + self.focal_px * p[..., :2] * (1, -1) / -p[..., 2:]


@dataclass(frozen=True)
class Lamp:
    """A spherical lamp of uniform radiance."""
    azimuth_deg: float
    elevation_deg: float
    distance: float
    color: tuple[float, float, float] = GREY
    brightness: float = 1.0
    radius: float = LAMP_RADIUS

    def position(self) -> np.ndarray:
        a, e = np.radians([self.azimuth_deg, self.elevation_deg])
        return self.distance * np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])

    def irradiance(self) -> np.ndarray:
        """At the body's centre, at normal incidence."""
        return np.pi * self.brightness * np.array(self.color)

    def radiance(self) -> np.ndarray:
        return self.irradiance() / (np.pi * (self.radius / self.distance) ** 2)


@dataclass(frozen=True)
class Frame:
    name: str
    group: str
    variant: str
    turn_deg: float  # of the body about +Y
    lamps: tuple[Lamp, ...] = ()
    board: bool = True
    camera: Camera = Camera()
    panorama: str = ""            # its file's name without .exr
    light_azimuth_deg: float = 0  # where the panorama is turned to have its strongest light
    # Further grey objects in world coordinates: (kind, numbers). "cylinder": two ends and a radius; "sphere": centre
    # and radius.
    things: tuple = ()
    lamp_visible: bool = False
    covered: tuple[int, ...] = ()  # faces that an object hides in part

    @property
    def color(self) -> bool:
        return bool(self.panorama) or any(lamp.color != GREY for lamp in self.lamps)

    def world_body(self) -> np.ndarray:
        t, out = np.radians(self.turn_deg), np.eye(4)
        out[:3, :3] = [[np.cos(t), 0, np.sin(t)], [0, 1, 0], [-np.sin(t), 0, np.cos(t)]]
        return out


TURNS = {"straight": 0.0, "turned": 36.0}
THING_ALBEDO = 0.4


def pair(angle: float, middle: float, low: float, high: float) -> tuple[Lamp, Lamp]:
    """Two lamps of different colour, `angle` apart as seen from the body's centre, on either side of the azimuth
    `middle`."""
    a, b = np.radians([low, high])
    between = np.degrees(np.arccos((np.cos(np.radians(angle)) - np.sin(a) * np.sin(b)) / (np.cos(a) * np.cos(b))))
    return Lamp(middle - between / 2, low, 0.61, WARM, 0.7), Lamp(middle + between / 2, high, 0.61, COOL, 0.7)


def grid() -> list[Frame]:
    return [Frame(f"grid_{seen}_{variant}_{place}", "grid", variant, TURNS[seen], (Lamp(azimuth, 35, 0.61),))
            for seen in TURNS for variant in ("white", "grey") for place, azimuth in PLACES.items()]


def low() -> list[Frame]:
    camera = Camera(elevation_deg=10.0, drop=0.02)
    return [
        Frame(
            f"{group}_turned_{variant}_{place}", group, variant, 36.0, (Lamp(PLACES[place], 35, 0.61),), board, camera
        )
        for group, board in (("low", True), ("air", False))
        for variant in ("white", "grey")
        for place in ("back_right", "behind")
    ]


def near_and_far() -> list[Frame]:
    near = [
        ("turned", "white", "front_right"),
        ("straight", "grey", "front_right"),
        ("turned", "grey", "front"),
        ("straight", "white", "right"),
    ]
    far = [("straight", "grey", "front_right"), ("turned", "white", "right")]
    return [
        Frame(f"{group}_{seen}_{variant}_{place}", group, variant, TURNS[seen], (Lamp(PLACES[place], 35, distance),))
        for group, distance, which in (("near", 0.30, near), ("far", 5.0, far))
        for seen, variant, place in which
    ]


def two() -> list[Frame]:
    pairs = {60: pair(60, 10, 40, 30), 90: pair(90, -5, 25, 40), 120: pair(120, 5, 22, 15)}
    which = [
        (60, "straight", "white"),
        (60, "turned", "grey"),
        (90, "straight", "white"),
        (90, "straight", "grey"),
        (90, "turned", "white"),
        (90, "turned", "grey"),
        (120, "straight", "grey"),
        (120, "turned", "white"),
    ]
    return [
        Frame(f"two_{seen}_{variant}_{angle:03d}", "two", variant, TURNS[seen], pairs[angle])
        for angle, seen, variant in which
    ]


def rooms() -> list[Frame]:
    which = [
        ("interior", "white", 0.0, 30.0),
        ("studio", "grey", 36.0, -35.0),
        ("pmndrs_studio", "white", 20.0, 50.0),
        ("pmndrs_apartment", "grey", -15.0, -25.0),
        ("pmndrs_warehouse", "white", 36.0, 150.0),
        ("pmndrs_lab", "grey", 0.0, 20.0),
    ]
    return [Frame(f"room_{name}_{variant}", "room", variant, turn, (), False, Camera(drop=0.0), name, azimuth)
            for name, variant, turn, azimuth in which]


def extras() -> list[Frame]:
    hand = ("cylinder", (-0.09, 0.20, 0.13), (-0.012, -0.049, 0.125), 0.009)
    light = Lamp(-66.0, 28.0, 0.175)
    between = 0.52 * light.position()
    shade = ("sphere", tuple(float(round(q, 4)) for q in between), 0.010)
    big = Camera(focal_px=1600.0, width=1280, height=960)
    return [
        Frame("extra_hand_straight_grey", "extra", "grey", 0.0, (Lamp(45, 35, 0.61),), things=(hand,), covered=(5, 8)),
        Frame("extra_shade_turned_white", "extra", "white", 36.0, (light,), things=(shade,), lamp_visible=True),
        Frame("extra_large_straight_grey", "extra", "grey", 0.0, (Lamp(45, 35, 0.61),), camera=big),
    ]


FRAMES: list[Frame] = [*grid(), *low(), *near_and_far(), *two(), *rooms(), *extras()]


# ---------------------------------------------------------------------------------------------------------------------
# Truth
# ---------------------------------------------------------------------------------------------------------------------
def quaternion(m: np.ndarray) -> list[float]:
    """x, y, z, w (Hamilton), w not negative."""
    values, vectors = np.linalg.eigh(np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
        [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
        [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]]]))
    q = vectors[:, np.argmax(values)]
    assert np.allclose(body.rotation(*q), m, atol=1e-12)
    return [float(v) for v in (q if q[3] >= 0 else -q)]


def probe_body(frame: Frame) -> np.ndarray:
    return np.linalg.inv(frame.camera.axes()) @ frame.world_body()


def to_probe(frame: Frame, point) -> np.ndarray:
    return (np.linalg.inv(frame.camera.axes()) @ np.append(np.asarray(point, float), 1.0))[:3]


def turn_to_probe(frame: Frame, direction) -> np.ndarray:
    return frame.camera.axes()[:3, :3].T @ np.asarray(direction, float)


def facing(frame: Frame) -> np.ndarray:
    """(12,): cosine between each face's normal and the direction to the camera; not positive if it faces away."""
    m = probe_body(frame)
    centre = body.faces()[:, :3, 3] @ m[:3, :3].T + m[:3, 3]
    normal = body.normals() @ m[:3, :3].T
    return -(normal * centre).sum(1) / np.linalg.norm(centre, axis=1)


def body_box(frame: Frame) -> tuple[int, int, int, int]:
    """x, y, width, height of the body in the picture, with a margin."""
    m = probe_body(frame)
    p = frame.camera.project(body.vertices() @ m[:3, :3].T + m[:3, 3])
    low, high = np.floor(p.min(0)).astype(int) - 3, np.ceil(p.max(0)).astype(int) + 4
    return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])


def floats(a) -> list[float]:
    return [round(float(q), 9) + 0.0 for q in np.asarray(a).ravel()]


def truth(frame: Frame) -> dict:
    """All vectors in the probe's axes, metres. Of panoramas, render_marker.py adds what it reads in the file."""
    m, camera = probe_body(frame), frame.camera
    seen = facing(frame)
    out = {
        "file": f"{frame.name}.exr",
        "group": frame.group,
        "channels": "RGB" if frame.color else "Y",
        "body": frame.variant,
        "turn_about_y_deg": frame.turn_deg,
        "camera": {
            "width": camera.width,
            "height": camera.height,
            "fx_px": camera.focal_px,
            "fy_px": camera.focal_px,
            "cx_px": (camera.width - 1) / 2,
            "cy_px": (camera.height - 1) / 2,
            "elevation_deg": round(float(camera.elevation_deg), 6),
            "distance_m": camera.distance,
        },
        "T_probe_body": {"q_xyzw": floats(quaternion(m[:3, :3])), "t_m": floats(m[:3, 3])},
        "up": floats(turn_to_probe(frame, (0, 1, 0))),
        "faces_seen": [{"face": int(i), "cosine": round(float(seen[i]), 4)} for i in np.flatnonzero(seen > 0)],
        "faces_covered": list(frame.covered),
        "lamps": [],
        "ambient_radiance_rgb": floats([AMBIENT] * 3) if frame.lamps else [0.0] * 3,
        "board": None,
        "things": [],
    }
    for lamp in frame.lamps:
        lit = (body.normals() @ frame.world_body()[:3, :3].T) @ unit(lamp.position()) - body.INRADIUS / lamp.distance
        out["lamps"].append(
            {
                "direction": floats(turn_to_probe(frame, unit(lamp.position()))),
                "position_m": floats(to_probe(frame, lamp.position())),
                "distance_m": lamp.distance,
                "azimuth_deg": round(lamp.azimuth_deg, 6),
                "elevation_deg": lamp.elevation_deg,
                "radius_m": lamp.radius,
                "irradiance_rgb": floats(lamp.irradiance()),
                "radiance_rgb": floats(lamp.radiance()),
                "seen_faces_lit": [int(i) for i in np.flatnonzero((seen > 0) & (lit > 0))],
            }
        )
    if frame.board:
        out["board"] = {
            "center_m": floats(to_probe(frame, (0, BOARD_HEIGHT, 0))),
            "normal": floats(turn_to_probe(frame, (0, 1, 0))),
            "x": floats(turn_to_probe(frame, (1, 0, 0))),
            "size_m": list(BOARD_SIZE),
            "albedo": BOARD_ALBEDO,
        }
    for kind, *numbers in frame.things:
        out["things"].append(
            {
                "kind": kind,
                "points_m": [floats(to_probe(frame, p)) for p in numbers[:-1]],
                "radius_m": numbers[-1],
                "albedo": THING_ALBEDO,
            }
        )
    return out
