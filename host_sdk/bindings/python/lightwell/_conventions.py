"""Conversions to other engines' lighting types. Fields are documented at the types of conventions.hpp."""

import ctypes
from enum import IntEnum
from types import SimpleNamespace

import numpy as np

from ._abi import check, lib, take
from ._values import Validity


class ShSigns(IntEnum):
    """Sign convention of the nine basis functions: odd m negative, as in ARCore, or all positive, as in three.js."""

    CONDON_SHORTLEY = 0
    POSITIVE = 1


class MainLight(IntEnum):
    """How the strongest light is represented, for targets that allow both."""

    APART = 0
    IN_HARMONICS = 1


class UnityPipeline(IntEnum):
    """Unit of a Unity light's intensity: irradiance over pi in the built-in pipeline and URP, lux in HDRP."""

    UNIVERSAL = 0
    HIGH_DEFINITION = 1


class ThreeLights(IntEnum):
    """Factor that three.js applies to direct light: 1 from r155 on, pi if useLegacyLights is true."""

    PHYSICAL = 0
    LEGACY = 1


class Residual(IntEnum):
    """Whether a conversion computes its representation error, which costs more than the conversion."""

    MEASURED = 0
    LEFT_OUT = 1


class OpenXrHarmonics(IntEnum):
    """Harmonics including or excluding the main light."""

    TOTAL = 0
    AMBIENT = 1


def _value(field):
    return np.array(list(field), np.float32) if isinstance(field, ctypes.Array) else field


class Conversions:
    """Conversion methods of Lighting. Each returns the target's fields, named as in the target, arrays as float32, with
    `validity` and `residual`: the relative irradiance error due to what the target cannot represent, None if it was not
    computed. color, (3, 3): matrix applied to every colour, for the target's unit, exposure and white point. Transform
    the lighting to the application's world first (rotated)."""

    def _convert(self, target, *choices, color, residual):
        options = take("lw_conversion_options")
        if color is not None:
            matrix = np.asarray(color, np.float32)
            if matrix.shape != (3, 3):
                raise ValueError(f"color: the shape is {matrix.shape}; it is (3, 3)")
            options.color[:] = matrix.reshape(9).tolist()
        options.residual = residual
        out = take(f"lw_{target}")
        check(getattr(lib, f"lw_lighting_to_{target}")(self._raw, *choices, options, out))
        fields = {name: _value(getattr(out, name)) for name, _ in out._fields_ if name != "size"}
        fields["validity"] = Validity(out.validity)
        fields["residual"] = None if out.residual < 0 else out.residual
        return SimpleNamespace(**fields)

    def to_webxr(self, signs=ShSigns.CONDON_SHORTLEY, *, color=None, residual=Residual.MEASURED):
        """XRLightEstimate."""
        return self._convert("webxr", signs, color=color, residual=residual)

    def to_arcore(self, *, color=None, residual=Residual.MEASURED):
        """com.google.ar.core.LightEstimate, Environmental HDR."""
        return self._convert("arcore", color=color, residual=residual)

    def to_openxr(self, kind, signs=ShSigns.CONDON_SHORTLEY, *, color=None, residual=Residual.MEASURED):
        """XR_ANDROID_light_estimation."""
        return self._convert("openxr", kind, signs, color=color, residual=residual)

    def to_arkit(self, *, color=None, residual=Residual.MEASURED):
        """ARDirectionalLightEstimate."""
        return self._convert("arkit", color=color, residual=residual)

    def to_unity(self, pipeline, main_light=MainLight.APART, *, color=None, residual=Residual.MEASURED):
        """SphericalHarmonicsL2 and a directional Light."""
        return self._convert("unity", pipeline, main_light, color=color, residual=residual)

    def to_three(self, lights=ThreeLights.PHYSICAL, main_light=MainLight.APART, *, color=None,
                 residual=Residual.MEASURED):
        """LightProbe and DirectionalLight of three.js."""
        return self._convert("three", lights, main_light, color=color, residual=residual)

    def to_filament(self, main_light=MainLight.APART, *, color=None, residual=Residual.MEASURED):
        """IndirectLight and a light of LightManager."""
        return self._convert("filament", main_light, color=color, residual=residual)

    def to_unreal(self, main_light=MainLight.APART, *, color=None, residual=Residual.MEASURED):
        """FSHVectorRGB3 and a directional light."""
        return self._convert("unreal", main_light, color=color, residual=residual)
