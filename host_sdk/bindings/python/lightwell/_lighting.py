"""How a place is lit, at one moment."""

from dataclasses import fields

import numpy as np

from ._abi import check, ffi, lib, take, text
from ._conventions import Conversions
from ._values import (Answer, Derivation, Environment, EnvironmentLevel, Flag, Light, LightingInfo, Units, Validity)

_ENUMS = {"validity": Validity, "units": Units, "flags": Flag, "derivation": Derivation}


def _floats(array):
    return ffi.from_buffer("float[]", array)


def _directions(given, what):
    """(..., 3) of float32, one behind the other."""
    # What is too large for a float becomes infinite, and is refused like any other infinity: no warning is wanted.
    with np.errstate(over="ignore"):
        array = np.asarray(given, dtype=np.float32)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"{what}: the shape is {array.shape}; it is (3,) or (..., 3)")
    return np.ascontiguousarray(array)


def record(kind, struct, **more):
    """The dataclass `kind` from a struct whose fields have the same names, and from `more`."""
    values = dict(more)
    for field in fields(kind):
        if field.name not in values:
            value = getattr(struct, field.name)
            values[field.name] = _ENUMS[field.name](value) if field.name in _ENUMS else value
    return kind(**values)


class Lighting(Conversions):
    """An answer of Probe.latest(), Probe.at() or Probe.wait_for_next(), or of decode().

    It does not follow the probe: ask the Probe again for the next. Any number of threads may ask one at once, while
    none hands it to Probe.latest(into=...). Directions and normals are in the probe's frame (right-handed, +X right,
    +Y up, -Z forward, as OpenXR) unless it was rotated(); they need not be of length one. Colours are linear Rec. 709,
    D65; luminance is in lux of irradiance and in cd/m² of radiance where units are absolute.
    """

    def __init__(self):
        out = ffi.new("lw_lighting **")
        check(lib.lw_lighting_create(out))
        self._raw = ffi.gc(out[0], lib.lw_lighting_release)

    @classmethod
    def decode(cls, message, age_ns=0):
        """The light of a LightingDescriptor's bytes that came by other ways than a Probe. Stale above 250 ms."""
        out = cls()
        check(lib.lw_lighting_decode(ffi.from_buffer(message), len(message), age_ns, out._raw))
        return out

    def copy(self):
        out = Lighting()
        check(lib.lw_lighting_copy(self._raw, out._raw))
        return out

    def rotated(self, quaternion):
        """The same light in a frame turned by (x, y, z, w), p_new = q p_old: of T_world_probe to light a world."""
        q = np.ascontiguousarray(quaternion, dtype=np.float64)
        if q.shape != (4,):
            raise ValueError(f"quaternion: the shape is {q.shape}; it is (4,): x, y, z, w")
        out = Lighting()
        check(lib.lw_lighting_rotated(self._raw, ffi.from_buffer("double[]", q), out._raw))
        return out

    def info(self):
        """LightingInfo: validity, age, times, bound, flags."""
        struct = take("lw_lighting_info")
        check(lib.lw_lighting_get_info(self._raw, struct))
        return record(LightingInfo, struct, reason=self.reason)

    @property
    def validity(self):
        return self.info().validity

    @property
    def age_ns(self):
        return self.info().age_ns

    @property
    def reason(self):
        """Why it is not valid, with numbers; empty where it is."""
        return text(lambda memory, capacity, length: lib.lw_lighting_reason(self._raw, memory, capacity, length))

    def irradiance(self, normals):
        """Answer of flat receivers that face `normals`, (3,) or (..., 3). Not divided by pi, not clamped."""
        questions = _directions(normals, "normals")
        values = np.empty_like(questions)
        about = take("lw_answer")
        check(
            lib.lw_lighting_irradiance_batch(
                self._raw, _floats(questions), 0, questions.size // 3, _floats(values), 0, about
            )
        )
        return self._answer(about, values)

    def radiance(self, directions, roughness):
        """Answer of surfaces of a perceptual roughness (alpha = roughness²) whose mirror direction is `directions`,
        (3,) or (..., 3). At roughness 0 the discrete lights are left out."""
        questions = _directions(directions, "directions")
        values = np.empty_like(questions)
        about = take("lw_answer")
        check(lib.lw_lighting_radiance_batch(self._raw, _floats(questions), 0, questions.size // 3, roughness,
                                             _floats(values), 0, about))
        return self._answer(about, values)

    @staticmethod
    def _answer(about, values):
        reason = ffi.string(about.reason).decode()
        return record(Answer, about, value=values, reason=reason, lights_included=about.lights_included != 0)

    def radiance_coefficients(self, max_band=None):
        """Spherical harmonics of the radiance without the lights, float32 ((band + 1)², 3): real, orthonormal, no
        Condon-Shortley phase, in the order l(l+1)+m. max_band: of the lighting's own band where None, else exactly
        that many, cut or filled up with zeros."""
        return self._coefficients(lib.LW_RADIANCE, max_band)

    def irradiance_coefficients(self, max_band=None):
        """The same convolved with the cosine: evaluate it at a normal, and add the lights."""
        return self._coefficients(lib.LW_IRRADIANCE, max_band)

    def _coefficients(self, quantity, max_band):
        band = ffi.new("int32_t *")
        if max_band is None:
            one = np.empty(3, np.float32)
            check(lib.lw_lighting_harmonics(self._raw, quantity, 0, _floats(one), band))
            max_band = band[0]
        if not 0 <= max_band <= lib.LW_MAX_BAND:
            raise ValueError(f"max_band is {max_band}; it is 0 to {lib.LW_MAX_BAND}")
        out = np.empty(((max_band + 1) ** 2, 3), np.float32)
        check(lib.lw_lighting_harmonics(self._raw, quantity, max_band, _floats(out), band))
        return out

    def lights(self):
        """A list of Light, strongest first."""
        count = ffi.new("size_t *")
        lights = ffi.new("lw_light[]", lib.LW_MAX_LIGHTS)
        check(lib.lw_lighting_lights(self._raw, lights, ffi.sizeof("lw_light"), lib.LW_MAX_LIGHTS, count))

        def triple(values):
            return np.array(list(values), np.float32)

        return [Light(triple(l.direction), triple(l.irradiance), l.angular_radius, triple(l.direction_covariance),
                      l.track) for l in lights[0:count[0]]]

    def environment(self):
        """Environment, the map for reflections, or None where the probe sends none."""
        struct = take("lw_environment")
        check(lib.lw_lighting_environment(self._raw, struct))
        if struct.level_count == 0:
            return None
        levels = []
        for k in range(struct.level_count):
            edge = struct.edge[k]
            rgb = np.empty((edge, edge, 3), np.float32)
            check(lib.lw_lighting_environment_radiance(self._raw, k, _floats(rgb), rgb.size))
            levels.append(EnvironmentLevel(struct.roughness[k], rgb))
        return Environment(tuple(levels), struct.sequence, struct.older_by_ns,
                           np.array(list(struct.rotation), np.float64), struct.key)
