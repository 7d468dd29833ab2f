#!/usr/bin/env python3
"""Renders the pictures of marker scenes with Mitsuba 3, and writes the truth of each. Shares no code with Lightwell.

    render.py --index dev              what is missing of a set: dev, unseen, defects, moving, small
    render.py --index dev/0003,dev/0007    or single pictures
    render.py --index dev --minutes 5  stops after a picture when the time is over
    render.py --check dev/0003         compares the picture's faces with the truth; renders without the sensor
    render.py --check plain            compares a matte body below one lamp with the closed form

Pictures go to OUT/SET/PICTURE.jpg, the truth to OUT/SET.jsonl, a line a picture. A picture with a line is done.
Exit: 0 done, 1 something disagrees, 2 wrong usage.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import camera_sensor
import draw
import picture
import textures
import tracer
import truth

HERE = Path(__file__).resolve().parent


def write_atomically(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".part")
    partial.write_bytes(content)
    os.replace(partial, path)


def lines_of(path: Path) -> dict[str, dict]:
    """The truth by picture. A last line that was cut is ignored."""
    out = {}
    if path.exists():
        for line in path.read_text().splitlines():
            try:
                item = json.loads(line)
            except json.JSONDecodeError:
                continue
            if "name" in item:
                out[item["name"]] = item
    return out


def write_truth(path: Path, items: dict[str, dict]) -> None:
    """First the normals of `irradiance_rgb`, then the pictures by name."""
    head = {"normals": truth.numbers(truth.normals_in_camera(), 6)}
    lines = [head, *(items[name] for name in sorted(items))]
    text = "\n".join(json.dumps(line, separators=(",", ":")) for line in lines) + "\n"
    write_atomically(path, text.encode())


class Rendered:
    """A scene's radiance and the light in it; several pictures of defects share one."""

    def __init__(self, scene: draw.Scene):
        with tempfile.TemporaryDirectory() as temporary:
            folder, n = Path(temporary), scene.numbers()
            self.texture = textures.table_texture(scene.table, n.seed("texture"))
            room = textures.room_map(scene.room)
            room *= truth.room_radiance(scene, tracer.Traced(scene, self.texture, room, folder, ()))
            self.centre = truth.centre_light(scene, tracer.Traced(scene, self.texture, room, folder, ("around",)))
            traced = tracer.Traced(scene, self.texture, room, folder)
            self.faces = truth.face_lights(scene, traced)
            self.shadow = truth.shadow_px(scene, traced)
            self.radiance = picture.picture(scene, traced)

    def gains(self, scene: draw.Scene) -> np.ndarray:
        white = max((0.8 / np.pi * f["irradiance"] for f in self.faces), key=lambda c: c @ truth.LUMINANCE)
        light = sum(np.array(lamp.irradiance) for lamp in scene.lamps) + np.pi * self.centre["ambient_sh"][0] / (
            2 * np.sqrt(np.pi))
        return camera_sensor.gains_of(scene.sensor, white, light)

    def files(self, scene: draw.Scene) -> tuple[bytes, dict]:
        gains = self.gains(scene)
        jpeg, quality = camera_sensor.developed(scene, self.radiance, gains)
        line = truth.truth_of(scene, self.texture, self.centre, self.faces, self.shadow, gains)
        return jpeg, line | {"jpeg_quality": quality}


def render(names: list[str], out: Path, minutes: float) -> None:
    start, shared, rendered = time.time(), None, None
    for name in names:
        path, file = out / f"{name.partition('/')[0]}.jsonl", out / f"{name}.jpg"
        items = lines_of(path)
        if name in items and file.exists():
            continue
        if time.time() - start > 60 * minutes:
            print("stopped: the time is over; the rest is rendered by the next run")
            return
        began, scene = time.process_time(), draw.picture(name)
        # Defects of one scene share everything but the sensor.
        key = (scene.key, scene.frame)
        if key != shared:
            shared, rendered = key, Rendered(scene)
        jpeg, line = rendered.files(scene)
        write_atomically(file, jpeg)
        items[name] = line
        write_truth(path, items)
        print(f"{name}: {time.process_time() - began:.1f} s of processor, {len(jpeg) / 1000:.0f} kB, "
              f"{scene.crop[2]}x{scene.crop[3]}, {scene.body}", flush=True)


