"""Enumerations and immutable records of captured planes. Meanings: plane_appearance.h."""

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Optional

import numpy as np

from ._values import Flag, Units, Validity


class PlaneLayers(IntEnum):
    """Which parts of the radiance are wanted."""

    ALL = 0
    DIFFUSE = 1  # Without the mirror image of the room: where a virtual object hides it.
    SPECULAR = 2  # The mirror image alone.


class PlaneFlag(IntFlag):
    """Why a radiance may be wrong."""

    UNSEEN_DIRECTION = 1 << 0
    CLIPPED_DIRECTION = 1 << 1
    UNSEEN_TEXEL = 1 << 2
    CLIPPED_TEXEL = 1 << 3


class CaptureProgress(IntEnum):
    """Whether a capture can be ended."""

    KEEP_MOVING = 0
    ENOUGH = 1


@dataclass(frozen=True)
class PlaneInfo:
    """What holds for the whole plane."""

    validity: Validity
    age_ns: int  # Since the newest message.
    revision: int  # Of the newest update; 0: nothing was received, and all that follows is 0 or None.
    missing_tiles: int  # Tiles whose newest content has not arrived.
    capture: int
    texture_edge: int  # Texels along a side; 0: the probe sends no texture.
    mid_exposure_ns: int  # Of the newest frame that contributed, in the probe's clock.
    side: float  # Of the captured square, m.
    texture_position: np.ndarray  # float64 (2,), m: translation of the texture's frame in the plane's,
    texture_rotation: float  # rotation from +X to +Y, rad,
    texture_scale: float  # and scale.
    position: Optional[np.ndarray]  # float64 (3,), m: of T_probe_plane; None: not known.
    orientation: Optional[np.ndarray]  # float64 (4,), x, y, z, w: of T_probe_plane.
    units: Optional[Units]
    gloss_alpha: Optional[float]  # GGX alpha; None: not known.
    f0: Optional[float]  # Specular reflectance at normal incidence; None: not known.


@dataclass(frozen=True)
class PlaneAnswer:
    """Radiance, for each input in the shape of the input array."""

    value: np.ndarray  # float32, (..., 3): r, g, b. 0 where validity is NONE or INVALID_QUERY.
    validity: np.ndarray  # int32, (...): Validity.
    flags: np.ndarray  # uint32, (...): PlaneFlag.


@dataclass(frozen=True)
class PlaneRendering:
    """A picture of the plane. INVALID_QUERY for a camera that is not in front of it."""

    validity: Validity  # Of all pixels together: the worst.
    flags: PlaneFlag  # Of all pixels together.
    pixels: int  # Number of pixels that show the plane.
    flagged: int  # Of these: number of pixels with a flag.
    rgb: np.ndarray  # float32, (height, width, 3), rows from the top.
    pixel_flags: np.ndarray  # uint8, (height, width): PlaneFlag of each pixel.


@dataclass(frozen=True)
class PlaneTexture:
    """The diffuse radiance by texel."""

    validity: Validity  # The worst of all texels.
    rgb: np.ndarray  # float32, (edge, edge, 3), rows from the top; 0 where unseen.
    flags: np.ndarray  # uint8, (edge, edge): PlaneFlag of each texel.


@dataclass(frozen=True)
class PlaneCoverage:
    """Directions towards the viewer, by node of a hemisphere grid."""

    disc: np.ndarray  # float32, (nodes, 2): position x, y on the unit disc, stereographic.
    seen: np.ndarray  # bool, (nodes,)


@dataclass(frozen=True)
class PlaneGuidance:
    """From how many directions the plane was seen, and where to move next. Directions are unit vectors from the plane
    to the viewer, in the plane's frame."""

    progress: CaptureProgress
    seen: float  # Share of the directions that count, 0 to 1.
    gap: float  # Angle from `next` to the nearest seen direction, rad.
    next: Optional[np.ndarray]  # None: all was seen.
    probe: Optional[np.ndarray]  # Where the newest frame that contributed was taken; None: not known, or behind.
    circle: float  # Radius on the unit disc of the circle of directions that count.


@dataclass(frozen=True)
class PlaneReaderStats:
    """Counters of a PlaneReader."""

    messages: int
    refused: int
    tiles: int
    tiles_unused: int


@dataclass(frozen=True)
class ShadowAnswer:
    """The light that an object leaves on a plane. validity, age, error bound and flags are those of the lighting."""

    ratios: np.ndarray  # float32, (rows, columns, 3): 0 to 1, row 0 at +Y.
    validity: Validity
    age_ns: int
    reason: str
    error_bound: float
    flags: Flag
    no_light: bool  # No light reaches the plane, and all ratios are 1.
    ignored_triangles: int  # With a vertex that is NaN, infinite or too far away.


@dataclass(frozen=True)
class PlaneReflection:
    """The reflection of an object in a captured plane."""

    reflected: np.ndarray  # float32, (rows, columns, 3): radiance, row 0 at +Y.
    hidden: np.ndarray  # float32, (rows, columns): share of the specular part that the object hides, 0 to 1.
    validity: Validity  # NONE: a matte plane, or none was received. INVALID_QUERY: the eye is not in front of it.
    f0_assumed: bool  # The probe sends no f0; it is taken as 0.04.
    texels: int  # With a hidden share above 0.001.
    ignored_triangles: int


class PlaneLightSource(IntEnum):
    """What the plane's part of an irradiance was computed from."""

    NONE = 0
    TEXTURE = 1
    DESCRIPTOR = 2  # The probe sends no texture: the lower hemisphere of the lighting.


@dataclass(frozen=True)
class PlaneLightAnswer:
    """An irradiance."""

    value: np.ndarray  # float32, (3,): r, g, b; luminance in lux if units are absolute.
    validity: Validity
    flags: PlaneFlag
    source: PlaneLightSource
