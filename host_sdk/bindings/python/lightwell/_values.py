"""Enumerations and immutable records of the API. Meanings: lightwell.h."""

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Optional, Tuple

import numpy as np


class Status(IntEnum):
    """Kind of a failure."""

    OK = 0
    INVALID_ARGUMENT = 1
    NOT_FOUND = 2
    DATA_LOSS = 3
    FAILED_PRECONDITION = 4
    UNAVAILABLE = 5
    RESOURCE_EXHAUSTED = 6
    INTERNAL = 7


class Error(RuntimeError):
    """A failed call. `status` is the kind of the failure; the message says what is wrong and what to do."""

    def __init__(self, status, message):
        super().__init__(message)
        self.status = status

    def __reduce__(self):
        return Error, (self.status, str(self))


class Validity(IntEnum):
    """Whether an answer can be used."""

    VALID = 0
    STALE = 1  # Measured, but older than max_age.
    NONE = 2  # No descriptor has been received yet; the value is zero.
    BEFORE_HISTORY = 3  # The time is before the oldest stored descriptor; the value is zero.
    INVALID_QUERY = 4  # An argument is invalid; the value is zero.


class Units(IntEnum):
    """Unit of radiance and irradiance."""

    RELATIVE = 1  # Proportional to cd/m² and lux by one unknown factor.
    ABSOLUTE = 2


class Flag(IntFlag):
    """Conditions under which a value may be wrong; documented in lightwell.h."""

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
    """How an answer was derived from descriptors."""

    MEASURED = 0  # From one descriptor.
    INTERPOLATED = 1  # Between two descriptors.
    EXTRAPOLATED = 2  # After the newest: its lights moved on with constant velocity.
    HELD = 3  # Later than that: the newest unchanged.


class EstimatorKind(IntEnum):
    """What light is estimated from."""

    PANORAMA = 1  # A panoramic view of the surroundings.
    MARKER = 2  # The shading of a marker in view.
    SPECULAR = 3  # The mirror image of the surroundings in a glossy plane.


class Setting(IntEnum):
    """Trade-off of an estimator between time and accuracy."""

    FAST = 1
    BALANCED = 2
    EXACT = 3
    FASTEST = 4


class UnseenFill(IntEnum):
    """How directions that no pixel sees are filled."""

    NONE = 1
    MIRROR = 2
    AVERAGE = 3


class Smoothing(IntEnum):
    """Smoothing over time."""

    NONE = 1
    ONE_EURO = 2  # The 1 euro filter.


class LinkState(IntEnum):
    """State of the connection to a probe."""

    CONNECTING = 0
    CONNECTED = 1
    WAITING = 2
    ENDED = 3
    GONE = 4  # MQTT: the broker reports that the probe is offline.


@dataclass(frozen=True)
class Answer:
    """A value with its validity, age and error bound."""

    value: np.ndarray  # float32, (..., 3): r, g, b for each input, in the shape of the input array.
    validity: Validity
    age_ns: int  # Time since mid-exposure when the lighting was obtained.
    reason: str  # Why it is not valid; empty if it is.
    error_bound: float  # RMS relative to the RMS irradiance, 0.01 is 1 %; infinite where no bound exists (see flags).
    flags: Flag
    lights_included: bool  # False for radiance at roughness 0, which excludes the discrete lights.
    units: Units
    refused: int  # Number of invalid inputs: their values are zero, and validity is INVALID_QUERY.


@dataclass(frozen=True)
class Light:
    """A detected light (lamp, sun, window), modelled as a spherical cap of uniform radiance."""

    direction: np.ndarray  # float32 (3,), unit, TOWARDS the light.
    irradiance: np.ndarray  # float32 (3,), at normal incidence; luminance in lux if units are absolute.
    angular_radius: float  # rad
    direction_covariance: np.ndarray  # float32 (3,): u·u, u·v, v·v in rad².
    track: int  # Identity over time: the same light keeps its track. 0: not tracked.
    distance: Optional[float] = None  # From the origin, m; None: distant or not known.
    distance_sigma: Optional[float] = None  # Standard deviation of the distance, m.
    position: Optional[np.ndarray] = None  # float32 (3,), m, in the lighting's frame, as LightingInfo.origin_position.


@dataclass(frozen=True)
class EnvironmentLevel:
    roughness: float  # Perceptual roughness.
    radiance: np.ndarray  # float32 (edge, edge, 3), octahedral, rows from the top; without the lights.


@dataclass(frozen=True)
class Environment:
    """The prefiltered environment map for reflections: octahedral levels with +Y at the centre, u from x, v from z."""

    levels: Tuple[EnvironmentLevel, ...]  # In order of increasing roughness.
    sequence: int  # Sequence number of the descriptor with the map: upload the map when this changes.
    older_by_ns: int
    rotation: np.ndarray  # float64 (4,), x, y, z, w: p_lighting = rotation p_map.
    key: int


