"""Light that varies in space, from several probes. Meanings: field.hpp."""

import ctypes
import time
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Tuple

import numpy as np

from ._abi import Handle, check, lib, memory, take, text
from ._lighting import Lighting
from ._values import Flag, Units, Validity


class FieldFlag(IntFlag):
    """Why an answer of a field may be wrong, or how it was derived."""

    ONE_PROBE = 1 << 0  # Nothing shows how the light changes.
    FAR_FROM_PROBES = 1 << 1
    CONTRADICTION = 1 << 2  # Probes close together measured different light.
    AT_LIGHT = 1 << 3  # The point is in a light, or within the uncertainty of its place.
    OCCLUSION_UNKNOWN = 1 << 4  # Some of the probes do not see a strong light.


class FieldProbeState(IntEnum):
    """What a field makes of a probe's sample."""

    USED = 0
    STALE = 1  # Used, but old.
    EXPIRED = 2  # Too old: takes no part, as in the states from here to WRONG_SCALE.
    WRONG_CLOCK = 3
    WRONG_POSE = 4
    WRONG_SCALE = 5
    CONTRADICTED = 6  # Used, but a probe close by measured another light.


@dataclass(frozen=True)
class FieldLight:
    """A light that several probes saw, or whose distance one measured. What a distant one lacks is zero."""

    id: int
    placed: bool
    probes: int
    position: np.ndarray             # (3,), m
    position_covariance: np.ndarray  # (3, 3), m²
    direction: np.ndarray            # (3,), unit, towards a distant light
    direction_sigma: float           # rad
    intensity: np.ndarray            # (3,); placed: irradiance times m²; distant: irradiance
    intensity_gradient: np.ndarray   # (3, 3): row i for x, y, z
    radius: float                    # placed: m; distant: rad


@dataclass(frozen=True)
class FieldProbe:
    name: str
    state: FieldProbeState
    reason: str  # Empty if the state is USED.
    position: np.ndarray  # (3,), m
    scale: float  # Factor on its light that brings it to the common scale.
    lights: int
    matched: int
    ambiguous: int


@dataclass(frozen=True)
class FieldState:
    """The result of an update."""

    lights: Tuple[FieldLight, ...]
    probes: Tuple[FieldProbe, ...]
    units: Units
    updates: int


@dataclass(frozen=True)
class FieldAnswer:
    """The light at a point: a Lighting in the field's axes, and what the field says of it."""

    light: Lighting
    validity: Validity
    age_ns: int
    error_bound: float  # At 95 %; infinite without a bound.
    flags: Flag
    field_flags: FieldFlag
    nearest_probe: float  # m; infinite without probes.


@dataclass(frozen=True)
class FieldIrradiance:
    """Irradiance of many receivers; every array has their shape (...)."""

    value: np.ndarray  # float32 (..., 3); zero where validity is neither VALID nor STALE
    validity: np.ndarray  # int32, numbers of Validity
    age_ns: np.ndarray
    error_bound: np.ndarray  # float32
    flags: np.ndarray  # uint32, bits of Flag
    field_flags: np.ndarray  # uint32, bits of FieldFlag
    nearest_probe: np.ndarray


def _points(given, dtype, what):
    with np.errstate(over="ignore"):
        array = np.asarray(given, dtype=dtype)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"{what}: the shape is {array.shape}; it is (3,) or (..., 3)")
    return array


def _exactly(given, dtype, shape, what):
    array = np.ascontiguousarray(given, dtype=dtype)
    if array.shape != shape:
        raise ValueError(f"{what}: the shape is {array.shape}; it is {shape}")
    return array


def _now(now_ns):
    return time.monotonic_ns() if now_ns is None else now_ns


