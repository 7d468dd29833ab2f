"""The connection to a probe."""

import ctypes
import threading
import time
from contextlib import contextmanager

import numpy as np

from ._abi import chars, check, lib, memory, take, text
from ._lighting import Lighting, record
from ._planes import Plane
from ._values import (Calibration, CalibrationReport, Error, EstimatorConfig, EstimatorKind, Lens, LinkState, LinkStats,
                      ProbeInfo, Recording, Setting, Smoothing, Status, UnseenFill)

# Period in which a blocking wait checks for signals and for close().
_SLICE_NS = 100_000_000

_OPTIONS = {"max_age": "max_age_ns", "extrapolation": "extrapolation_ns", "connect_timeout": "connect_timeout_ns",
            "retry_min": "retry_min_ns", "retry_max": "retry_max_ns", "silence_limit": "silence_limit_ns"}
_TEXTS = ("credentials_folder", "mqtt_ca_file", "mqtt_certificate_file", "mqtt_key_file", "mqtt_user", "mqtt_password")
# Fields of EstimatorConfig that are enums.
_WORDS = {"setting": Setting, "unseen": UnseenFill, "smoothing": Smoothing}


def _number(name, value):
    """The number of an enum's value in C: "fast" is 1."""
    if not isinstance(value, str):
        return value
    words = _WORDS.get(name, ())
    for word in words:
        if word.name.lower() == value:
            return word
    raise Error(Status.INVALID_ARGUMENT,
                f"{name} is {value!r}; it is " + (", ".join(w.name.lower() for w in words) if words else "a number"))


# More lenses than a rig has.
_MAX_LENSES = 16


def _recording(struct):
    """The Recording of an lw_recording, or None."""
    if not struct.available:
        return None
    return record(Recording, struct, running=struct.running == 1, file=chars(struct.file),
                  end_reason=chars(struct.end_reason))


def _lens(struct, has_report):
    report = {name: getattr(struct, name) if has_report else None for name in ("seen_deg", "direction_3_sigma_deg")}
    return record(Lens, struct, model=chars(struct.model), response=chars(struct.response),
                  vignetting=struct.vignetting == 1, noise=struct.noise == 1, **report)


def _ns(seconds):
    return int(round(seconds * 1e9))


