"""A drawn scene in Mitsuba 3: the picture's radiance, and the light that arrives along given rays.

    Traced(scene, ...)                        loads the scene
    .direct_light(...), .other_light(...)     (h, w, 3) of the crop
    .arriving(...), .blocked(...), .hits(...) along given rays
    .surfaces()                               (h, w) the surface in the middle of each pixel

`llvm_ad_rgb` needs a newer LLVM library than Debian 12's (llvm_library.py).
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import llvm_library  # noqa: E402, F401 (before drjit)
import drjit as dr  # noqa: E402 (the library is named before)
import mitsuba as mi  # noqa: E402

import bodies  # noqa: E402
import draw  # noqa: E402
from placing import Clutter  # noqa: E402

mi.set_variant("llvm_ad_rgb")
mi.set_log_level(mi.LogLevel.Error)

MAX_DEPTH = 4                   # segments of a path from a surface that is looked at
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


def z_order(column, row):
    """Morton's index of a pixel: the bits of row and column in turn."""
    out = mi.UInt32(0)
    for bit in range(11):
        out |= ((column >> bit) & 1) << (2 * bit) | ((row >> bit) & 1) << (2 * bit + 1)
    return out


def low_discrepancy(index, dimensions: int) -> list:
    """Points of the R sequence (Roberts 2018). With indices in Z-order the samples of neighbouring pixels complement
    each other, so that less noise remains after smoothing (Ahmed and Wonka 2020, doi:10.1145/3414685.3417881)."""
    base = 2.0
    for _ in range(60):  # the root of base^(d + 1) = base + 1
        base = (1 + base) ** (1 / (dimensions + 1))
    steps = [round(base ** -(k + 1) * 2**32) | 1 for k in range(dimensions)]
    return [mi.Float((index * mi.UInt32(step)) >> 8) * (1 / 2**24) for step in steps]


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
        things, self.surface_numbers = [], {}
        if "body" in parts:
            d["paper"], self.surface_numbers["paper"] = mesh(printed_polygons(scene), folder, "paper",
                                                             scene.paper_roughness)
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
            d["things"], self.surface_numbers["things"] = mesh(things, folder, "things", 0.0)
        self.scene_mi = mi.load_dict(d)
        self.lamps_mi = [s.emitter() for s in self.scene_mi.shapes() if s.is_emitter()]
        self.path = mi.load_dict({"type": "path", "max_depth": MAX_DEPTH, "rr_depth": 100})

    def table(self, texture, t) -> dict:
        table = self.scene.table
        (w, h), e = table.half_size_m, texture.extent_m
        picture = {"type": "bitmap", "bitmap": bitmap(texture.reflectance), "raw": True, "wrap_mode": "repeat",
                   "to_uv": t.scale([2 * w / e, 2 * h / e, 1])}
        place = t.translate([0, self.scene.table_height, 0]).rotate([0, 1, 0], table.turn_deg).rotate(
            [1, 0, 0], -90).scale([w, h, 1])
        return {"type": "rectangle", "to_world": place, "bsdf": surface(picture, table.roughness)}

    def samples(self, strata: int, salt: int):
        """Camera rays of the crop, `strata` squared in each pixel, in parts of at most PASS_SAMPLES: (rays, sampler,
        index for low_discrepancy(), samples a pixel)."""
        c, (x, y, w, h) = self.scene.camera, self.scene.crop
        seed = self.scene.numbers().seed(f"tracer.{self.scene.frame}.{salt}") % 2**31
        cells = np.array([(i, j) for i in range(strata) for j in range(strata)], np.float32)
        parts = max(1, round(w * h * len(cells) / PASS_SAMPLES))
        # Opaque: a literal would be compiled into the kernel, anew for each scene.
        column = [dr.opaque(mi.Vector3f, [row[k] for row in c.rotation]) for k in range(3)]
        eye = dr.opaque(mi.Point3f, c.position)
        across, left, top, focal = (dr.opaque(mi.Float, v) for v in (strata, x - c.width / 2, y - c.height / 2,
                                                                     c.focal_px))
        start, of_pixel = 0, dr.opaque(mi.UInt32, len(cells))
        for part in np.array_split(cells, parts):
            n = len(part)
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(seed + start, w * h * n)
            per_pixel, width, at = dr.opaque(mi.UInt32, n), dr.opaque(mi.UInt32, w), dr.arange(mi.UInt32, w * h * n)
            pixel = at // per_pixel
            cell, row = at - pixel * per_pixel, pixel // width
            column_number, jitter = pixel - row * width, sampler.next_2d()
            u, v = (dr.gather(mi.Float, mi.Float(np.ascontiguousarray(part[:, a])), cell) for a in (0, 1))
            u = mi.Float(column_number) + (u + jitter.x) / across + left
            v = mi.Float(row) + (v + jitter.y) / across + top
            d = dr.normalize((column[0] * u - column[1] * v) / focal - column[2])
            order = z_order(column_number, row) * of_pixel + cell + dr.opaque(mi.UInt32, (start + seed) % 2**32)
            yield mi.RayDifferential3f(mi.Ray3f(eye, d)), sampler, order, n
            start += n

    def sums(self, color, n: int) -> np.ndarray:
        """(h, w, 3) sums over the n samples of each pixel."""
        w, h = self.scene.crop[2:]
        dr.eval(color)  # once for the three channels
        return np.stack([np.array(dr.block_sum(channel, n)) for channel in color], -1).reshape(h, w, 3).astype(float)

    def direct_light(self, strata: int) -> tuple[np.ndarray, np.ndarray]:
        """(h, w, 3) radiance of visible lamps and room, and of what surfaces reflect of the lamps' direct light; (h, w,
        3) diffuse reflectance. Each sample goes to each lamp."""
        context, light, albedo = mi.BSDFContext(), 0.0, 0.0
        for rays, sampler, order, n in self.samples(strata, 0):
            si = self.scene_mi.ray_intersect(rays)
            bsdf, total = si.bsdf(rays), si.emitter(self.scene_mi).eval(si)
            for i, emitter in enumerate(self.lamps_mi):
                place = mi.Point2f(*low_discrepancy(order, 3)[i % 2:][:2])
                ds, weight = emitter.sample_direction(si, place, si.is_valid())
                lit = si.is_valid() & (ds.pdf > 0)
                lit &= ~self.scene_mi.ray_test(si.spawn_ray_to(ds.p), lit)
                total += dr.select(lit, bsdf.eval(context, si, si.to_local(ds.d), lit) * weight, 0)
            reflectance = bsdf.eval_diffuse_reflectance(si, si.is_valid())
            dr.eval(total, reflectance)
            light, albedo = light + self.sums(total, n), albedo + self.sums(reflectance, n)
        return light / strata**2, albedo / strata**2

    def other_light(self, strata: int) -> np.ndarray:
        """(h, w, 3) radiance of what surfaces reflect of all light but the lamps' direct."""
        context, light = mi.BSDFContext(), 0.0
        for rays, sampler, order, n in self.samples(strata, 1):
            si = self.scene_mi.ray_intersect(rays)
            lobe, *way = low_discrepancy(order, 3)
            bs, weight = si.bsdf(rays).sample(context, si, lobe, mi.Point2f(*way), si.is_valid())
            onward = mi.RayDifferential3f(si.spawn_ray(si.to_world(bs.wo)))
            seen = self.radiance(onward, sampler, si.is_valid() & (bs.pdf > 0))
            light = light + self.sums(dr.select(si.is_valid() & (bs.pdf > 0), weight * seen, 0), n)
        return light / strata**2

    def radiance(self, rays, sampler, active=True):
        """Radiance along rays; 0 where a ray meets a lamp."""
        si = self.scene_mi.ray_intersect(rays, active)
        radiance, _, _ = self.path.sample(self.scene_mi, sampler, rays, None, active)
        return dr.select(si.is_valid() & si.shape.is_emitter(), mi.Color3f(0), radiance)

    def arriving(self, origins: np.ndarray, directions: np.ndarray, seed: int = 0) -> np.ndarray:
        """(n, 3) radiance along rays; 0 where a ray meets a lamp."""
        rays = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T),
                                             mi.Vector3f(np.asarray(directions, np.float32).T)))
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, len(directions))
        return np.array(self.radiance(rays, sampler)).T.astype(np.float64)

    def blocked(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """(n,) whether something is between; the last millimetre is not looked at."""
        way = np.asarray(targets, float) - origins
        far = np.linalg.norm(way, axis=1)
        rays = mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T), mi.Vector3f((way / far[:, None]).T),
                        mi.Float(np.maximum(far - 1e-3, 1e-4).astype(np.float32)), mi.Float(0.0), mi.Color0f())
        return np.array(self.scene_mi.ray_test(rays))

    def hits(self, origins: np.ndarray, directions: np.ndarray):
        """First intersections, and the names of the shapes with the mask of each."""
        rays = mi.Ray3f(mi.Point3f(np.asarray(origins, np.float32).T),
                        mi.Vector3f(np.asarray(directions, np.float32).T))
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
            if name in self.surface_numbers:
                out[of[name]] = thousands + self.surface_numbers[name][triangle[of[name]]]
        return out.reshape(shape)
