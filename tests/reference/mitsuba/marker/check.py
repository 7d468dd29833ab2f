"""Checks frames, ground truth and closed forms against each other. No rendering; needs numpy, and pyapriltags for tags.

    noise(frame, halves)   of two independent renders
    run(...)               every check; prints what it found, returns the exit code

The closed form of a lit face: a sphere of radiance L and radius R whose centre is at distance d, wholly above the
horizon of a matte point of albedo a, gives it the radiance a L (R/d)^2 cos theta. Sky of radiance A over the share s of
its hemisphere that the board leaves: a A s. The board: its radiance by the same forms, with the shadow that the body
casts, summed over rays.
"""

import functools
from collections.abc import Callable
from pathlib import Path

import numpy as np

import dodecahedron as body
import scenes

TAG_LIMIT_PX = 0.3
# Tolerances of the radiance of a face's white paper against the closed form: relative, and absolute for the
# interreflection between body and board, which the closed form leaves out (measured: 0.0016).
MEAN_LIMIT, MEAN_LIMIT_ABSOLUTE = 0.01, 0.003

ROOM_LIMIT = 0.01  # noise of a million samples, and a sum over pixels against an integral between them


# ---------------------------------------------------------------------------------------------------------------------
# Where a pixel's ray goes
# ---------------------------------------------------------------------------------------------------------------------
def hit_body(origin: np.ndarray, directions: np.ndarray, world_body: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(...) the face met first (-1: none) and the ray's parameter there. The body is the space behind twelve planes."""
    normals = body.normals() @ world_body[:3, :3].T
    along, height = directions @ normals.T, body.INRADIUS - np.asarray(origin) @ normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = height / along
    enter, leave = np.where(along < 0, t, -np.inf), np.where(along > 0, t, np.inf)
    face, near = enter.argmax(-1), enter.max(-1)
    return np.where((near < leave.min(-1)) & (near > 0), face, -1), near


def pixel_rays(frame: scenes.Frame, dx: float = 0.0, dy: float = 0.0) -> np.ndarray:
    """(h, w, 3), world, through the pixels' centres, or beside them."""
    c = frame.camera
    u, v = np.meshgrid(np.arange(c.width) + dx, np.arange(c.height) + dy)
    d = np.stack([(u - (c.width - 1) / 2) / c.focal_px, -(v - (c.height - 1) / 2) / c.focal_px, -np.ones_like(u)], -1)
    return d @ c.axes()[:3, :3].T


def printed(frame: scenes.Frame, dx: float = 0.0, dy: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of every pixel: face or -1, albedo (0: none), and the point in the world."""
    x, y, w, h = scenes.body_box(frame)
    part = (slice(y, y + h), slice(x, x + w))
    rays, place = pixel_rays(frame, dx, dy)[part], frame.camera.axes()[:3, 3]
    face, albedo = np.full((frame.camera.height, frame.camera.width), -1), np.zeros(
        (frame.camera.height, frame.camera.width)
    )
    points = np.broadcast_to(place, (*face.shape, 3)).copy()
    near, t = hit_body(place, rays, frame.world_body())
    within = place + np.where(near >= 0, t, 0)[..., None] * rays
    for i in np.unique(near[near >= 0]):
        m = frame.world_body() @ body.faces()[i]
        xy = (within[near == i] - m[:3, 3]) @ m[:3, :2]
        albedo[part][near == i] = body.albedo_at(frame.variant, int(i), xy[:, 0], xy[:, 1])
    face[part], points[part] = near, within
    return face, albedo, points


def clean_pixels(frame: scenes.Frame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As printed(), but the face is -1 where the pixel's neighbourhood is not all one face and one albedo."""
    face, albedo, points = printed(frame)
    same = face >= 0
    for dx, dy in [(-0.7, -0.7), (0.7, -0.7), (-0.7, 0.7), (0.7, 0.7)]:
        f, a, _ = printed(frame, dx, dy)
        same &= (f == face) & (a == albedo)
    return np.where(same, face, -1), albedo, points


# ---------------------------------------------------------------------------------------------------------------------
# Closed forms
# ---------------------------------------------------------------------------------------------------------------------
def direct(points: np.ndarray, normal: np.ndarray, lamps: tuple[scenes.Lamp, ...]) -> np.ndarray:
    """(n, 3): radiance of a white, matte surface, nothing in between. NaN where a lamp crosses the horizon."""
    total = np.zeros((len(points), 3))
    for lamp in lamps:
        to = lamp.position() - points
        d = np.linalg.norm(to, axis=1)
        cosine = (to @ normal) / d
        crossing = np.abs(cosine) < 1.05 * lamp.radius / d
        total += np.where(crossing, np.nan, np.maximum(cosine, 0) * (lamp.radius / d) ** 2)[:, None] * lamp.radiance()
    return total


def hits_body(origins: np.ndarray, directions: np.ndarray, frame: scenes.Frame) -> np.ndarray:
    normals = body.normals() @ frame.world_body()[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        along, t = directions @ normals.T, (body.INRADIUS - origins @ normals.T) / (directions @ normals.T)
    near = np.where(along < 0, t, -np.inf).max(-1)
    return (near < np.where(along > 0, t, np.inf).min(-1)) & (near > 0)


def cosine_rays(normal: np.ndarray, count: int) -> np.ndarray:
    """(count, 3), spread by the cosine about the normal: a spiral over the disc, lifted."""
    k = np.arange(count) + 0.5
    radius, turn = np.sqrt(k / count), np.pi * (1 + 5 ** 0.5) * k
    side = body.unit(np.cross(normal, (1, 0, 0) if abs(normal[0]) < 0.9 else (0, 1, 0)))
    lifted = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - radius ** 2)], 1)
    return lifted @ np.array([side, np.cross(normal, side), normal])


