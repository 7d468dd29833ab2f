"""What calls take and return: enumerations, and records that cannot be changed. Meanings: lightwell.h."""

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Optional, Tuple

import numpy as np


class Status(IntEnum):
    """How a call failed."""

    OK = 0
    INVALID_ARGUMENT = 1
    NOT_FOUND = 2
    DATA_LOSS = 3
    FAILED_PRECONDITION = 4
    UNAVAILABLE = 5
    RESOURCE_EXHAUSTED = 6
    INTERNAL = 7


class Error(RuntimeError):
    """A call that failed. `status` says how, the message what to do."""

    def __init__(self, status, message):
        super().__init__(message)
        self.status = status

    def __reduce__(self):
        return Error, (self.status, str(self))


class Validity(IntEnum):
    """May an answer be used?"""

    VALID = 0
    STALE = 1  # Real, but older than max_age.
    NONE = 2  # No descriptor has come yet; the value is zero.
    BEFORE_HISTORY = 3  # The moment lies before the oldest kept; the value is zero.
    INVALID_QUERY = 4  # The question was none; the value is zero.


class Units(IntEnum):
    """Of radiance and irradiance."""

    RELATIVE = 1  # Proportional to cd/m² and lux by one unknown factor.
    ABSOLUTE = 2


class Flag(IntFlag):
    """Why a value may be wrong all the same; what each means stands in lightwell.h."""

    UNSEEN = 1 << 1
    CLIPPED = 1 << 2
    CLEANED = 1 << 3
    DARK = 1 << 4
    MOVED = 1 << 5
    FILLED = 1 << 6
    RECOVERED = 1 << 7
    UNSURE = 1 << 8
    NEWER = 1 << 31


class Derivation(IntEnum):
    """How an answer came about."""

    MEASURED = 0  # One descriptor.
    INTERPOLATED = 1  # Between two.
    EXTRAPOLATED = 2  # Beyond the newest: its lights moved on as they moved before.
    HELD = 3  # Beyond that: the newest as it was.


class EstimatorKind(IntEnum):
    """What light is read from."""

    PANORAMA = 1  # All that the camera sees around it.
    MARKER = 2  # A marker that the camera looks at.


class Setting(IntEnum):
    """Where an estimator stands between time and accuracy."""

    FAST = 1
    BALANCED = 2
    EXACT = 3


class UnseenFill(IntEnum):
    """What stands in for directions that no pixel sees."""

    NONE = 1
    MIRROR = 2
    AVERAGE = 3


class Smoothing(IntEnum):
    """How light is smoothed over time."""

    NONE = 1
    ONE_EURO = 2  # The 1 euro filter.


class LinkState(IntEnum):
    """How the link to a probe stands."""

    CONNECTING = 0
    CONNECTED = 1
    WAITING = 2
    ENDED = 3
    GONE = 4  # Of MQTT: the broker says that the probe has left it.


@dataclass(frozen=True)
class Answer:
    """A value with all that is needed to decide whether to believe it."""

    value: np.ndarray  # float32, (..., 3): r, g, b for each question, in the shape of the questions.
    validity: Validity
    age_ns: int  # Since mid-exposure, when the lighting was asked for.
    reason: str  # Why it is not valid; empty where it is.
    error_bound: float  # RMS relative to the RMS irradiance, 0.01 is 1 %; infinite where flags say why.
    flags: Flag
    lights_included: bool  # False of radiance at roughness 0, which leaves the discrete lights out.
    units: Units
    refused: int  # Questions that were none: their values are zero, and validity is INVALID_QUERY.


@dataclass(frozen=True)
class Light:
    """A lamp, the sun, a window: a cap of uniform radiance."""

    direction: np.ndarray  # float32 (3,), unit, TOWARDS the light.
    irradiance: np.ndarray  # float32 (3,), vector irradiance; luminance in lux where units are absolute.
    angular_radius: float  # rad
    direction_covariance: np.ndarray  # float32 (3,): u·u, u·v, v·v in rad².
    track: int  # Stays with the same lamp; 0 is not a track.


