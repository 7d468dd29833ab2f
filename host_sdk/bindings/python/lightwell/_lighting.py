"""The lighting of one moment."""

import ctypes
from dataclasses import fields

import numpy as np

from ._abi import Handle, chars, check, lib, memory, take, text
from ._conventions import Conversions
from ._estimate import Estimates
from ._values import (Answer, Derivation, Environment, EnvironmentLevel, Flag, Light, LightingInfo, Units, Validity)

_ENUMS = {"validity": Validity, "units": Units, "flags": Flag, "derivation": Derivation}


def _directions(given, what):
    """Directions as a contiguous float32 array of shape (..., 3)."""
    # Values too large for float32 become infinite and are rejected as such; NumPy's warning is suppressed.
    with np.errstate(over="ignore"):
        array = np.asarray(given, dtype=np.float32)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"{what}: the shape is {array.shape}; it is (3,) or (..., 3)")
    return np.ascontiguousarray(array)


def record(kind, struct, **more):
    """An instance of the dataclass `kind`, from the struct's fields of the same names and from `more`."""
    values = dict(more)
    for field in fields(kind):
        if field.name not in values:
            value = getattr(struct, field.name)
            values[field.name] = _ENUMS[field.name](value) if field.name in _ENUMS else value
    return kind(**values)


