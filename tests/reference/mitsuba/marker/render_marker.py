#!/usr/bin/env python3
"""Path-traces a marker with twelve faces under known lamps with Mitsuba 3: frames and the ground truth of each.

Shares no code with Lightwell: geometry in dodecahedron.py, scenes in scenes.py, panoramas in panorama.py, the checks in
check.py.

    render_marker.py                 render what is missing, in the order of scenes.py; each frame is written as it is
    done render_marker.py --group grid    only that group (grid low air near far two room extra)
    render_marker.py --check         render nothing, check files and truth against each other (seconds)
    render_marker.py --bodies DIR    where Lightwell's body files are, which are compared with this geometry each time

Exit: 0 done, 1 something disagrees (the message says what).
"""

import argparse
import hashlib
import json
import tempfile
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

import check
import dodecahedron as body
import panorama as pan
import scenes

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)

HERE = Path(__file__).resolve().parent
SEED = 31000
PASS_SAMPLES = 100  # a pixel and a pass; squares suit the sampler


def rgb(c) -> dict:
    return {"type": "rgb", "value": [float(v) for v in c]}


# ---------------------------------------------------------------------------------------------------------------------
# Scenes for Mitsuba
# ---------------------------------------------------------------------------------------------------------------------
def mesh(polygons: list[np.ndarray], folder: Path, name: str) -> dict:
    """Convex polygons in space, counter-clockwise from outside, as one mesh."""
    points, triangles = [], []
    for p in polygons:
        start = len(points)
        points.extend(p)
        triangles.extend((start, start + i, start + i + 1) for i in range(1, len(p) - 1))
    lines = ["ply", "format ascii 1.0", f"element vertex {len(points)}", *(f"property float {a}" for a in "xyz"),
             f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header",
             *(" ".join(f"{v:.9g}" for v in p) for p in points), *(f"3 {a} {b} {c}" for a, b, c in triangles)]
    path = folder / f"{name}.ply"
    path.write_text("\n".join(lines) + "\n")
    return {"type": "ply", "filename": str(path), "face_normals": True}


def body_polygons(frame: scenes.Frame) -> list[tuple[int, float, np.ndarray]]:
    """(face, albedo, corners in the world) of every printed polygon."""
    out = []
    for i, m in enumerate(frame.world_body() @ body.faces()):
        for polygon, albedo in body.ink(frame.variant, i):
            out.append((i, albedo, np.column_stack([polygon, np.zeros(len(polygon))]) @ m[:3, :3].T + m[:3, 3]))
    return out


def matte_body(frame: scenes.Frame, folder: Path) -> dict:
    """One mesh per albedo: every cell of every tag is geometry, so no texture is interpolated."""
    polygons = body_polygons(frame)
    return {f"paper_{round(100 * a)}": mesh([p for _, b, p in polygons if b == a], folder, f"paper_{round(100 * a)}") |
            {"bsdf": {"type": "diffuse", "reflectance": rgb([a] * 3)}} for a in sorted({b for _, b, _ in polygons})}


def sphere(centre, radius: float) -> dict:
    return {"type": "sphere", "center": [float(v) for v in centre], "radius": radius}


def thing(kind: str, numbers: list) -> dict:
    grey = {"bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb([scenes.THING_ALBEDO] * 3)}}}
    if kind == "sphere":
        return sphere(*numbers) | grey
    assert kind == "cylinder"
    return {"type": "cylinder", "p0": list(numbers[0]), "p1": list(numbers[1]), "radius": numbers[2]} | grey


def lit_scene(frame: scenes.Frame, lamp: scenes.Lamp, folder: Path) -> mi.Scene:
    """One lamp and its share of the ambient light. Several lamps are added afterwards: next to a lamp that a sample did
    not choose, the one that it did would be all noise. Rays find the ambient light by themselves (a sampling weight of
    0 for it): under open sky it is then free of noise."""
    share = scenes.AMBIENT / len(frame.lamps)
    t = mi.ScalarTransform4f
    d = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4, "rr_depth": 100, "hide_emitters": not frame.lamp_visible},
        "lamp": sphere(lamp.position(), lamp.radius)
        | {
            "bsdf": {"type": "diffuse", "reflectance": rgb([0] * 3)},
            "emitter": {"type": "area", "radiance": rgb(lamp.radiance()), "sampling_weight": 1.0},
        },
        "around": {"type": "constant", "radiance": rgb([share] * 3), "sampling_weight": 0.0},
    }
    if frame.board:
        place = (
            t()
            .translate([0, scenes.BOARD_HEIGHT, 0])
            .rotate([1, 0, 0], -90)
            .scale([scenes.BOARD_SIZE[0] / 2, scenes.BOARD_SIZE[1] / 2, 1])
        )
        d["board"] = {
            "type": "rectangle",
            "to_world": place,
            "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb([scenes.BOARD_ALBEDO] * 3)}},
        }
    for i, (kind, *numbers) in enumerate(frame.things):
        d[f"thing_{i}"] = thing(kind, numbers)
    return mi.load_dict(d | matte_body(frame, folder))


