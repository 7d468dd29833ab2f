"""Lightwell for Python: the current lighting at a probe, as NumPy arrays.

    import lightwell

    with lightwell.connect("grpc://probe.local:7420") as probe:
        light = probe.latest()                        # never waits for the network
        answer = light.irradiance([[0, 1, 0]])        # (N, 3) float32 in, (N, 3) float32 out
        if answer.validity == lightwell.Validity.VALID:
            print(answer.value, answer.error_bound)

Frames: right-handed, +X right, +Y up, -Z forward, metres. Colours: linear Rec. 709, D65.
"""

from ._abi import chars as _chars, lib as _lib
from ._conventions import MainLight, OpenXrHarmonics, Residual, ShSigns, ThreeLights, UnityPipeline
from ._estimate import LightEstimate, LightRequest, color_temperature, fade_weight
from ._field import (FieldAnswer, FieldFlag, FieldIrradiance, FieldLight, FieldProbe, FieldProbeState, FieldState,
                     LightField)
from ._lighting import Lighting
from ._plane_objects import Mesh, PlaneLight, PlaneReflector, ShadowCaster
from ._plane_values import (CaptureProgress, PlaneAnswer, PlaneCoverage, PlaneFlag, PlaneGuidance, PlaneInfo,
                            PlaneLayers, PlaneLightAnswer, PlaneLightSource, PlaneReaderStats, PlaneReflection,
                            PlaneRendering, PlaneTexture, ShadowAnswer)
from ._planes import Plane, PlaneReader
from ._probe import Probe
from ._values import (Answer, Calibration, CalibrationReport, Derivation, Environment, EnvironmentLevel, Error,
                      EstimatorConfig, EstimatorKind, Flag, Lens, Light, LightingInfo, LinkState, LinkStats, ProbeInfo,
                      Recording, Setting, Smoothing, Status, Units, UnseenFill, Validity)

__version__ = _chars(_lib.lw_version())


def connect(uri, **options):
    """A Probe at "grpc://host:port", or a recording at "replay:PATH". Options: Probe."""
    return Probe(uri, **options)


__all__ = ["Answer", "Calibration", "CalibrationReport", "CaptureProgress", "Derivation", "Environment",
           "EnvironmentLevel", "Error", "EstimatorConfig", "EstimatorKind", "FieldAnswer", "FieldFlag",
           "FieldIrradiance", "FieldLight", "FieldProbe", "FieldProbeState", "FieldState", "Flag", "Lens", "Light",
           "LightEstimate", "LightField", "LightRequest", "Lighting", "LightingInfo", "LinkState", "LinkStats",
           "MainLight", "Mesh", "OpenXrHarmonics", "Plane", "PlaneAnswer", "PlaneCoverage", "PlaneFlag",
           "PlaneGuidance", "PlaneInfo", "PlaneLayers", "PlaneLight", "PlaneLightAnswer", "PlaneLightSource",
           "PlaneReader", "PlaneReaderStats", "PlaneReflection", "PlaneReflector", "PlaneRendering", "PlaneTexture",
           "Probe", "ProbeInfo", "Recording", "Residual", "Setting", "ShSigns", "ShadowAnswer", "ShadowCaster",
           "Smoothing", "Status", "ThreeLights", "Units", "UnityPipeline", "UnseenFill", "Validity",
           "color_temperature", "connect", "fade_weight"]