def board_radiance(points: np.ndarray, frame: scenes.Frame) -> np.ndarray:
    """(n, 3), at points on the board. The body casts a hard shadow and hides sky; the light that it sends down is left
    out."""
    up = np.array([0.0, 1, 0])
    light = (
        scenes.AMBIENT
        * (1 - hits_body(points[:, None, :], cosine_rays(up, 64)[None], frame).mean(1))[:, None]
        * np.ones(3)
    )
    for lamp in frame.lamps:
        free = ~hits_body(points, lamp.position() - points, frame)
        light += np.where(free[:, None], direct(points, up, (lamp,)), 0)
    return scenes.BOARD_ALBEDO * light


def closed_form(frame: scenes.Frame, face: int, points: np.ndarray) -> np.ndarray:
    """(n, 3): radiance of white paper on a face. The part of sky and board is its mean over sixteen of the points."""
    normal = body.normals()[face] @ frame.world_body()[:3, :3].T
    around = np.full(3, scenes.AMBIENT)
    if frame.board and normal[1] < 1 - 1e-9:
        some, rays = points[:: max(1, len(points) // 16), None], cosine_rays(normal, 256)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (scenes.BOARD_HEIGHT - some[..., 1]) / rays[:, 1]
            at = some + t[..., None] * rays
        w, h = scenes.BOARD_SIZE
        met = (t > 0) & np.isfinite(t) & (np.abs(at[..., 0]) < w / 2) & (np.abs(at[..., 2]) < h / 2)
        around = scenes.AMBIENT * (1 - met.mean()) + board_radiance(at[met], frame).sum(0) / met.size
    return direct(points, normal, frame.lamps) + around


# ---------------------------------------------------------------------------------------------------------------------
# Checks
# ---------------------------------------------------------------------------------------------------------------------
def noise(frame: scenes.Frame, halves: list[np.ndarray]) -> dict:
    """One standard deviation of a pixel of the mean of two halves, relative to what is there: on lit paper (half as
    bright as the brightest or more), on dim paper, on the board outside of the picture's body."""
    face, albedo, _ = clean_pixels(frame)
    half = (
        np.abs(halves[0] - halves[1]).mean(-1) / 2 * np.sqrt(np.pi / 2)
    )  # mean absolute to standard deviation: penumbras count as one pixel
    mean = (halves[0] + halves[1]).mean(-1) / 2
    light = np.where(albedo > 0, mean / np.maximum(albedo, 1e-9), 0)
    paper = (face >= 0) & (albedo > 0.1)
    lit = paper & (light > 0.5 * np.percentile(light[paper], 99))
    board = (printed(frame)[0] < 0) & (mean > 1e-4) & frame.board
    kinds = {"lit_paper": lit, "dim_paper": paper & ~lit, "board": board}
    return {kind: round(float(half[m].mean() / mean[m].mean()), 5) for kind, m in kinds.items() if m.any()}


@functools.cache
def tag_detector():
    """One limit for all frames."""
    from pyapriltags import Detector
    return Detector(families="tag36h11", nthreads=1, quad_decimate=1.0, refine_edges=1)


def tags_read(image: np.ndarray, wanted: set[int]) -> dict[int, np.ndarray]:
    """Number -> (4, 2) corners, house's pixels, AprilTag's order (bottom left first, counter-clockwise). The brightest
    exposure that does not clip a tag's surroundings is its best: several are tried until all that are wanted are
    read."""
    detector = tag_detector()
    grey = image.mean(-1)
    top = np.percentile(grey, 99.5)
    found: dict[int, np.ndarray] = {}
    for gain in (1, 2, 4, 8, 16):
        seen = detector.detect(np.clip(255 * gain * grey / top, 0, 255).astype(np.uint8))
        for tag in seen:
            if tag.hamming == 0 and tag.tag_id not in found:
                found[tag.tag_id] = np.array(tag.corners) - 0.5
        if wanted <= found.keys():
            break
    return found


def check_tags(frame: scenes.Frame, image: np.ndarray) -> tuple[list[int], float, list[str]]:
    wrong, worst = [], 0.0
    m, seen = scenes.probe_body(frame), scenes.facing(frame)
    read = tags_read(image, {int(i) for i in np.flatnonzero(seen > 0.3)})
    for number in np.flatnonzero(seen > 0.5):
        if number not in read and not frame.things:
            wrong.append(f"{frame.name}: tag {number} is not read")
    for number, corners in read.items():
        if number > 11 or seen[number] <= 0:
            wrong.append(f"{frame.name}: tag {number} is read, which cannot be seen")
            continue
        expected = frame.camera.project(body.tag_corners(number) @ m[:3, :3].T + m[:3, 3])
        off = float(np.abs(corners - expected).max())
        if number in frame.covered:
            continue
        if seen[number] > 0.5:
            worst = max(worst, off)
            if off > TAG_LIMIT_PX:
                wrong.append(f"{frame.name}: a corner of tag {number} is {off:.2f} px from where the truth has it")
        elif off > 1.0:
            wrong.append(f"{frame.name}: a corner of tag {number}, seen flat, is {off:.2f} px off")
    return sorted(read), worst, wrong


def check_light(frame: scenes.Frame, image: np.ndarray) -> tuple[float, float, list[str]]:
    """Largest difference of a face's paper and, of faces lit by the first lamp against others, of their ratio, from the
    closed form."""
    face, albedo, points = clean_pixels(frame)
    measured, expected, wrong = {}, {}, []
    for i in np.flatnonzero(scenes.facing(frame) > 0.15):  # seen flatter, cells are thinner than a pixel
        use = (face == i) & (albedo > 0.1)
        if use.sum() < 60:
            continue
        form = closed_form(frame, int(i), points[use])
        good = np.isfinite(form).all(1)
        if good.sum() < 60:
            continue
        white = image[use][good] / albedo[use][good][:, None]
        measured[i], expected[i] = white.mean(0), form[good].mean(0)[:white.shape[1]]
    worst = max((float(np.abs(measured[i] / expected[i] - 1).max()) for i in measured), default=0.0)
    faces = sorted(measured, key=lambda i: expected[i].mean())
    ratio = 0.0
    if len(faces) > 1:
        a, b = faces[-1], faces[0]
        ratio = float((measured[a] / measured[b] / (expected[a] / expected[b])).mean() - 1)
    for i in measured:
        if (np.abs(measured[i] - expected[i]) > MEAN_LIMIT * expected[i] + MEAN_LIMIT_ABSOLUTE).any():
            wrong.append(f"{frame.name}: face {i} has {measured[i]}, the closed form {expected[i]}")
    return worst, ratio, wrong


def check_room(frame: scenes.Frame, image: np.ndarray, truth: dict) -> tuple[float, list[str]]:
    """The paper of each face that is seen against the panorama's irradiance there, which panorama.py summed without
    Mitsuba."""
    face, albedo, _ = clean_pixels(frame)
    worst, wrong = 0.0, []
    for i in np.unique(face[face >= 0]):
        use = (face == i) & (albedo > 0.1)
        if use.sum() < 60:
            continue
        measured = (image[use] / albedo[use][:, None]).mean(0) * np.pi
        off = float(np.abs(measured / truth["panorama"]["face_irradiance_rgb"][i] - 1).max())
        worst = max(worst, off)
        if off > ROOM_LIMIT:
            wrong.append(f"{frame.name}: the light on face {i} is {100 * off:.1f} % off the panorama's irradiance")
    return worst, wrong


def run(
    frames: list[scenes.Frame],
    folder: Path,
    known: dict,
    read: Callable[[Path], np.ndarray],
    sha256: Callable[[Path], str],
) -> int:
    """Runs every check of every frame and prints the findings; returns the exit code."""
    wrong: list[str] = []
    for frame in frames:
        truth, path = known.get(frame.name), folder / f"{frame.name}.exr"
        if truth is None or not path.exists():
            wrong.append(f"{frame.name}: not there")
            continue
        if sha256(path) != truth["sha256"]:
            wrong.append(f"{path.name}: not the file of scenes.json")
        for field, value in scenes.truth(frame).items():
            if truth.get(field) != value:
                wrong.append(f"{frame.name}: {field} of scenes.json is not what scenes.py says")
        image = read(path)
        size = (frame.camera.height, frame.camera.width, 3 if frame.color else 1)
        if image.shape != size or not np.isfinite(image).all() or (image < 0).any():
            wrong.append(f"{frame.name}: not a picture of its size, finite and not negative")
            continue
        tags, corner, more = check_tags(frame, image)
        wrong += more
        line = f"{frame.name}: tags {tags}, corners within {corner:.2f} px"
        if frame.panorama:
            off, more = check_room(frame, image, truth)
            line += f", faces' light within {100 * off:.1f} % of the panorama's"
        elif not frame.things:
            off, ratio, more = check_light(frame, image)
            line += (f", light on faces within {100 * off:.2f} % of the closed form, brightest to darkest "
                     f"{100 * ratio:+.2f} %")
        else:
            more = []
        wrong += more
        print(line, flush=True)
    for line in wrong:
        print(f"WRONG: {line}")
    sizes = [path.stat().st_size for path in folder.glob("*.exr")]
    print(
        f"{len(frames)} frames checked, {len(wrong)} things wrong; {len(sizes)} of {len(scenes.FRAMES)} are there, "
        f"{sum(sizes) / 1e6:.1f} MB"
    )
    return 1 if wrong else 0
