"""A drawn scene in Mitsuba 3: the picture's radiance, and the light that arrives along given rays.

    Traced(scene, ...)          loads the scene
    .image(integrator, ...)     (h, w, 3) what an integrator sees in the crop
    .arriving(...), .blocked(...), .first_hits(...)   along given rays
    .surfaces()                 (h, w) the surface in the middle of each pixel

`llvm_ad_rgb` needs an LLVM library that is newer than Debian 12's: DRJIT_LIBLLVM_PATH names it, else that of a Rust
toolchain is taken. Without one, Mitsuba reports that it cannot initialize.
"""

import glob
import os
from pathlib import Path

import numpy as np

if "DRJIT_LIBLLVM_PATH" not in os.environ:
    # The small ones are linker scripts.
    found = glob.glob(str(Path.home() / ".rustup/toolchains/*/lib/libLLVM*.so*"))
    if found:
        os.environ["DRJIT_LIBLLVM_PATH"] = max(sorted(found), key=os.path.getsize)

import drjit as dr  # noqa: E402 (the library is named before)
import mitsuba as mi  # noqa: E402

import bodies  # noqa: E402
import draw  # noqa: E402
from placing import Clutter  # noqa: E402

mi.set_variant("llvm_ad_rgb")
mi.set_log_level(mi.LogLevel.Error)

MAX_DEPTH = 4                   # segments of a path: direct light and two reflections before it
PASS_SAMPLES = 4e6              # limits the memory
CLUTTER_FIRST = 100             # number of the first surface of clutter
PRINT_GAP_M = 1.5e-5            # between blank paper and print, for the tracer
CORE_GAP_M = 0.0015             # between a face and the core, which is seen through gaps of the folds
SPECULAR = 0.5                  # of satin: a refractive index of 1.5
SIDES = 48                      # of a round thing


def rgb(c) -> dict:
    return {"type": "rgb", "value": [float(v) for v in c]}


def surface(reflectance: dict, roughness: float) -> dict:
    """Matte, or satin: the diffuse reflectance at normal incidence is `reflectance` in both cases."""
    if roughness == 0:
        return {"type": "diffuse", "reflectance": reflectance}
    return {"type": "principled", "base_color": reflectance, "roughness": float(roughness), "specular": SPECULAR}


# ---------------------------------------------------------------------------------------------------------------------
# Polygons: corners in the world, counter-clockwise seen from outside; albedo; number of the surface
# ---------------------------------------------------------------------------------------------------------------------
def printed_polygons(scene: draw.Scene) -> list[tuple]:
    """The folded faces. Ink and paper of a face are two surfaces."""
    out, body = [], scene.model()
    for i, (face, frame) in enumerate(zip(body.faces, scene.faces)):
        for outline, albedo, layer in bodies.printed(face, body.tag_size):
            points = [frame.at((x, y, (layer - 1) * PRINT_GAP_M)) for x, y in outline]
            out.append(([bodies.turned(scene.attitude, p) for p in points], albedo, 2 * i + (albedo[0] < 0.1)))
    return out


def core_polygons(scene: draw.Scene) -> list[tuple]:
    """The nominal polyhedron, a little smaller, of blank paper."""
    body, out = scene.model(), []
    if body.ball:
        return out
    for i, face in enumerate(body.faces):
        scale = 1 - CORE_GAP_M / bodies.dot(face.frame.normal, face.frame.origin)
        out.append(([bodies.turned(scene.attitude, tuple(scale * v for v in p)) for p in face.corners()],
                    (bodies.WHITE,) * 3, i))
    return out


def clutter_polygons(thing: Clutter) -> list[tuple]:
    """Round walls are one surface; 0 to 4 are used."""
    turn = bodies.about((0.0, 1.0, 0.0), np.radians(thing.turn_deg))

    def place(x, y, z):
        return bodies.plus(thing.base, bodies.turned(turn, (float(x), float(y), float(z))))

    if thing.kind == "ball":
        r, rings = thing.width / 2, SIDES // 2
        grid = [[place(r * np.sin(t) * np.sin(a), r - r * np.cos(t), r * np.sin(t) * np.cos(a))
                 for a in np.linspace(0, 2 * np.pi, SIDES + 1)] for t in np.linspace(0, np.pi, rings + 1)]
        return [([grid[i][j], grid[i][j + 1], grid[i + 1][j + 1], grid[i + 1][j]], thing.albedo, 0)
                for i in range(rings) for j in range(SIDES)]
    if thing.kind == "box":
        w, d = thing.width / 2, thing.depth / 2
        ring = [(-w, d), (w, d), (w, -d), (-w, -d)]
    else:
        angles = np.arange(SIDES) * 2 * np.pi / SIDES
        ring = [(thing.width / 2 * np.sin(a), thing.width / 2 * np.cos(a)) for a in angles]
    out = [([place(x, thing.height, z) for x, z in ring], thing.albedo, 4)]
    for i, ((x0, z0), (x1, z1)) in enumerate(zip(ring, ring[1:] + ring[:1])):
        out.append(([place(x0, 0, z0), place(x1, 0, z1), place(x1, thing.height, z1), place(x0, thing.height, z0)],
                    thing.albedo, i if thing.kind == "box" else 0))
    return out


