"""Virtual objects on a real plane: their shadow, their reflection, and the light that the plane reflects onto them."""

import ctypes

import numpy as np

from ._abi import Handle, chars, check, lib, memory, take
from ._plane_values import (PlaneFlag, PlaneLayers, PlaneLightAnswer, PlaneLightSource, PlaneReflection, ShadowAnswer)
from ._values import Flag, Validity

_IDENTITY = ((0, 0, 0), (0, 0, 0, 1))


def _array(given, dtype, shape, what):
    """`given` as a contiguous array; -1 in `shape` stands for any length."""
    array = np.ascontiguousarray(given, dtype=dtype)
    if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape)):
        raise ValueError(f"{what}: the shape is {array.shape}; it is {shape}, where -1 stands for any length")
    return array


def _put_pose(struct, pose):
    position, orientation = pose
    struct.position[0:3] = _array(position, np.float64, (3,), "position").tolist()
    struct.orientation[0:4] = _array(orientation, np.float64, (4,), "orientation").tolist()


class Mesh:
    """A virtual object: positions (vertices, 3), m; indices (triangles, 3), all with the same winding; pose =
    (position, orientation): T_plane_mesh. Copies what is not contiguous float32 and uint32."""

    def __init__(self, positions, indices, pose=_IDENTITY):
        self._positions = _array(positions, np.float32, (-1, 3), "positions")
        self._indices = _array(indices, np.uint32, (-1, 3), "indices")
        self._raw = take("lw_shadow_mesh")
        self._raw.positions = memory(self._positions)
        self._raw.position_count = len(self._positions)
        self._raw.indices = memory(self._indices)
        self._raw.index_count = self._indices.size
        _put_pose(self._raw, pose)


class ShadowCaster:
    """Soft shadows of a mesh on a real plane. Create it once and reuse it. One thread at a time."""

    def __init__(self, light_samples=0, residual_directions=0, residual_cell=0):
        """The trade of time for accuracy; 0: the default of ShadowOptions."""
        options = take("lw_shadow_options")
        options.light_samples, options.residual_directions = light_samples, residual_directions
        options.residual_cell = residual_cell
        self._raw = Handle(lib.lw_shadow_caster_create, lib.lw_shadow_caster_release, options)

    def cast(self, lighting, mesh, width, height, pose=_IDENTITY, columns=256, rows=256):
        """ShadowAnswer: for each texel of a rectangle of width x height (m) the light that the mesh leaves, 0 to 1.
        pose: T_lighting_plane; +Z is the normal of the lit side, row 0 is at +Y. Takes milliseconds."""
        receiver = take("lw_shadow_receiver")
        receiver.columns, receiver.rows, receiver.width, receiver.height = columns, rows, width, height
        _put_pose(receiver, pose)
        ratios = np.empty((rows, columns, 3), np.float32)
        summary = take("lw_shadow_summary")
        check(lib.lw_shadow_caster_cast(self._raw, lighting._raw, receiver, mesh._raw,
                                        memory(ratios), ratios.size, summary))
        return ShadowAnswer(ratios, Validity(summary.validity), summary.age_ns, chars(summary.reason),
                            summary.error_bound, Flag(summary.flags), summary.no_light != 0, summary.ignored_triangles)


class PlaneReflector:
    """What a captured plane reflects of a virtual object, blurred by its gloss. Create it once and reuse it. One thread
    at a time."""

    def __init__(self, tolerance=0, cell=0):
        """The trade of time for accuracy; 0: the default of ReflectionOptions."""
        options = take("lw_reflection_options")
        options.tolerance, options.cell = tolerance, cell
        self._raw = Handle(lib.lw_plane_reflector_create, lib.lw_plane_reflector_release, options)

    def render(self, plane, mesh, radiance, eye, width, height, centre=(0, 0), columns=256, rows=256):
        """PlaneReflection: for each texel of a rectangle of the plane (width x height around `centre`, m; row 0 at +Y)
        the radiance that the mesh sends by way of the plane towards `eye` (3,), and the share of the specular part that
        it hides. radiance: of each vertex or triangle of the mesh, (n, 3); of vertices if both are equally many. A
        texel's radiance is diffuse + specular (1 - hidden) + reflected. Takes milliseconds."""
        rgb = _array(radiance, np.float32, (-1, 3), "radiance")
        per_vertex = len(rgb) == len(mesh._positions)
        if not per_vertex and len(rgb) != len(mesh._indices):
            raise ValueError(f"radiance: {len(rgb)} elements; the mesh has {len(mesh._positions)} vertices and "
                             f"{len(mesh._indices)} triangles")
        emitter = take("lw_radiant_mesh")
        emitter.mesh = ctypes.pointer(mesh._raw)
        emitter.radiance, emitter.radiance_count = memory(rgb), len(rgb)
        emitter.radiance_per = lib.LW_RADIANCE_PER_VERTEX if per_vertex else lib.LW_RADIANCE_PER_TRIANGLE
        grid = take("lw_plane_grid")
        grid.columns, grid.rows, grid.width, grid.height = columns, rows, width, height
        grid.centre[0:2] = _array(centre, np.float64, (2,), "centre").tolist()
        reflected, hidden = np.empty((rows, columns, 3), np.float32), np.empty((rows, columns), np.float32)
        about = take("lw_plane_reflection")
        at = memory(_array(eye, np.float64, (3,), "eye"))
        check(lib.lw_plane_reflector_render(self._raw, plane._raw, grid, emitter, at,
                                            memory(reflected), reflected.size,
                                            memory(hidden), hidden.size, about))
        return PlaneReflection(reflected, hidden, Validity(about.validity), about.f0_assumed != 0, about.texels,
                               about.ignored_triangles)


class PlaneLight:
    """The light that a captured plane reflects onto objects above it. Any number of threads may query it while none
    updates it."""

    def __init__(self):
        self._raw = Handle(lib.lw_plane_light_create, lib.lw_plane_light_release)

    def update(self, plane):
        """Takes over a Plane. About 10 ms if it has changed."""
        check(lib.lw_plane_light_update(self._raw, plane._raw))

    def irradiance(self, point, normal, layers=PlaneLayers.ALL):
        """PlaneLightAnswer: the irradiance at `point` (3,) of a surface that faces `normal` (3,), in the plane's frame,
        by what leaves the captured square."""
        return self._answer(point, normal, lambda p, n, answer: lib.lw_plane_light_irradiance(
            self._raw, p, n, layers, answer))

    def irradiance_in(self, lighting, point, normal):
        """The whole irradiance: that of a Lighting in the plane's axes, with the square's light in the directions of
        the square."""
        return self._answer(point, normal, lambda p, n, answer: lib.lw_plane_light_irradiance_in(
            self._raw, p, n, lighting._raw, answer))

    @staticmethod
    def _answer(point, normal, ask):
        p = memory(_array(point, np.float64, (3,), "point"))
        n = memory(_array(normal, np.float64, (3,), "normal"))
        answer = take("lw_plane_light_answer")
        check(ask(p, n, answer))
        return PlaneLightAnswer(np.array(list(answer.value), np.float32), Validity(answer.validity),
                                PlaneFlag(answer.flags), PlaneLightSource(answer.source))
