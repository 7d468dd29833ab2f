"""The light in the few numbers that AR platforms' light estimation gives. Meanings: light_estimate.hpp."""

import ctypes
from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from ._abi import check, lib, memory, take
from ._values import Validity


class LightRequest(IntFlag):
    """What an application wants to know, with the numbers of AR Foundation's LightEstimation."""

    NONE = 0
    AMBIENT_INTENSITY = 1
    AMBIENT_COLOR = 2
    AMBIENT_SPHERICAL_HARMONICS = 4
    MAIN_LIGHT_DIRECTION = 8
    MAIN_LIGHT_INTENSITY = 16
    ALL = 31


@dataclass(frozen=True)
class LightEstimate:
    """None where a value was not requested or there is none. Arrays are float32."""

    validity: Validity
    available: LightRequest
    ambient_lumens: float          # 1000 * mean_illuminance / neutral_illuminance
    mean_illuminance: float        # over all orientations, lux
    color_temperature: float       # K; None where it has no meaning
    duv: float                     # distance from the Planckian locus
    ambient_color: np.ndarray      # (3,), largest channel 1
    ambient_spherical_harmonics: np.ndarray  # (9, 3), radiance, all signs positive
    main_light_direction: np.ndarray  # (3,), towards the light
    main_light_color: np.ndarray   # (3,), largest channel 1
    main_light_lumens: float


def color_temperature(rgb):
    """(kelvin, Duv) of a linear Rec. 709 colour; None where a colour temperature has no meaning."""
    color = np.ascontiguousarray(rgb, np.float32)
    if color.shape != (3,):
        raise ValueError(f"rgb: the shape is {color.shape}; it is (3,)")
    kelvin, duv = ctypes.c_double(), ctypes.c_double()
    check(lib.lw_color_temperature(memory(color), ctypes.byref(kelvin), ctypes.byref(duv)))
    return (kelvin.value, duv.value) if kelvin.value > 0 else None


def fade_weight(age_ns, hold_ns=250_000_000, fade_ns=500_000_000):
    """1 up to the age hold_ns, 0 after hold_ns + fade_ns, smooth between them. Error for negative times."""
    weight = ctypes.c_float()
    check(lib.lw_fade_weight(age_ns, hold_ns, fade_ns, ctypes.byref(weight)))
    return weight.value


class Estimates:
    """Methods of Lighting."""

    def estimate(self, requested=LightRequest.ALL, *, gain=1, neutral_illuminance=1000):
        """A LightEstimate. gain: factor on all light. neutral_illuminance: lux that are 1000 "lumens". Error for a gain
        or an illuminance that is not above 0 and finite."""
        options = take("lw_light_estimate_options")
        options.requested, options.gain, options.neutral_illuminance = requested, gain, neutral_illuminance
        out = take("lw_light_estimate")
        check(lib.lw_lighting_estimate(self._raw, options, out))
        available = LightRequest(out.available)

        def known(part, value):
            return value if part in available else None

        def array(field):
            return np.array(list(field), np.float32)

        intensity, color = LightRequest.AMBIENT_INTENSITY, LightRequest.AMBIENT_COLOR
        main = LightRequest.MAIN_LIGHT_INTENSITY
        return LightEstimate(
            Validity(out.validity), available, known(intensity, out.ambient_lumens),
            known(intensity, out.mean_illuminance),
            out.color_temperature if out.color_temperature > 0 else None,
            out.duv if out.color_temperature > 0 else None,
            known(color, array(out.ambient_color)),
            known(LightRequest.AMBIENT_SPHERICAL_HARMONICS, array(out.ambient_spherical_harmonics).reshape(9, 3)),
            known(LightRequest.MAIN_LIGHT_DIRECTION, array(out.main_light_direction)),
            known(main, array(out.main_light_color)), known(main, out.main_light_lumens))

    def fade_weight(self, hold_ns=250_000_000, fade_ns=500_000_000):
        """fade_weight() of this lighting's age; 0 without light."""
        weight = ctypes.c_float()
        check(lib.lw_lighting_fade_weight(self._raw, hold_ns, fade_ns, ctypes.byref(weight)))
        return weight.value
