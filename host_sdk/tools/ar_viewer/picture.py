#!/usr/bin/python3
"""Draws ar_viewer.jpg of the README: virtual objects around the real one of a path-traced trial.

usage: picture.py [--build DIR] [--trial NAME] [--output FILE] [--keep DIR]

The picture with the real object and the panorama at its top are those of tests/reference/mitsuba/viewer. measure_viewer
estimates the light from the panorama, ar_viewer draws the objects in it: left with all of the light, right with its
mean alone. Needs python3-pil (python3-matplotlib brings it)."""
import argparse
import contextlib
import json
import pathlib
import subprocess
import tempfile

from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[3]
# Of the picture of 1280x960 pixels: the table.
CROP = (110, 170, 1060, 830)
WIDTH = 500

OBJECTS = [
    {"mesh": "teapot", "size_m": 0.16, "material": "plastic",
     "T_world_object": {"position": [0.17, 0, 0], "rotation": [0, 0.3, 0, 0.95]}},
    {"mesh": "sphere", "size_m": 0.08, "material": "mirror", "T_world_object": {"position": [-0.1, 0, 0.03]}},
    {"mesh": "sphere", "size_m": 0.07, "material": "glass", "T_world_object": {"position": [0.06, 0, 0.13]}},
    {"mesh": "cloth", "size_m": 0.13, "material": {"base_color": [0.15, 0.3, 0.6]},
     "T_world_object": {"position": [-0.24, 0, -0.1], "rotation": [0, -0.25, 0, 0.97]}},
    {"mesh": "box", "size_m": 0.06, "material": "gold",
     "T_world_object": {"position": [-0.08, 0, 0.16], "rotation": [0, 0.2, 0, 0.98]}},
    # The twin of the real cylinder, which stands in the origin.
    {"mesh": "cylinder", "size_m": [0.03, 0.078, 0.03], "material": {"base_color": [0.5, 0.46, 0.4]},
     "T_world_object": {"position": [0.05, 0, -0.1]}},
]


def draw(build, folder, trial, shading):
    scene = json.loads((folder / f"{trial}_top_full.json").read_text())
    scene["background"] = scene["background"].replace("_without.", "_with.")
    scene["ground"] = {"size_m": [1.2, 0.9]}
    scene["objects"] = OBJECTS
    scene["shading"] = shading
    path = folder / f"picture_{shading}.json"
    path.write_text(json.dumps(scene))
    subprocess.run([build / "bin/ar_viewer", path, "--headless", "--out", folder], check=True)
    picture = Image.open(folder / "frame_0000.png").crop(CROP)
    return picture.resize((WIDTH, round(WIDTH * picture.height / picture.width)), Image.LANCZOS)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/dev", help="[build/dev]")
    parser.add_argument("--trial", default="01", help="[01]")
    parser.add_argument("--output", type=pathlib.Path, default=pathlib.Path(__file__).parent / "ar_viewer.jpg")
    parser.add_argument("--keep", type=pathlib.Path, help="keep the scenes and their files in this new folder")
    arguments = parser.parse_args()
    if arguments.keep:
        arguments.keep.mkdir(parents=True)
    with contextlib.nullcontext(arguments.keep) if arguments.keep else tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([arguments.build / "bin/measure_viewer", "--trial", arguments.trial, "--write", folder],
                       check=True, stdout=subprocess.DEVNULL)
        halves = [draw(arguments.build, folder, arguments.trial, shading) for shading in ("full", "constant")]
    both = Image.new("RGB", (2 * WIDTH + 4, halves[0].height), "white")
    both.paste(halves[0], (0, 0))
    both.paste(halves[1], (WIDTH + 4, 0))
    both.save(arguments.output, quality=85, optimize=True)


if __name__ == "__main__":
    main()