@dataclass(frozen=True)
class EnvironmentLevel:
    roughness: float  # Perceptual.
    radiance: np.ndarray  # float32 (edge, edge, 3), octahedral, rows from the top; without the lights.


@dataclass(frozen=True)
class Environment:
    """The prefiltered map for reflections: octahedral squares with +Y at the centre, u from x, v from z."""

    levels: Tuple[EnvironmentLevel, ...]  # By rising roughness.
    sequence: int  # Of the descriptor that brought it: upload when this changes.
    older_by_ns: int
    rotation: np.ndarray  # float64 (4,), x, y, z, w: p_lighting = rotation p_map.
    key: int


@dataclass(frozen=True)
class LightingInfo:
    """What is known of an answer beside its light."""

    validity: Validity
    age_ns: int
    reason: str
    age_uncertainty_ns: int  # What age_ns may be off by; one that may be older than max_age is stale.
    sequence: int
    mid_exposure_ns: int  # Of the host's CLOCK_MONOTONIC (time.monotonic_ns); 0 where there was none.
    received_ns: int
    probe_mid_exposure_ns: int  # Of the probe's clock.
    delivered_after_ns: int
    encoded_after_ns: int
    encoded_bytes: int
    units: Units
    flags: Flag
    bound_total: float
    bound_truncation: float
    bound_sampling: float
    bound_noise: float
    bound_quantization: float
    bound_smoothing: float
    coverage: float
    saturated: float
    band: int
    light_count: int
    probe_id: int
    calibration_id: int
    setting: int
    flicker: int
    derivation: Derivation


@dataclass(frozen=True)
class ProbeInfo:
    """Who a probe is, how its clock stands, and what it counted since its start."""

    name: str
    version: str
    camera: str
    id: int
    calibration_id: int
    clients: int
    clock_offset_ns: int  # The probe's clock less the host's.
    clock_uncertainty_ns: int
    clock_drift_ppm: float  # How fast the probe's clock gains on the host's, in millionths.
    frames: int
    captures_dropped: int
    brackets_incomplete: int
    estimates: int
    estimates_failed: int
    descriptors_coalesced: int
    frames_recorded: int
    recording_faults: int
    frames_lost: int
    setting_moves: int
    estimates_late: int
    estimates_late_at_fast: int
    messages_refused: int
    authentication_failures: int
    client_list_faults: int
    position: Optional[np.ndarray]  # float64 (3,), m: where the probe hangs in its room; None where it does not know.
    orientation: Optional[np.ndarray]  # float64 (4,), x, y, z, w: p_world = orientation p_probe + position.


@dataclass(frozen=True)
class EstimatorConfig:
    """How a probe's estimator is configured. Meanings: proto/lightwell/v1/config.proto."""

    estimator: EstimatorKind  # Which one runs. It cannot be changed.
    band: int
    max_lights: int
    setting: Setting
    # Of the panorama estimator alone.
    unseen: UnseenFill
    smoothing: Smoothing
    environment_edge: int
    light_threshold: float
    epsilon: float
    radiance_epsilon: float
    environment_rate: float
    # Of the marker estimator alone.
    marker_decimation: float
    marker_search_decimation: float
    marker_max_faces: int


@dataclass(frozen=True)
class LinkStats:
    """How the link fares since it was made."""

    state: LinkState
    received: int
    bytes: int
    gaps: int
    oversized: int
    undecodable: int
    replayed: int  # Descriptors that came again after a newer one: dropped.
    reconnects: int
    maps: int
    maps_without_key: int
    frames_lost: int  # By USB: numbered frames that never came, and
    frames_refused: int  # those that came damaged, too large or a second time.
    untimely: int  # By MQTT: descriptors not newer than what had come, or dated in the future; refused.
    last_error: str  # Of the link, or of the last refused message; empty while all went well.