def mesh(polygons, folder: Path, name: str, roughness: float):
    """The polygons as one mesh with an albedo per triangle, and the surface of each triangle."""
    points, triangles, colors, surfaces = [], [], [], []
    for corners, albedo, surface_number in polygons:
        start = len(points)
        points.extend(corners)
        for i in range(1, len(corners) - 1):
            triangles.append((start, start + i, start + i + 1))
            colors.append(albedo)
            surfaces.append(surface_number)
    path = folder / f"{name}.ply"
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}",
            *(f"property float {a}" for a in "xyz"), f"element face {len(triangles)}",
            "property list uchar int vertex_indices", "end_header", ""]
    faces = np.zeros(len(triangles), np.dtype([("n", "u1"), ("v", "<i4", 3)]))
    faces["n"], faces["v"] = 3, triangles
    path.write_bytes("\n".join(head).encode() + np.array(points, "<f4").tobytes() + faces.tobytes())
    out = mi.load_dict({"type": "ply", "filename": str(path), "face_normals": True,
                        "bsdf": surface({"type": "mesh_attribute", "name": "face_color"}, roughness)})
    out.add_attribute("face_color", 3, np.array(colors, np.float32).ravel())
    return out, np.array(surfaces)


# ---------------------------------------------------------------------------------------------------------------------
# The scene
# ---------------------------------------------------------------------------------------------------------------------
def lamp_shape(lamp) -> dict:
    at, half, t = lamp.position(), lamp.size_m / 2, mi.ScalarTransform4f()
    shape = {"type": "sphere", "center": list(at), "radius": half} if lamp.shape == "ball" else {
        "type": "disk", "to_world": t.look_at(list(at), [0, 0, 0], [0, 1, 0]).scale([half, half, 1])}
    return shape | {"bsdf": {"type": "diffuse", "reflectance": rgb([0] * 3)},
                    "emitter": {"type": "area", "radiance": rgb(np.array(lamp.irradiance) / lamp.form_factor()),
                                "sampling_weight": float(draw.luminance(lamp.irradiance))}}


def bitmap(array: np.ndarray) -> mi.Bitmap:
    return mi.Bitmap(np.ascontiguousarray(array, np.float32), mi.Bitmap.PixelFormat.RGB)