@dataclass(frozen=True)
class LightingInfo:
    """Properties of a Lighting besides its light."""

    validity: Validity
    age_ns: int
    reason: str
    age_uncertainty_ns: int  # Maximum error of age_ns; stale if the age can exceed max_age within it.
    sequence: int
    mid_exposure_ns: int  # In the host's CLOCK_MONOTONIC (time.monotonic_ns); 0 if there is none.
    received_ns: int
    probe_mid_exposure_ns: int  # In the probe's clock.
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
    origin_position: np.ndarray  # float64 (3,), m: where the light holds, of a marker; zero: at the probe.
    origin_orientation: np.ndarray  # float64 (4,), x, y, z, w: of a marker's axes. Turns no direction.


@dataclass(frozen=True)
class ProbeInfo:
    """Identity and clock of a probe, and its counters since its start."""

    name: str
    version: str
    camera: str
    id: int
    calibration_id: int
    clients: int
    clock_offset_ns: int  # The probe's clock minus the host's.
    clock_uncertainty_ns: int
    clock_drift_ppm: float  # Drift of the probe's clock against the host's, ppm.
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
    position: Optional[np.ndarray]  # float64 (3,), m: position of the probe in its room; None if it is not configured.
    orientation: Optional[np.ndarray]  # float64 (4,), x, y, z, w: p_world = orientation p_probe + position.


@dataclass(frozen=True)
class Recording:
    """The recording that runs on the probe, otherwise its last one."""

    running: bool
    file: str  # Name in the probe's folder; empty before the first recording.
    bytes: int
    descriptors: int
    lost: int  # Messages that are missing in the file, because the disk was too slow.
    end_reason: str  # Why it ended although no client stopped it; otherwise empty.
    faults: int  # Recordings that a fault or a limit ended, since the start of the daemon.


@dataclass(frozen=True)
class Lens:
    """What the calibration of a lens covers."""

    width: int  # Of the picture that it is for, px.
    height: int
    model: str  # "kannala_brandt".
    max_angle_deg: float  # Half the field of view.
    response: str  # "linear", "srgb", "table" or "gamma".
    vignetting: bool  # It is corrected.
    noise: bool  # Read or shot noise is known.
    seen_deg: Optional[float]  # Largest angle from the axis at which boards were seen; None without a report.
    direction_3_sigma_deg: Optional[float]  # Largest uncertainty of a direction up to it; None without a report.


@dataclass(frozen=True)
class CalibrationReport:
    """How a calibration was measured."""

    geometry_time_s: int  # Seconds since 1970 (UTC), 0: not known.
    rms_px: float  # RMS of the residuals of both coordinates.
    points: int
    photometry_time_s: int


@dataclass(frozen=True)
class Calibration:
    """What a probe's calibration covers, and how well."""

    id: int  # LightingInfo.calibration_id.
    file: str  # Name without its folder; empty: the camera's own calibration.
    absolute: bool  # cd/m² of a pixel value are known.
    lenses: Tuple[Lens, ...]
    report: Optional[CalibrationReport]  # None: the file has none.


@dataclass(frozen=True)
class EstimatorConfig:
    """Configuration of a probe's estimator. Meanings: proto/lightwell/v1/config.proto."""

    estimator: EstimatorKind  # The active estimator; it cannot be changed.
    band: int
    max_lights: int
    setting: Setting
    # Options of the panorama estimator.
    unseen: UnseenFill
    smoothing: Smoothing
    environment_edge: int
    light_threshold: float
    epsilon: float
    radiance_epsilon: float
    environment_rate: float
    # Options of the marker estimator.
    marker_decimation: float
    marker_search_decimation: float
    marker_max_faces: int
    # Option of the specular estimator.
    specular_environment_edge: int
    # Options of the panorama estimator, of newer probes.
    interleave: int
    max_bytes: int


@dataclass(frozen=True)
class LinkStats:
    """Statistics of the connection since it was made."""

    state: LinkState
    received: int
    bytes: int
    gaps: int
    oversized: int
    undecodable: int
    replayed: int  # Descriptors that were received again after a newer one: dropped.
    reconnects: int
    maps: int
    maps_without_key: int
    frames_lost: int  # USB: numbered frames that were not received.
    frames_refused: int  # USB: frames that were damaged, too large or repeated.
    untimely: int  # MQTT: descriptors rejected as replays: not newer than an earlier one, or dated in the future.
    last_error: str  # Last error of the link or of a rejected message; empty if there was none.