class Probe:
    """A connection to one probe, from connect() to close(); usable as a context manager.

    Any thread may call any method. Calls that block let other Python threads run. A failed call raises Error, whose
    `status` is the kind of the failure.
    """

    def __init__(self, uri, *, history=0, plane=False, **more):
        """uri: "grpc://host:port", "grpcs://" with TLS, "ws://host:port" (WebSocket), "wss://", "usb:SERIAL",
        "mqtt://broker/venue/probe", "mqtts://", or "replay:PATH" ("?speed=2", "?speed=0"), a recording of descriptors.

        history: number of descriptors stored for at(), 64 if 0. plane: receives captured planes, for plane(). In
        seconds, with the defaults of ProbeOptions: max_age, extrapolation (0: the newest is held), connect_timeout,
        retry_min, retry_max, silence_limit. Strings: credentials_folder (grpcs; as written by `lightwell pair`, looked
        up by address if not given), and for a broker mqtt_ca_file, mqtt_certificate_file, mqtt_key_file, mqtt_user,
        mqtt_password. Blocks, at most connect_timeout.
        """
        self._raw = None
        self._lock = threading.Lock()
        self._calls = 0
        options = take("lw_probe_options")
        options.history = history
        options.plane = 1 if plane else 0
        for name, value in more.items():
            if name in _TEXTS:
                if "\0" in value:
                    raise Error(Status.INVALID_ARGUMENT, f"{name} has a zero byte in it")
                setattr(options, name, value.encode())
                continue
            if name not in _OPTIONS:
                raise TypeError(f"connect() has no option {name!r}; it has history, plane, "
                                f"{', '.join((*_OPTIONS, *_TEXTS))}")
            if name == "extrapolation" and value == 0:
                options.extrapolation_ns = -1
                continue
            if not 0 < value <= 1e9:
                raise Error(Status.INVALID_ARGUMENT, f"{name} is {value}; it is in seconds, above zero")
            setattr(options, _OPTIONS[name], _ns(value))
        out = ctypes.c_void_p()
        where = uri.encode()
        check(lib.lw_probe_connect(where, len(where), options, ctypes.byref(out)))
        self._raw = out
        self._open = True

    @classmethod
    def connect(cls, uri, **options):
        """The same as Probe(uri, ...)."""
        return cls(uri, **options)

    def close(self):
        """Closes the connection within a second, or when the last call of another thread returns. Lightings stay
        valid."""
        with self._lock:
            self._open = False
            raw = self._take_if_idle()
        if raw is not None:
            lib.lw_probe_close(raw)

    def _take_if_idle(self):
        if self._open or self._calls > 0:
            return None
        raw, self._raw = self._raw, None
        return raw

    @contextmanager
    def _used(self):
        """The C handle; close() of another thread does not release it meanwhile."""
        with self._lock:
            if not self._open:
                raise Error(Status.FAILED_PRECONDITION, "this Probe is closed")
            self._calls += 1
        try:
            yield self._raw
        finally:
            with self._lock:
                self._calls -= 1
                raw = self._take_if_idle()
            if raw is not None:
                lib.lw_probe_close(raw)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        if getattr(self, "_raw", None) is not None:
            self.close()

    def latest(self, into=None):
        """The newest Lighting; Validity.NONE before the first descriptor. If `into` is given, it is filled and
        returned, so that a loop creates no library objects. Lock-free in the library; does not wait for the network."""
        return self._filled(lib.lw_probe_latest, into)

    def latest_in_world(self):
        """latest() in the axes of the room in which the probe is mounted; Validity.INVALID_QUERY if info().position is
        None. For another world frame: latest().rotated()."""
        return self._filled(lib.lw_probe_latest_in_world)

    def at(self, host_time_ns):
        """The lighting at a time of time.monotonic_ns(): interpolated between two descriptors; after the newest, see
        info().derivation."""
        return self._filled(lambda raw, lighting: lib.lw_probe_at(raw, host_time_ns, lighting))

    def plane(self, into=None):
        """The newest complete state of the Plane that the probe captures; Validity.NONE without the option `plane`,
        before the first, and for a recording without planes. `into` as latest()."""
        into = Plane() if into is None else into
        with self._used() as raw:
            check(lib.lw_probe_plane(raw, into._raw))
        return into

    def _filled(self, fill, into=None):
        """`into`, or a new Lighting, after a function of the C ABI has filled it."""
        into = Lighting() if into is None else into
        with self._used() as raw:
            check(fill(raw, into._raw))
        return into

    def wait_for_next(self, seen=None, timeout=10.0):
        """Waits for a newest Lighting with a sequence number other than `seen` (None: any). Blocks, at most `timeout`
        seconds: then Status.UNAVAILABLE. FAILED_PRECONDITION if the recording has ended."""
        into = Lighting()
        known = None if seen is None else memory(np.array([seen], np.uint64))
        end = time.monotonic_ns() + _ns(min(timeout, 1e9))
        while True:
            left = end - time.monotonic_ns()
            with self._used() as raw:
                status = lib.lw_probe_wait_for_next(raw, known, max(0, min(left, _SLICE_NS)), into._raw)
            if status == lib.LW_UNAVAILABLE and left > _SLICE_NS:
                continue
            check(status)
            return into

    def info(self):
        """ProbeInfo. Blocks briefly."""
        struct = take("lw_probe_info")
        with self._used() as raw:
            check(lib.lw_probe_get_info(raw, struct))
            texts = [self._text(raw, kind) for kind in (lib.LW_PROBE_NAME, lib.LW_PROBE_VERSION, lib.LW_PROBE_CAMERA)]
        pose = {name: np.array(list(getattr(struct, name))) if struct.mounted else None
                for name in ("position", "orientation")}
        return record(ProbeInfo, struct, name=texts[0], version=texts[1], camera=texts[2], **pose)

    def stats(self):
        """LinkStats. Blocks briefly."""
        struct = take("lw_link_stats")
        with self._used() as raw:
            check(lib.lw_probe_get_stats(raw, struct))
            last_error = self._text(raw, lib.LW_PROBE_LAST_ERROR)
        return record(LinkStats, struct, state=LinkState(struct.state), last_error=last_error)

    def recording(self):
        """The Recording that runs on the probe, otherwise its last one; None if the probe has no folder for
        recordings. At most about a second old. Blocks briefly."""
        return self._recorded(lib.lw_probe_get_recording)

    def start_recording(self):
        """Starts a recording of all descriptors by the probe, in the folder that its owner has configured; the file
        stays there. Returns the Recording. Blocks until the probe responds. FAILED_PRECONDITION: no such folder, or one
        runs already. RESOURCE_EXHAUSTED: the owner's limits."""
        return self._recorded(lib.lw_probe_start_recording)

    def stop_recording(self):
        """Ends it. Returns the Recording. FAILED_PRECONDITION: none runs."""
        return self._recorded(lib.lw_probe_stop_recording)

    def _recorded(self, call):
        struct = take("lw_recording")
        with self._used() as raw:
            check(call(raw, struct))
        return _recording(struct)

    def calibration(self):
        """What the probe's calibration covers: Calibration. Blocks and fails as estimator_config()."""
        struct, lenses = take("lw_calibration"), (lib.structs["lw_lens"] * _MAX_LENSES)()
        with self._used() as raw:
            check(lib.lw_probe_get_calibration(raw, struct, lenses, ctypes.sizeof(lenses._type_), _MAX_LENSES))
        report = record(CalibrationReport, struct) if struct.has_report else None
        return record(Calibration, struct, file=chars(struct.file), absolute=struct.absolute == 1, report=report,
                      lenses=tuple(_lens(lenses[k], report) for k in range(min(struct.lens_count, _MAX_LENSES))))

    @staticmethod
    def _text(raw, kind):
        return text(lambda *buffer: lib.lw_probe_text(raw, kind, *buffer))

    def estimator_config(self):
        """The current EstimatorConfig: the probe's file with the changes of all clients. Blocks until the probe
        responds. FAILED_PRECONDITION for a recording, and if the probe's firmware is too old to report it."""
        struct, kind = take("lw_estimator_config"), ctypes.c_int32()
        with self._used() as raw:
            check(lib.lw_probe_get_estimator(raw, struct))
            check(lib.lw_probe_get_estimator_kind(raw, ctypes.byref(kind)))
        enums = {name: enum(getattr(struct, name)) for name, enum in _WORDS.items()}
        return record(EstimatorConfig, struct, estimator=EstimatorKind(kind.value), **enums)

    def change_estimator(self, **fields):
        """Sets the given fields of EstimatorConfig, for all clients of the probe, and leaves the others unchanged:
        change_estimator(epsilon=0.02, setting="fast"). Blocks until the probe responds."""
        config, mask = take("lw_estimator_config"), 0
        for name, value in fields.items():
            bit = getattr(lib, f"LW_FIELD_{name.upper()}", None)
            if bit is None or not hasattr(config, name):
                raise TypeError(f"EstimatorConfig has no field {name!r} that can be changed")
            setattr(config, name, _number(name, value))
            mask |= bit
        with self._used() as raw:
            check(lib.lw_probe_change_estimator(raw, config, mask))

    def set_estimator(self, **fields):
        """The same as change_estimator(): sets the given fields only."""
        self.change_estimator(**fields)

    def report_lux(self, lux, normal):
        """Reports the reading (lux) of a lux meter beside the probe that faces `normal` (3,): from then on its units
        are absolute. Returns the factor that was applied to radiance. Blocks until the probe responds."""
        n = np.ascontiguousarray(normal, dtype=np.float32)
        if n.shape != (3,):
            raise ValueError(f"normal: the shape is {n.shape}; it is (3,)")
        factor = ctypes.c_double()
        with self._used() as raw:
            check(lib.lw_probe_report_lux(raw, lux, memory(n), ctypes.byref(factor)))
        return factor.value