class Traced:
    """`texture`: textures.Texture of the table. `room`: radiance of the room's map; None: black. `parts`: of "body" and
    "around" (table, clutter), what is there. `lamps`: by default all."""

    def __init__(self, scene: draw.Scene, texture, room: np.ndarray | None, folder: Path, parts=("body", "around"),
                 lamps=None):
        t, self.scene = mi.ScalarTransform4f(), scene
        d = {"type": "scene"}
        if room is not None:
            # The rays find it; sampled as an emitter it would take samples from the lamps.
            d["room"] = {"type": "envmap", "bitmap": bitmap(room), "sampling_weight": 0.0}
        for i, lamp in enumerate(scene.lamps if lamps is None else lamps):
            d[f"lamp_{i}"] = lamp_shape(lamp)
        things, self.numbers_of = [], {}
        if "body" in parts:
            d["paper"], self.numbers_of["paper"] = mesh(printed_polygons(scene), folder, "paper", scene.paper_roughness)
            ball = scene.model().ball
            if ball:
                d["ball"] = {"type": "sphere", "radius": ball.radius,
                             "center": list(bodies.turned(scene.attitude, scene.ball_center)),
                             "bsdf": surface(rgb(ball.albedo), scene.paper_roughness)}
            things += core_polygons(scene)
        if "around" in parts:
            for i, thing in enumerate(scene.clutter):
                things += [(p, albedo, CLUTTER_FIRST + 5 * i + k) for p, albedo, k in clutter_polygons(thing)]
            d["table"] = self.table(texture, t)
        if things:
            d["things"], self.numbers_of["things"] = mesh(things, folder, "things", 0.0)
        self.scene_mi = mi.load_dict(d)
        self.path = mi.load_dict({"type": "path", "max_depth": MAX_DEPTH, "rr_depth": 100})

    def table(self, texture, t) -> dict:
        table = self.scene.table
        (w, h), e = table.half_size_m, texture.extent_m
        picture = {"type": "bitmap", "bitmap": bitmap(texture.reflectance), "raw": True, "wrap_mode": "repeat",
                   "to_uv": t.scale([2 * w / e, 2 * h / e, 1])}
        place = t.translate([0, self.scene.table_height, 0]).rotate([0, 1, 0], table.turn_deg).rotate(
            [1, 0, 0], -90).scale([w, h, 1])
        return {"type": "rectangle", "to_world": place, "bsdf": surface(picture, table.roughness)}

    def sensor(self):
        c, (x, y, w, h) = self.scene.camera, self.scene.crop
        column = lambda k: [row[k] for row in c.rotation]
        look = mi.ScalarTransform4f().look_at(
            origin=list(c.position), target=[p - b for p, b in zip(c.position, column(2))], up=column(1))
        return mi.load_dict({
            "type": "perspective", "fov": float(np.degrees(2 * np.arctan(c.width / 2 / c.focal_px))), "fov_axis": "x",
            "near_clip": 0.005, "far_clip": 100.0, "to_world": look,
            "film": {"type": "hdrfilm", "width": c.width, "height": c.height, "crop_offset_x": x, "crop_offset_y": y,
                     "crop_width": w, "crop_height": h, "pixel_format": "rgb", "component_format": "float32",
                     "rfilter": {"type": "box"}},
            "sampler": {"type": "multijitter"}})

    def image(self, integrator, samples: float, per_pixel: tuple[int, int], salt: int) -> np.ndarray:
        """(h, w, 3). `samples`: of the whole picture, within the limits `per_pixel`."""
        area = self.scene.crop[2] * self.scene.crop[3]
        spp = int(np.clip(samples / area, *per_pixel))
        passes = max(1, round(spp * area / PASS_SAMPLES))
        seed, sensor = self.scene.numbers().seed(f"tracer.{self.scene.frame}.{salt}") % 2**31, self.sensor()
        total = sum(np.array(mi.render(self.scene_mi, sensor=sensor, integrator=integrator,
                                       spp=max(1, spp // passes), seed=seed + i)) for i in range(passes))
        return (total[..., -3:] / passes).astype(np.float64)

    def arriving(self, origins: np.ndarray, directions: np.ndarray, seed: int = 0) -> np.ndarray:
        """(n, 3) radiance along rays; 0 where a ray meets a lamp."""
        rays = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T),
                                             mi.Vector3f(np.asarray(directions, np.float32).T)))
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, len(directions))
        si = self.scene_mi.ray_intersect(rays)
        lamp = si.is_valid() & si.shape.is_emitter()
        radiance, _, _ = self.path.sample(self.scene_mi, sampler, rays)
        return np.array(dr.select(lamp, mi.Color3f(0), radiance)).T.astype(np.float64)

    def blocked(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """(n,) whether something is between; the last millimetre is not looked at."""
        way = np.asarray(targets, float) - origins
        far = np.linalg.norm(way, axis=1)
        rays = mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T), mi.Vector3f((way / far[:, None]).T),
                        mi.Float(np.maximum(far - 1e-3, 1e-4).astype(np.float32)), mi.Float(0.0), mi.Color0f())
        return np.array(self.scene_mi.ray_test(rays))

    def hits(self, origins: np.ndarray, directions: np.ndarray):
        """First intersections, and the names of the shapes with the mask of each."""
        rays = mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T), mi.Vector3f(np.asarray(directions, np.float32).T))
        pi = self.scene_mi.ray_intersect_preliminary(rays)
        of = {s.id(): np.array(pi.is_valid() & (pi.shape == mi.ShapePtr(s))) for s in self.scene_mi.shapes()}
        return np.array(pi.t), np.array(pi.prim_index), of

    def camera_rays(self, step: int = 1) -> tuple[np.ndarray, tuple[int, int]]:
        """(n, 3) unit directions through the middle of every step-th pixel, row by row, and their rows and columns."""
        c, (x, y, w, h) = self.scene.camera, self.scene.crop
        u, v = np.meshgrid(x + np.arange(step // 2, w, step) - (c.width - 1) / 2,
                           y + np.arange(step // 2, h, step) - (c.height - 1) / 2)
        rays = np.stack([u / c.focal_px, -v / c.focal_px, -np.ones_like(u)], -1) @ np.array(c.rotation).T
        return (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3), u.shape

    def surfaces(self) -> np.ndarray:
        """(h, w) number of the surface that the ray through each pixel's middle meets: 0 room or lamp, 1 table, 2 ball,
        from 1000 printed faces, from 2000 the core and clutter."""
        rays, shape = self.camera_rays()
        _, triangle, of = self.hits(np.tile(self.scene.camera.position, (len(rays), 1)), rays)
        out = np.zeros(len(rays), int)
        out[of.get("table", np.zeros(len(rays), bool))] = 1
        out[of.get("ball", np.zeros(len(rays), bool))] = 2
        for thousands, name in ((1000, "paper"), (2000, "things")):
            if name in self.numbers_of:
                out[of[name]] = thousands + self.numbers_of[name][triangle[of[name]]]
        return out.reshape(shape)