# ---------------------------------------------------------------------------------------------------------------------
# Checks
# ---------------------------------------------------------------------------------------------------------------------
def plain_scene() -> draw.Scene:
    """A ball lamp, matte paper without folds, a black table, hardly a room."""
    ranges = replace(draw.LAMP_IN_FRONT, size_px=(300, 301), bodies=("dodecahedron_100mm_white",))
    scene = draw.scene_of("plain", "plain", ranges)
    return replace(scene, table=replace(scene.table, albedo=(0.001,) * 3), room=replace(scene.room, share=1e-4),
                   lamps=(replace(scene.lamps[0], shape="ball", size_m=0.05),))


def patch_means(scene: draw.Scene, radiance: np.ndarray) -> dict[int, np.ndarray]:
    """Mean radiance over the white patches of each tag's face, from pixels 2 px inside of them."""
    x, y, w, h = scene.crop
    v, u = np.mgrid[0:h, 0:w]
    out = {}
    for face, frame in zip(scene.model().faces, scene.faces):
        values = []
        for outline, albedo in face.patches:
            if albedo[0] < 0.8 - 1e-9:
                continue
            q = [scene.camera.pixel(draw.bodies.turned(scene.attitude, frame.at((*p, 0.0)))) for p in outline]
            q = np.array(q) - (x, y)
            inside = np.ones((h, w), bool)
            for a, b in zip(q, np.roll(q, -1, 0)):
                across = ((b[0] - a[0]) * (v - a[1]) - (b[1] - a[1]) * (u - a[0])) / np.hypot(*(b - a))
                inside &= across < -2  # counter-clockwise from outside is clockwise with v downwards
            values.append(radiance[inside])
        values = np.concatenate(values) if values else np.zeros((0, 3))
        if len(values) >= 30:
            out[face.tag] = values.mean(0)
    return out


def check(name: str) -> int:
    scene = plain_scene() if name == "plain" else draw.picture(name)
    rendered = Rendered(scene)
    means, worst = patch_means(scene, rendered.radiance), 0.0
    for face in rendered.faces:
        if face["tag"] not in means:
            continue
        seen = means[face["tag"]] * np.pi / 0.8
        off = (seen @ truth.LUMINANCE) / (face["irradiance"] @ truth.LUMINANCE) - 1
        closed = ""
        if name == "plain":
            # A ball that is wholly above the horizon lights a small surface like a point (README.md).
            lamp, (_, normal, points) = scene.lamps[0], next(s for s in truth.surfaces(scene) if s[0] == face["tag"])
            way = np.array(lamp.position()) - points
            d = np.linalg.norm(way, axis=1)
            e = np.mean(np.maximum(0, way @ normal) / d * (lamp.distance / d) ** 2) * np.array(lamp.irradiance)
            lit = e @ truth.LUMINANCE
            if (way @ normal > lamp.size_m / 2).all():
                difference = face["irradiance"] @ truth.LUMINANCE / lit - 1
                worst = max(worst, abs(difference))
                closed = f", truth against closed form {100 * difference:+.2f} %"
        if scene.paper_roughness == 0 and face["irradiance"] @ truth.LUMINANCE > 0.1:
            worst = max(worst, abs(off))
        print(f"tag {face['tag']}: cosine {face['cosine']:.2f}, irradiance {face['irradiance'] @ truth.LUMINANCE:.3f}, "
              f"picture against truth {100 * off:+.2f} %{closed}")
    print(f"worst of the compared {100 * worst:.2f} %")
    return int(worst > 0.02)


def main() -> int:
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("--index", metavar="LIST", help="a set, or pictures with commas between")
    ap.add_argument("--check", metavar="PICTURE")
    ap.add_argument("--minutes", type=float, default=1e9)
    ap.add_argument("--first", type=int, help="only so many of the list")
    ap.add_argument("--threads", type=int, default=2)
    ap.add_argument("--out", type=Path, default=HERE)
    args = ap.parse_args()
    if (args.index is None) == (args.check is None):
        ap.error("give either --index or --check")
    tracer.dr.set_thread_count(args.threads)
    if args.check:
        return check(args.check)
    names = draw.names(args.index) if args.index in draw.SETS else args.index.split(",")
    render(names[:args.first], args.out, args.minutes)
    return 0


if __name__ == "__main__":
    sys.exit(main())