class LightField:
    """The light between several probes, or places of one that is moved. One thread at a time changes it; any number of
    threads query it meanwhile. Positions are in metres, in a world of your choice (right-handed, +Y up). Times are
    those of time.monotonic_ns(); None: now. Error with FAILED_PRECONDITION where the library has no light field."""

    def __init__(self, *, max_age_ns=0, drop_age_ns=0, typical_distance=0):
        """0: the defaults of FieldOptions, 1 s, 60 s and 3 m."""
        options = take("lw_light_field_options")
        options.max_age_ns, options.drop_age_ns, options.typical_distance = max_age_ns, drop_age_ns, typical_distance
        self._raw = Handle(lib.lw_light_field_create, lib.lw_light_field_release, options)

    def set(self, name, lighting, position, orientation=(0, 0, 0, 1), *, position_sigma=0, orientation_sigma=0,
            mid_exposure_ns=0):
        """Adds or replaces the sample of a probe, from the next update() on. lighting: of Probe.latest() or
        Lighting.decode(), in the probe's frame. position, orientation (x, y, z, w): T_world_probe, with standard
        deviations in m and rad. mid_exposure_ns: 0 for that of the lighting, which a decoded one does not have."""
        sample = take("lw_light_field_sample")
        sample.position[0:3] = _exactly(position, np.float64, (3,), "position").tolist()
        sample.orientation[0:4] = _exactly(orientation, np.float64, (4,), "orientation").tolist()
        sample.position_sigma, sample.orientation_sigma = position_sigma, orientation_sigma
        sample.mid_exposure_ns = mid_exposure_ns
        encoded = name.encode()
        check(lib.lw_light_field_set(self._raw, encoded, len(encoded), lighting._raw, sample))

    def remove(self, name):
        """From the next update() on. Error with NOT_FOUND if there is none of that name."""
        encoded = name.encode()
        check(lib.lw_light_field_remove(self._raw, encoded, len(encoded)))

    def set_geometry(self, vertices, indices):
        """Walls, or a scan: vertices (n, 3), m, and triangles (m, 3), from the next update() on; none removes it."""
        points = np.ascontiguousarray(np.reshape(vertices, (-1, 3)), np.float32)
        triangles = np.ascontiguousarray(np.reshape(indices, (-1, 3)), np.uint32)
        check(lib.lw_light_field_set_geometry(self._raw, memory(points), 0, len(points), memory(triangles),
                                              triangles.size))

    def update(self, now_ns=None):
        """Places the lights of all samples anew, for the queries that follow. FieldState. Milliseconds."""
        state = take("lw_light_field_state")
        check(lib.lw_light_field_update(self._raw, _now(now_ns), state))
        probes = self._structs(lib.lw_light_field_probes, "lw_light_field_probe", state.probe_count)
        return FieldState(
            tuple(self._light(l) for l in self._structs(lib.lw_light_field_lights, "lw_light_field_light",
                                                        state.light_count)),
            tuple(self._probe(i, p) for i, p in enumerate(probes)), Units(state.units), state.updates)

    def at(self, position, now_ns=None):
        """FieldAnswer: the light at a point (3,)."""
        light, about = Lighting(), take("lw_light_field_answer")
        point = _exactly(position, np.float64, (3,), "position")
        check(lib.lw_light_field_at(self._raw, memory(point), _now(now_ns), light._raw, about))
        return FieldAnswer(light, Validity(about.validity), about.age_ns, about.error_bound, Flag(about.flags),
                           FieldFlag(about.field_flags), about.nearest_probe)

    def irradiance(self, positions, normals, now_ns=None):
        """FieldIrradiance of flat receivers at positions (..., 3) that face normals (..., 3), which are broadcast
        against each other: positions[:, None] and normals[None] give every pair, at the cost of one query a position.
        Not divided by pi, not clamped."""
        places, facing = np.broadcast_arrays(_points(positions, np.float64, "positions"),
                                             _points(normals, np.float32, "normals"))
        places, facing = np.ascontiguousarray(places), np.ascontiguousarray(facing)
        shape = places.shape[:-1]
        values = np.empty(places.shape, np.float32)
        kind = lib.structs["lw_light_field_answer"]
        answers = np.empty(shape, np.dtype(kind))
        check(lib.lw_light_field_irradiance(self._raw, memory(places), 0, memory(facing), 0, answers.size, _now(now_ns),
                                            memory(values), 0, answers.ctypes.data_as(ctypes.POINTER(kind)),
                                            ctypes.sizeof(kind)))
        columns = ("validity", "age_ns", "error_bound", "flags", "field_flags", "nearest_probe")
        return FieldIrradiance(values, *(np.ascontiguousarray(answers[name]) for name in columns))

    def _structs(self, function, struct, count):
        kind = lib.structs[struct]
        found = (kind * count)()
        number = ctypes.c_size_t()
        check(function(self._raw, found, ctypes.sizeof(kind), count, ctypes.byref(number)))
        return found

    def _probe(self, index, probe):
        name, reason = (text(lambda *buffer, kind=kind: lib.lw_light_field_probe_text(self._raw, index, kind, *buffer))
                        for kind in (lib.LW_LIGHT_FIELD_NAME, lib.LW_LIGHT_FIELD_REASON))
        return FieldProbe(name, FieldProbeState(probe.state), reason, np.array(list(probe.position)), probe.scale,
                          probe.lights, probe.matched, probe.ambiguous)

    @staticmethod
    def _light(light):
        xx, xy, xz, yy, yz, zz = light.position_covariance
        return FieldLight(light.id, light.placed != 0, light.probes, np.array(list(light.position)),
                          np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]),
                          np.array(list(light.direction), np.float32), light.direction_sigma,
                          np.array(list(light.intensity), np.float32),
                          np.array(list(light.intensity_gradient), np.float32).reshape(3, 3), light.radius)
