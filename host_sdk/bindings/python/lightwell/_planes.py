"""Captured glossy planes: their radiance from any viewpoint."""

import ctypes

import numpy as np

from ._abi import Handle, check, lib, memory, take
from ._plane_values import (CaptureProgress, PlaneAnswer, PlaneCoverage, PlaneFlag, PlaneGuidance, PlaneInfo,
                            PlaneLayers, PlaneReaderStats, PlaneRendering, PlaneTexture)
from ._values import Units, Validity


def _numbers(given, size, what):
    """`given` as a float64 array of shape (..., size)."""
    array = np.asarray(given, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(f"{what}: the shape is {array.shape}; it is ({size},) or (..., {size})")
    return array


def _vector(values):
    return np.array(list(values), np.float64)


class Plane:
    """One moment of a captured plane, from Probe.plane() or PlaneReader.snapshot(). It is not updated.

    Points, eyes and directions are in the plane's frame: right-handed, m, origin in the middle of the captured square,
    +Z its normal on the viewer's side, +X right, +Y to the top of the texture. Colours are linear Rec. 709; luminance
    is in cd/m² if units are absolute. Any number of threads may query it concurrently, as long as none passes it to
    Probe.plane(into=...) or snapshot(into=...).
    """

    def __init__(self):
        self._raw = Handle(lib.lw_plane_create, lib.lw_plane_release)

    def copy(self):
        out = Plane()
        check(lib.lw_plane_copy(self._raw, out._raw))
        return out

    def info(self):
        """PlaneInfo: validity, age, size, pose, gloss."""
        c = take("lw_plane_info")
        check(lib.lw_plane_get_info(self._raw, c))
        return PlaneInfo(
            validity=Validity(c.validity), age_ns=c.age_ns, revision=c.revision, missing_tiles=c.missing_tiles,
            capture=c.capture, texture_edge=c.texture_edge, mid_exposure_ns=c.mid_exposure_ns, side=c.side,
            texture_position=_vector(c.texture_position), texture_rotation=c.texture_rotation,
            texture_scale=c.texture_scale, position=_vector(c.position) if c.pose_known else None,
            orientation=_vector(c.orientation) if c.pose_known else None, units=Units(c.units) if c.units else None,
            gloss_alpha=None if c.gloss_alpha < 0 else c.gloss_alpha, f0=None if c.f0 < 0 else c.f0)

    @property
    def validity(self):
        return self.info().validity

    def radiance(self, points, eyes, layers=PlaneLayers.ALL):
        """PlaneAnswer: radiance from `points` of the plane, (2,) or (..., 2), towards `eyes`, (3,) or (..., 3), m. Both
        are broadcast."""
        points, eyes = _numbers(points, 2, "points"), _numbers(eyes, 3, "eyes")
        shape = np.broadcast_shapes(points.shape[:-1], eyes.shape[:-1])
        points, eyes = np.broadcast_to(points, (*shape, 2)), np.broadcast_to(eyes, (*shape, 3))
        point, eye = np.empty(2), np.empty(3)

        def ask(k, answer):
            point[:], eye[:] = points.reshape(-1, 2)[k], eyes.reshape(-1, 3)[k]
            return lib.lw_plane_radiance(self._raw, memory(point), memory(eye), layers, answer)

        return self._answers(shape, ask)

    def diffuse(self, points):
        """PlaneAnswer: the diffuse part at `points`, (2,) or (..., 2): where a virtual object hides the mirror image of
        the room."""
        return self.radiance(points, (0, 0, 1), PlaneLayers.DIFFUSE)

    def specular(self, to_viewers):
        """PlaneAnswer: the specular part towards viewers, (3,) or (..., 3); need not be normalised."""
        directions = _numbers(to_viewers, 3, "to_viewers")
        direction = np.empty(3)

        def ask(k, answer):
            direction[:] = directions.reshape(-1, 3)[k]
            return lib.lw_plane_specular(self._raw, memory(direction), answer)

        return self._answers(directions.shape[:-1], ask)

    @staticmethod
    def _answers(shape, ask):
        """The PlaneAnswer of `ask(k, answer)` for each of the questions."""
        count = int(np.prod(shape, dtype=np.int64))
        value = np.empty((count, 3), np.float32)
        validity, flags = np.empty(count, np.int32), np.empty(count, np.uint32)
        answer = take("lw_plane_answer")
        for k in range(count):
            check(ask(k, answer))
            value[k], validity[k], flags[k] = list(answer.value), answer.validity, answer.flags
        return PlaneAnswer(value.reshape(*shape, 3), validity.reshape(shape), flags.reshape(shape))

    def render(self, width, height, fx, fy, cx, cy, position, orientation=(0, 0, 0, 1), layers=PlaneLayers.ALL):
        """PlaneRendering: the plane as a pinhole camera sees it. Camera frame: +X right, +Y up, -Z forward; the centre
        of the top left pixel is (0, 0). position (m), orientation (x, y, z, w): of T_plane_camera. Pixels that do not
        show the plane are 0."""
        camera = take("lw_plane_camera")
        camera.width, camera.height = width, height
        camera.fx, camera.fy, camera.cx, camera.cy = fx, fy, cx, cy
        camera.position[0:3] = _numbers(position, 3, "position").tolist()
        camera.orientation[0:4] = _numbers(orientation, 4, "orientation").tolist()
        if not (1 <= width <= 32768 and 1 <= height <= 32768):
            raise ValueError(f"width and height are {width} and {height}; they are 1 to 32768")
        rgb = np.zeros((height, width, 3), np.float32)
        flags = np.zeros((height, width), np.uint8)
        about = take("lw_plane_rendering")
        check(lib.lw_plane_render(self._raw, camera, layers, memory(rgb), rgb.size, memory(flags), flags.size,
                                  about))
        return PlaneRendering(Validity(about.validity), PlaneFlag(about.flags), about.pixels, about.flagged, rgb, flags)

    def texture(self):
        """PlaneTexture: the diffuse radiance of each texel, rows from the top; None if the probe sends no texture."""
        info = self.info()
        edge = info.texture_edge
        if edge == 0:
            return None
        # Seen from straight above: pixel centres are the centres of texels.
        x, y = info.texture_position
        half = info.texture_rotation / 2
        made = self.render(edge, edge, edge, edge, (edge - 1) / 2, (edge - 1) / 2,
                           (x, y, info.side * info.texture_scale), (0, 0, np.sin(half), np.cos(half)),
                           PlaneLayers.DIFFUSE)
        return PlaneTexture(made.validity, made.rgb, made.pixel_flags)

    def coverage(self):
        """PlaneCoverage: the directions from which the plane was seen, for a drawing."""
        count = ctypes.c_size_t()
        check(lib.lw_plane_coverage(self._raw, None, None, 0, ctypes.byref(count)))
        disc, seen = np.empty((count.value, 2), np.float32), np.empty(count.value, np.uint8)
        check(lib.lw_plane_coverage(self._raw, memory(disc), memory(seen), count.value, ctypes.byref(count)))
        return PlaneCoverage(disc, seen.astype(bool))

    def guidance(self, min_elevation=0, min_seen=0, max_gap=0):
        """PlaneGuidance: whether enough was seen, and where to move next. Angles in rad; 0: the default (10 degrees,
        0.9, 15 degrees). About 1 ms."""
        options = take("lw_plane_guidance_options")
        options.min_elevation, options.min_seen, options.max_gap = min_elevation, min_seen, max_gap
        c = take("lw_plane_guidance")
        check(lib.lw_plane_get_guidance(self._raw, options, c))

        def direction(values):
            return _vector(values) if any(values) else None

        return PlaneGuidance(CaptureProgress(c.progress), c.seen, c.gap, direction(c.next), direction(c.probe),
                             c.circle)


class PlaneReader:
    """Collects the messages (PlaneUpdate) of one captured plane that were received without a Probe. Order, duplicates
    and losses do not matter. One thread at a time."""

    def __init__(self):
        self._raw = Handle(lib.lw_plane_reader_create, lib.lw_plane_reader_release)

    def take(self, message, received_ns=None):
        """One message. received_ns: by time.monotonic_ns(); None: now. Raises Error for one that is not valid or
        contradicts earlier ones; then nothing has changed."""
        at = lib.lw_now_ns() if received_ns is None else received_ns
        check(lib.lw_plane_reader_take(self._raw, memory(message), len(message), at))

    def snapshot(self, now_ns=None, into=None):
        """The Plane as received so far. now_ns: as received_ns of take()."""
        into = Plane() if into is None else into
        check(lib.lw_plane_reader_snapshot(self._raw, lib.lw_now_ns() if now_ns is None else now_ns, into._raw))
        return into

    def stats(self):
        """PlaneReaderStats."""
        c = take("lw_plane_reader_stats")
        check(lib.lw_plane_reader_get_stats(self._raw, c))
        return PlaneReaderStats(c.messages, c.refused, c.tiles, c.tiles_unused)
