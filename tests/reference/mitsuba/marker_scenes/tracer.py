"""A drawn scene in Mitsuba 3: the picture's radiance, and the light that arrives along given rays.

    Traced(scene, folder)       loads the scene
    .picture()                  (h, w, 3) radiance of the crop
    .arriving(origins, directions, ...)   radiance along rays, without the lamps' own
    .visible(...)               what the camera's rays meet

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
PICTURE_SAMPLES = 6e6           # of a picture: a small one has more per pixel
SAMPLES_PER_PIXEL = (9, 64)
PASS_SAMPLES = 4e6              # limits the memory
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
# Polygons
# ---------------------------------------------------------------------------------------------------------------------
def printed_polygons(scene: draw.Scene) -> list[tuple[list, bodies.Vector]]:
    """(corners in the world, albedo) of the folded faces."""
    out, body = [], scene.model()
    for face, frame in zip(body.faces, scene.faces):
        for outline, albedo, layer in bodies.printed(face, body.tag_size):
            points = [frame.at((x, y, (layer - 1) * PRINT_GAP_M)) for x, y in outline]
            out.append(([bodies.turned(scene.attitude, p) for p in points], albedo))
    return out


def core_polygons(scene: draw.Scene) -> list[tuple[list, bodies.Vector]]:
    """The nominal polyhedron, a little smaller, of blank paper."""
    body, out = scene.model(), []
    if body.ball:
        return out
    for face in body.faces:
        scale = 1 - CORE_GAP_M / bodies.dot(face.frame.normal, face.frame.origin)
        out.append(([bodies.turned(scene.attitude, tuple(scale * v for v in p)) for p in face.corners()],
                    (bodies.WHITE,) * 3))
    return out


def clutter_polygons(thing: Clutter) -> list[tuple[list, bodies.Vector]]:
    """Counter-clockwise seen from outside."""
    turn = bodies.about((0.0, 1.0, 0.0), np.radians(thing.turn_deg))

    def place(x, y, z):
        return bodies.plus(thing.base, bodies.turned(turn, (float(x), float(y), float(z))))

    if thing.kind == "ball":
        r, rings = thing.width / 2, SIDES // 2
        grid = [[place(r * np.sin(t) * np.sin(a), r - r * np.cos(t), r * np.sin(t) * np.cos(a))
                 for a in np.linspace(0, 2 * np.pi, SIDES + 1)] for t in np.linspace(0, np.pi, rings + 1)]
        return [([grid[i][j], grid[i][j + 1], grid[i + 1][j + 1], grid[i + 1][j]], thing.albedo)
                for i in range(rings) for j in range(SIDES)]
    if thing.kind == "box":
        w, d = thing.width / 2, thing.depth / 2
        ring = [(-w, d), (w, d), (w, -d), (-w, -d)]
    else:
        angles = np.arange(SIDES) * 2 * np.pi / SIDES
        ring = [(thing.width / 2 * np.sin(a), thing.width / 2 * np.cos(a)) for a in angles]
    out = [([place(x, thing.height, z) for x, z in ring], thing.albedo)]
    for (x0, z0), (x1, z1) in zip(ring, ring[1:] + ring[:1]):
        out.append(([place(x0, 0, z0), place(x1, 0, z1), place(x1, thing.height, z1), place(x0, thing.height, z0)],
                    thing.albedo))
    return out


def mesh(polygons, folder: Path, name: str, roughness: float):
    """Convex polygons as one mesh with an albedo per triangle."""
    points, triangles, colors = [], [], []
    for corners, albedo in polygons:
        start = len(points)
        points.extend(corners)
        for i in range(1, len(corners) - 1):
            triangles.append((start, start + i, start + i + 1))
            colors.append(albedo)
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
    return out


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
    """`texture`: textures.Texture of the table. `room`: radiance of the room's map. `parts`: of "body" and "around"
    (table, clutter), what is there; lamps and room always are."""

    def __init__(self, scene: draw.Scene, texture, room: np.ndarray, folder: Path, parts=("body", "around")):
        t, self.scene = mi.ScalarTransform4f(), scene
        d = {"type": "scene",
             "room": {"type": "envmap", "bitmap": bitmap(room), "sampling_weight": 0.0}}
        for i, lamp in enumerate(scene.lamps):
            d[f"lamp_{i}"] = lamp_shape(lamp)
        if "body" in parts:
            d["paper"] = mesh(printed_polygons(scene), folder, "paper", scene.paper_roughness)
            ball = scene.model().ball
            if ball:
                d["ball"] = {"type": "sphere", "radius": ball.radius,
                             "center": list(bodies.turned(scene.attitude, scene.ball_center)),
                             "bsdf": surface(rgb(ball.albedo), scene.paper_roughness)}
        things = core_polygons(scene) if "body" in parts else []
        if "around" in parts:
            things += [p for thing in scene.clutter for p in clutter_polygons(thing)]
            d["table"] = self.table(texture, t)
        if things:
            d["things"] = mesh(things, folder, "things", 0.0)
        self.scene_mi = mi.load_dict(d)
        self.integrator = mi.load_dict({"type": "path", "max_depth": MAX_DEPTH, "rr_depth": 100})

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

    def picture(self, samples: float = PICTURE_SAMPLES) -> np.ndarray:
        area = self.scene.crop[2] * self.scene.crop[3]
        spp = int(np.clip(samples / area, *SAMPLES_PER_PIXEL))
        passes = max(1, round(spp * area / PASS_SAMPLES))
        seed, sensor = self.scene.numbers().seed(f"tracer.{self.scene.frame}") % 2**31, self.sensor()
        total = sum(np.array(mi.render(self.scene_mi, sensor=sensor, integrator=self.integrator,
                                       spp=max(1, spp // passes), seed=seed + i)) for i in range(passes))
        return (total / passes).astype(np.float64)

    def arriving(self, origins: np.ndarray, directions: np.ndarray, seed: int = 0) -> np.ndarray:
        """(n, 3) radiance along rays; 0 where a ray meets a lamp."""
        rays = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T),
                                             mi.Vector3f(np.asarray(directions, np.float32).T)))
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, len(directions))
        si = self.scene_mi.ray_intersect(rays)
        lamp = si.is_valid() & si.shape.is_emitter()
        radiance, _, _ = self.integrator.sample(self.scene_mi, sampler, rays)
        return np.array(dr.select(lamp, mi.Color3f(0), radiance)).T.astype(np.float64)

    def blocked(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """(n,) whether something is between; the last millimetre is not looked at."""
        way = np.asarray(targets, float) - origins
        far = np.linalg.norm(way, axis=1)
        rays = mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T), mi.Vector3f((way / far[:, None]).T),
                        mi.Float(np.maximum(far - 1e-3, 1e-4).astype(np.float32)), mi.Float(0.0), mi.Color0f())
        return np.array(self.scene_mi.ray_test(rays))

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) points, and (n,) whether each is on the table."""
        rays = mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T), mi.Vector3f(np.asarray(directions, np.float32).T))
        pi = self.scene_mi.ray_intersect_preliminary(rays)
        table = next(s for s in self.scene_mi.shapes() if s.id() == "table")
        hit = np.array(pi.is_valid() & (pi.shape == mi.ShapePtr(table)))
        return np.asarray(origins) + np.where(hit, np.array(pi.t), 0)[:, None] * directions, hit