class Lighting(Conversions, Estimates):
    """The lighting of one moment, from Probe.latest(), Probe.at(), Probe.wait_for_next() or decode().

    It is not updated: get the next one from the Probe. Any number of threads may query it concurrently, as long as none
    passes it to Probe.latest(into=...). Directions and normals are in the probe's frame (right-handed, +X right, +Y up,
    -Z forward, as in OpenXR) unless it was rotated(); they need not be normalised. Colours are linear Rec. 709, D65;
    luminance is in lux for irradiance and in cd/m² for radiance if units are absolute.
    """

    def __init__(self):
        self._raw = Handle(lib.lw_lighting_create, lib.lw_lighting_release)

    @classmethod
    def decode(cls, message, age_ns=0):
        """Decodes the bytes of a LightingDescriptor that was received without a Probe. Stale above 250 ms."""
        out = cls()
        check(lib.lw_lighting_decode(memory(message), len(message), age_ns, out._raw))
        return out

    def copy(self):
        out = Lighting()
        check(lib.lw_lighting_copy(self._raw, out._raw))
        return out

    def rotated(self, quaternion):
        """The lighting rotated about the probe by q = (x, y, z, w), p_new = q p_old; to light a world, q of
        T_world_probe."""
        q = np.ascontiguousarray(quaternion, dtype=np.float64)
        if q.shape != (4,):
            raise ValueError(f"quaternion: the shape is {q.shape}; it is (4,): x, y, z, w")
        out = Lighting()
        check(lib.lw_lighting_rotated(self._raw, memory(q), out._raw))
        return out

    def in_world(self, position, quaternion):
        """The lighting in a world frame: p_new = q p_old + position (m). Also moves the origin and the positions of
        lights."""
        p = np.ascontiguousarray(position, dtype=np.float64)
        q = np.ascontiguousarray(quaternion, dtype=np.float64)
        if p.shape != (3,) or q.shape != (4,):
            raise ValueError(f"position, quaternion: the shapes are {p.shape} and {q.shape}; they are (3,) and (4,)")
        out = Lighting()
        check(lib.lw_lighting_in_world(self._raw, memory(p), memory(q), out._raw))
        return out

    def info(self):
        """LightingInfo: validity, age, times, bound, flags."""
        struct = take("lw_lighting_info")
        check(lib.lw_lighting_get_info(self._raw, struct))
        return record(LightingInfo, struct, reason=self.reason, origin_position=np.array(list(struct.origin_position)),
                      origin_orientation=np.array(list(struct.origin_orientation)))

    @property
    def validity(self):
        return self.info().validity

    @property
    def age_ns(self):
        return self.info().age_ns

    @property
    def reason(self):
        """Why it is not valid, with numbers; empty if it is."""
        return text(lambda *buffer: lib.lw_lighting_reason(self._raw, *buffer))

    def irradiance(self, normals):
        """Irradiance (Answer) of flat receivers that face `normals`, (3,) or (..., 3). Not divided by pi, not
        clamped."""
        return self._answer(lib.lw_lighting_irradiance_batch, _directions(normals, "normals"))

    def radiance(self, directions, roughness):
        """Radiance (Answer) as reflected by surfaces of a perceptual roughness (alpha = roughness²) with the reflection
        directions `directions`, (3,) or (..., 3). At roughness 0 the discrete lights are excluded."""
        return self._answer(lib.lw_lighting_radiance_batch, _directions(directions, "directions"), roughness)

    def _answer(self, batch, questions, *more):
        """The Answer of a function of the C ABI to many questions; `more`: its arguments after their number."""
        values = np.empty_like(questions)
        about = take("lw_answer")
        check(batch(self._raw, memory(questions), 0, questions.size // 3, *more, memory(values), 0, about))
        return record(Answer, about, value=values, reason=chars(about.reason),
                      lights_included=about.lights_included != 0)

    def radiance_coefficients(self, max_band=None):
        """Spherical harmonics of the radiance without the lights, float32 ((band + 1)², 3): real, orthonormal, no
        Condon-Shortley phase, in the order l(l+1)+m. max_band: None for the lighting's own band, else exactly that
        band, truncated or padded with zeros."""
        return self._coefficients(lib.LW_RADIANCE, max_band)

    def irradiance_coefficients(self, max_band=None):
        """The same convolved with the clamped cosine: evaluate it at a normal, and add the lights."""
        return self._coefficients(lib.LW_IRRADIANCE, max_band)

    def _coefficients(self, quantity, max_band):
        band = ctypes.c_int32()
        if max_band is None:
            one = np.empty(3, np.float32)
            check(lib.lw_lighting_harmonics(self._raw, quantity, 0, memory(one), ctypes.byref(band)))
            max_band = band.value
        if not 0 <= max_band <= lib.LW_MAX_BAND:
            raise ValueError(f"max_band is {max_band}; it is 0 to {lib.LW_MAX_BAND}")
        out = np.empty(((max_band + 1) ** 2, 3), np.float32)
        check(lib.lw_lighting_harmonics(self._raw, quantity, max_band, memory(out), ctypes.byref(band)))
        return out

    def lights(self):
        """A list of Light, strongest first."""
        count = ctypes.c_size_t()
        lights = (lib.structs["lw_light"] * lib.LW_MAX_LIGHTS)()
        check(lib.lw_lighting_lights(self._raw, lights, ctypes.sizeof(lights._type_), lib.LW_MAX_LIGHTS,
                                     ctypes.byref(count)))

        def triple(values):
            return np.array(list(values), np.float32)

        def place(l):
            return (l.distance, l.distance_sigma, triple(l.position)) if l.distance > 0 else ()

        return [Light(triple(l.direction), triple(l.irradiance), l.angular_radius, triple(l.direction_covariance),
                      l.track, *place(l)) for l in lights[0:count.value]]

    def environment(self):
        """Environment, the map for reflections, or None if there is none."""
        struct = take("lw_environment")
        check(lib.lw_lighting_environment(self._raw, struct))
        if struct.level_count == 0:
            return None
        levels = []
        for k in range(struct.level_count):
            edge = struct.edge[k]
            rgb = np.empty((edge, edge, 3), np.float32)
            check(lib.lw_lighting_environment_radiance(self._raw, k, memory(rgb), rgb.size))
            levels.append(EnvironmentLevel(struct.roughness[k], rgb))
        return Environment(tuple(levels), struct.sequence, struct.older_by_ns,
                           np.array(list(struct.rotation), np.float64), struct.key)

    def cube_map(self, edge=64, lights=True, scale=1.0, dtype=np.float16):
        """Six faces of radiance, array of shape (6, edge, edge, 4) in the order +X, -X, +Y, -Y, +Z, -Z with the
        orientation of OpenGL, Vulkan and WebGPU: r, g, b, 1. A texel is scale times the mean over its solid angle.
        edge: 1 to 64. lights: whether the discrete lights are included, as caps of uniform radiance. dtype: float16 or
        float32. Values above the range of float16 become 65504."""
        formats = {np.dtype(np.float16): lib.LW_CUBE_RGBA16F, np.dtype(np.float32): lib.LW_CUBE_RGBA32F}
        if np.dtype(dtype) not in formats:
            raise ValueError(f"dtype is {np.dtype(dtype)}; it is float16 or float32")
        if not 1 <= edge <= lib.LW_MAX_CUBE_EDGE:
            raise ValueError(f"edge is {edge}; it is 1 to {lib.LW_MAX_CUBE_EDGE}")
        if not scale > 0:
            raise ValueError(f"scale is {scale}; it is above 0")
        options = take("lw_cube_map_options")
        options.edge, options.format, options.scale = edge, formats[np.dtype(dtype)], scale
        options.lights = lib.LW_CUBE_WITH_LIGHTS if lights else lib.LW_CUBE_WITHOUT_LIGHTS
        out = np.empty((6, edge, edge, 4), dtype)
        check(lib.lw_lighting_cube_map(self._raw, options, memory(out), out.nbytes, None))
        return out