def sky(image: np.ndarray) -> dict:
    """The house's panorama as Mitsuba's. Mitsuba's middle column is +Z, the house's -Z: half a turn. And Mitsuba has
    the first and the last row's centres on the poles (half a pixel off there, none at the horizon): rows at half steps,
    those between two of ours their mean, are the same picture by either reading, bilinear between pixel centres.
    sky_off_by_deg() holds both against a bright block.
    """
    height, width = image.shape[:2]
    over = [
        np.concatenate([np.roll(image[:1], width // 2, 1), image]),
        np.concatenate([image, np.roll(image[-1:], width // 2, 1)]),
    ]
    rows = np.empty((2 * height + 1, width, 3), np.float32)
    rows[0::2], rows[1::2] = (over[0] + over[1]) / 2, image
    bitmap = mi.Bitmap(rows, mi.Bitmap.PixelFormat.RGB)
    return {"type": "envmap", "bitmap": bitmap, "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 180)}


def sky_off_by_deg() -> float:
    """A block of 4x4 pixels, looked at from the middle of the room: how far its centroid lies from the house's
    direction of it."""
    worst, height = 0.0, 256
    for row, column in [(90, 100), (40, 300), (150, 470), (200, 256)]:
        image = np.zeros((height, 2 * height, 3))
        image[row:row + 4, column:column + 4] = 1.0
        expected = body.unit(pan.directions(height)[row:row + 4, column:column + 4].mean((0, 1)))
        camera = {
            "type": "perspective",
            "fov": 10.0,
            "to_world": mi.ScalarTransform4f().look_at([0, 0, 0], expected.tolist(), [0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": 64,
                "height": 64,
                "pixel_format": "luminance",
                "rfilter": {"type": "box"},
            },
        }
        scene = mi.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": 1}, "sky": sky(image)})
        seen = np.array(mi.render(scene, sensor=mi.load_dict(camera), spp=16), float).reshape(64, 64)
        at = (np.arange(64) + 0.5) / 32 - 1
        offset = np.tan(np.radians(5)) * np.array([(seen.sum(0) @ at), (seen.sum(1) @ at)]) / seen.sum()
        worst = max(worst, float(np.degrees(np.hypot(*offset))))
    return worst


def sensor(camera: scenes.Camera, color: bool, crop: tuple[int, int, int, int] | None = None) -> mi.Sensor:
    m = camera.axes()
    x, y, w, h = crop or (0, 0, camera.width, camera.height)
    look = mi.ScalarTransform4f().look_at(
        origin=m[:3, 3].tolist(), target=(m[:3, 3] - m[:3, 2]).tolist(), up=m[:3, 1].tolist()
    )
    return mi.load_dict(
        {
            "type": "perspective",
            "fov": float(np.degrees(2 * np.arctan(camera.width / 2 / camera.focal_px))),
            "fov_axis": "x",
            "near_clip": 0.01,
            "far_clip": 100.0,
            "to_world": look,
            "film": {
                "type": "hdrfilm",
                "width": camera.width,
                "height": camera.height,
                "crop_offset_x": x,
                "crop_offset_y": y,
                "crop_width": w,
                "crop_height": h,
                "pixel_format": "rgb" if color else "luminance",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "multijitter"},
        }
    )


# ---------------------------------------------------------------------------------------------------------------------
# Rendering
# ---------------------------------------------------------------------------------------------------------------------
def passes(
    scene: mi.Scene, camera: mi.Sensor, spp: int, seed: int, integrator: mi.Integrator | None = None
) -> np.ndarray:
    """(h, w, channels): the mean of passes with different seeds."""
    count = max(1, round(spp / PASS_SAMPLES))
    each, more = spp // count, {} if integrator is None else {"integrator": integrator}
    total = (
        sum(np.array(mi.render(scene, sensor=camera, spp=each, seed=seed + i, **more), float) for i in range(count))
        / count
    )
    return total[..., None] if total.ndim == 2 else total


def render_lit(frame: scenes.Frame, key: int, args: argparse.Namespace, folder: Path) -> list[np.ndarray]:
    """Two independent halves. The body is small and its paper needs little noise, so it gets additional samples."""
    x, y, w, h = scenes.body_box(frame)
    halves = [np.zeros((frame.camera.height, frame.camera.width, 3 if frame.color else 1)) for _ in range(2)]
    for number, lamp in enumerate(frame.lamps):
        scene = lit_scene(frame, lamp, folder)
        for half in range(2):
            seed = SEED + 10000 * key + 1000 * number + 200 * half
            picture = passes(scene, sensor(frame.camera, frame.color), args.board_spp // 2, seed)
            picture[y : y + h, x : x + w] = passes(
                scene, sensor(frame.camera, frame.color, (x, y, w, h)), args.body_spp // 2, seed + 100
            )
            halves[half] += picture
    return halves


def face_light(image: np.ndarray, normal: np.ndarray, spp: int, seed: int) -> list[np.ndarray]:
    """Radiance of a white, matte plane that faces `normal` in the room: two halves, each rgb."""
    t = mi.ScalarTransform4f()
    side = [1, 0, 0] if abs(normal[0]) < 0.9 else [0, 1, 0]
    plane = {"type": "rectangle", "to_world": t.look_at(origin=[0, 0, 0], target=normal.tolist(), up=side),
             "bsdf": {"type": "diffuse", "reflectance": rgb([1] * 3)}}
    camera = mi.load_dict(
        {
            "type": "perspective",
            "fov": 20.0,
            "to_world": t.look_at(origin=normal.tolist(), target=[0, 0, 0], up=side),
            "film": {
                "type": "hdrfilm",
                "width": 32,
                "height": 32,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "multijitter"},
        }
    )
    scene = mi.load_dict(
        {"type": "scene", "integrator": {"type": "path", "max_depth": 2}, "sky": sky(image), "plane": plane}
    )
    return [passes(scene, camera, spp // 2, seed + 500 * half).mean((0, 1)) for half in range(2)]


def render_room(
    frame: scenes.Frame, image: np.ndarray, key: int, args: argparse.Namespace, folder: Path
) -> tuple[list[np.ndarray], np.ndarray]:
    """Two halves, and (12, 2, 3) the light on every face that is seen.

    The room is infinitely far and the body convex: each face is lit alike all over and by nothing but the room. So
    Mitsuba first measures the radiance of a white plane in each face's attitude with a million samples, then draws the
    body with every patch shining with albedo times that. The frame has the noise of a million samples in every pixel.
    """
    normals = body.normals() @ frame.world_body()[:3, :3].T
    seen = np.flatnonzero(scenes.facing(frame) > 0)
    light = np.zeros((12, 2, 3))
    for i in seen:
        light[i] = face_light(image, normals[i], args.face_spp, SEED + 10000 * key + 10 * int(i))
    d = {"type": "scene", "integrator": {"type": "path", "max_depth": 1}, "sky": sky(image)}
    polygons = body_polygons(frame)
    for i, albedo in sorted({(i, a) for i, a, _ in polygons}):
        name = f"face_{i}_{round(100 * albedo)}"
        d[name] = mesh([p for j, a, p in polygons if (j, a) == (i, albedo)], folder, name) | {
            "bsdf": {"type": "diffuse", "reflectance": rgb([0] * 3)},
            "emitter": {"type": "area", "radiance": rgb(albedo * light[i].mean(0))}}
    scene = mi.load_dict(d)
    return [
        passes(scene, sensor(frame.camera, True), 36, SEED + 10000 * key + 5000 + 200 * half) for half in range(2)
    ], light


# ---------------------------------------------------------------------------------------------------------------------
# Files
# ---------------------------------------------------------------------------------------------------------------------
def rounded(image: np.ndarray, bits: int) -> np.ndarray:
    """Rounds half floats to nearest with `bits` bits of mantissa, because noise in the other bits does not compress."""
    drop = 10 - bits
    raw = np.ascontiguousarray(image.astype(np.float16)).view(np.uint16).astype(np.uint32)
    if drop:
        raw = ((raw + (1 << (drop - 1))) >> drop) << drop
    return raw.astype(np.uint16).view(np.float16)


def write_exr(path: Path, image: np.ndarray, exact: tuple[int, int, int, int] | None = None) -> None:
    """Mantissas of 7 bits (0.2 % RMS); within the box `exact`, which has no noise that would hide the steps, of all
    10."""
    dr.set_thread_count(2)  # with one thread Mitsuba's EXR writer and reader never return
    kind = mi.Bitmap.PixelFormat.RGB if image.shape[2] == 3 else mi.Bitmap.PixelFormat.Y
    partial, small = path.with_suffix(".part"), rounded(image, 7)
    if exact:
        x, y, w, h = exact
        small[y:y + h, x:x + w] = rounded(image[y:y + h, x:x + w], 10)
    mi.Bitmap(small, kind).write(str(partial), mi.Bitmap.FileFormat.OpenEXR)
    partial.rename(path)


def read_exr(path: Path) -> np.ndarray:
    """(h, w, channels)."""
    dr.set_thread_count(2)
    image = np.array(mi.Bitmap(str(path)).convert(component_format=mi.Struct.Type.Float32), dtype=float)
    return image[..., None] if image.ndim == 2 else image


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def read_room(frame: scenes.Frame, folder: Path) -> tuple[np.ndarray, dict]:
    """The panorama, cleaned and turned, and what the truth says of it, in the probe's axes."""
    path = folder / f"{frame.panorama}.exr"
    image = pan.clean(read_exr(path))
    width = image.shape[1]
    was = pan.bright_region(image)["direction"]
    # A column to the right is a smaller azimuth: azimuths grow from +Z towards +X.
    columns = round((np.degrees(np.arctan2(was[0], was[2])) - frame.light_azimuth_deg) / 360 * width) % width
    image = pan.turned(image, columns)
    bright = pan.bright_region(image)
    points = pan.fibonacci(256)
    normals = points[points @ (0, 0, 1) > np.cos(np.radians(60))]  # the probe's +Z: from the body to the camera's side
    to_world = frame.camera.axes()[:3, :3]
    first = np.tensordot(image @ pan.LUMINANCE * pan.solid_angles(image.shape[0]), pan.directions(image.shape[0]), 2)
    facing = pan.irradiance(image, bright["direction"])[0] @ pan.LUMINANCE
    world_normals = body.normals() @ frame.world_body()[:3, :3].T
    lit = world_normals @ bright["direction"]
    return image, {
        "file": path.name,
        "sha256": sha256(path),
        "turned_right_by_columns": columns,
        "width": width,
        "turn_about_y_deg": round(-360 * columns / width, 6),
        "strongest": {
            "direction": scenes.floats(scenes.turn_to_probe(frame, bright["direction"])),
            "vector_irradiance_rgb": scenes.floats(bright["vector_irradiance_rgb"]),
            "angular_radius_deg": round(bright["angular_radius_deg"], 4),
            "pixels": bright["pixels"],
            "share_of_irradiance_facing_it": round(float(bright["vector_irradiance_rgb"] @ pan.LUMINANCE / facing), 4),
            "seen_faces_lit": [int(i) for i in np.flatnonzero((scenes.facing(frame) > 0) & (lit > 0))],
        },
        "mean_direction": scenes.floats(scenes.turn_to_probe(frame, first / np.linalg.norm(first))),
        "face_irradiance_rgb": [scenes.floats(e) for e in pan.irradiance(image, world_normals)],
        "normals": [scenes.floats(n) for n in normals],
        "irradiance_rgb": [scenes.floats(e) for e in pan.irradiance(image, normals @ to_world.T)],
    }


def load_truth(out: Path) -> dict:
    path = out / "scenes.json"
    known = json.loads(path.read_text()) if path.exists() else {}
    return {
        "what": "Frames of a marker with twelve faces and the truth of each. See README.md.",
        "axes": "all vectors in the probe's axes: the camera at the origin, x right, y up, z back; metres",
        "pixels": "u = cx + fx x / -z, v = cy - fy y / -z; the centre of the top left pixel is (0, 0)",
        "made_with": {
            "mitsuba": mi.__version__,
            "variant": mi.variant(),
            "filter": "box",
            "sampler": "multijitter",
            "seed": SEED,
        },
        "frames": known.get("frames", {}),
    }


def save_truth(out: Path, everything: dict) -> None:
    order = [f.name for f in scenes.FRAMES]
    everything["frames"] = {k: everything["frames"][k] for k in order if k in everything["frames"]}
    head = {k: v for k, v in everything.items() if k != "frames"}
    # A line a frame's field: it diffs well and stays short.
    blocks = [
        f"  {json.dumps(k)}: {{\n" + ",\n".join(f"   {json.dumps(a)}: {json.dumps(b)}" for a, b in v.items()) + "\n  }"
        for k, v in everything["frames"].items()
    ]
    start = "".join(f" {json.dumps(k)}: {json.dumps(v)},\n" for k, v in head.items())
    text = "{\n" + start + ' "frames": {\n' + ",\n".join(blocks) + "\n }\n}\n"
    partial = out / "scenes.json.part"
    partial.write_text(text)
    partial.rename(out / "scenes.json")


def make(frame: scenes.Frame, key: int, args: argparse.Namespace) -> dict:
    start, truth = time.time(), scenes.truth(frame)
    with tempfile.TemporaryDirectory() as temporary:
        if frame.panorama:
            image, truth["panorama"] = read_room(frame, args.panoramas)
            dr.set_thread_count(args.threads)
            halves, light = render_room(frame, image, key, args, Path(temporary))
            mean = light.mean(1)
            spread = np.abs(light[:, 0] - light[:, 1])[mean[:, 1] > 0] / 2 / mean[mean[:, 1] > 0]
            truth["noise"] = {"light_on_a_face_largest": round(float(spread.max()), 5)}
            truth["samples_per_pixel"] = {"light_on_a_face": args.face_spp * 32 * 32, "picture": 72}
        else:
            dr.set_thread_count(args.threads)
            halves = render_lit(frame, key, args, Path(temporary))
            truth["noise"] = check.noise(frame, halves)
            truth["samples_per_pixel"] = {"body": args.body_spp, "board": args.board_spp}
    write_exr(args.out / truth["file"], (halves[0] + halves[1]) / 2, scenes.body_box(frame) if frame.panorama else None)
    return truth | {"seconds": round(time.time() - start, 1), "sha256": sha256(args.out / truth["file"])}


def main() -> int:
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("--check", action="store_true", help="render nothing, check what is in --out")
    ap.add_argument("--group", action="append", help="only this group; may be given again")
    ap.add_argument("--frame", action="append", help="only this frame; may be given again")
    ap.add_argument("--again", action="store_true", help="render also what is there")
    ap.add_argument("--bodies", type=Path, default=HERE.parents[3] / "firmware/estimate/marker/bodies",
                    help="the folder with dodecahedron_100mm_{white,grey}.textproto")
    ap.add_argument("--panoramas", type=Path, default=Path.home() / ".cache/lightwell/panoramas",
                    help="what cmake/fetch_panoramas --all printed")
    ap.add_argument("--out", type=Path, default=HERE)
    ap.add_argument("--body-spp", type=int, default=128, help="samples a pixel of the body")
    ap.add_argument("--board-spp", type=int, default=18, help="samples a pixel of the rest")
    ap.add_argument("--face-spp", type=int, default=1000, help="of rooms: samples a face, times 1024")
    ap.add_argument("--threads", type=int, default=1)
    args = ap.parse_args()

    for variant in body.QUADRANTS:
        path = args.bodies / f"dodecahedron_100mm_{variant}.textproto"
        if not path.exists():
            print(f"NOT COMPARED: {path} is not there")
        else:
            try:
                found = body.compare(path, variant)
                print(f"{path.name}: poses within {found.pose_m:.1e} m, outlines within {found.outline_m:.1e} m, "
                      f"patches cover {found.coverage:.6f} of the quadrants")
            except body.Disagreement as e:
                print(f"BODY FILE DISAGREES: {e}")
                return 1
    chosen = [
        f
        for f in scenes.FRAMES
        if (not args.group or f.group in args.group) and (not args.frame or f.name in args.frame)
    ]
    if not args.check:
        args.out.mkdir(parents=True, exist_ok=True)
        for key, frame in enumerate(scenes.FRAMES):
            if frame not in chosen:
                continue
            everything = load_truth(args.out)  # read again: another run may have added to it
            path, known = args.out / f"{frame.name}.exr", everything["frames"].get(frame.name)
            if not args.again and known and path.exists() and sha256(path) == known["sha256"]:
                continue
            done = make(frame, key, args)
            everything["frames"][frame.name] = done
            save_truth(args.out, everything)
            print(
                f"{frame.name}: {done['seconds']} s, {path.stat().st_size / 1000:.0f} kB, noise {done['noise']}",
                flush=True,
            )
    off = sky_off_by_deg()
    print(f"a bright block of a panorama lies {off:.3f} degrees from where the house has it")
    if off > 0.05:  # near a pole a block is no small patch any more; half a pixel would be 0.35
        return 1
    return check.run(chosen, args.out, load_truth(args.out)["frames"], read_exr, sha256)


if __name__ == "__main__":
    raise SystemExit(main())
