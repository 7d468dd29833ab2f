"""The truth of a picture: one JSON object, of which README.md has the meaning. Needs numpy and tracer.py."""

import numpy as np

import bodies
import camera_sensor
import draw
import placing

NORMALS = 128               # on the sphere, of which those within 60 degrees of the camera are used
LAMP_POINTS = 256
CENTRE_RAYS = 16384
FACE_RAYS = 512             # from each of the points of a face
FACE_POINTS = ((0, 0), (0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5))  # in inradii of a face
LEAST_VIEW_COSINE = 0.1
SHADOW_STEP_PX = 4
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def fibonacci(count: int) -> np.ndarray:
    """(count, 3) even over the sphere, the polar axis is z."""
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    a, flat = np.pi * (1 + 5**0.5) * k, np.sqrt(1 - z**2)
    return np.stack([flat * np.cos(a), flat * np.sin(a), z], 1)


def normals_in_camera() -> np.ndarray:
    """(32, 3) in the camera's axes."""
    n = fibonacci(NORMALS)
    return n[n[:, 2] > 0.5]


def to_camera(scene: draw.Scene) -> np.ndarray:
    """(3, 3) R_camera_world."""
    return np.array(scene.camera.rotation).T


def lamp_samples(lamp, seen_from: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(k, 3) points of the lamp's surface that faces a point, (k, 3) their normals, (k,) their areas."""
    at, half = np.array(lamp.position()), lamp.size_m / 2
    if lamp.shape == "ball":
        n = fibonacci(2 * LAMP_POINTS)
        n, area = n[n @ (seen_from - at) > 0], np.pi * 4 * half**2 / (2 * LAMP_POINTS)
        points = at + half * n
    else:
        axis = -at / np.linalg.norm(at)
        u, v = np.array(bodies.transposed(bodies.between((0.0, 0.0, 1.0), tuple(axis))))[:2]
        k = np.arange(LAMP_POINTS)
        r, a = half * np.sqrt((k + 0.5) / LAMP_POINTS), np.pi * (1 + 5**0.5) * k
        points = at + (r * np.cos(a))[:, None] * u + (r * np.sin(a))[:, None] * v
        n, area = np.tile(axis, (LAMP_POINTS, 1)), np.pi * half**2 / LAMP_POINTS
    return points, n, np.full(len(points), area)


def lamp_light(lamp, place: np.ndarray, normals: np.ndarray, traced=None) -> np.ndarray:
    """(k, 3) direct irradiance at a point for k normals; with `traced`, what is in the way counts."""
    points, n, area = lamp_samples(lamp, place)
    way = points - place
    d2 = (way**2).sum(1)
    w = way / np.sqrt(d2)[:, None]
    weight = np.maximum(0, -(w * n).sum(1)) * area / d2
    if traced is not None:
        weight = weight * ~traced.blocked(np.tile(place, (len(w), 1)), points)
    radiance = np.array(lamp.irradiance) / lamp.form_factor()
    return (np.maximum(0, normals @ w.T) @ weight)[:, None] * radiance


def room_radiance(scene: draw.Scene, empty) -> float:
    """Radiance of the room's walls for the drawn share of the irradiance of a surface that faces the strongest lamp.
    `empty`: tracer of the lamps and a room of radiance 1 alone."""
    toward = np.array(bodies.unit(scene.lamps[0].position()))
    rays = fibonacci(CENTRE_RAYS)
    light = empty.arriving(np.zeros_like(rays), rays)
    room = (np.maximum(0, rays @ toward) @ light) * 4 * np.pi / CENTRE_RAYS @ LUMINANCE
    lamps = sum(lamp_light(lamp, np.zeros(3), toward[None])[0] for lamp in scene.lamps) @ LUMINANCE
    return scene.room.share / (1 - scene.room.share) * lamps / room


def harmonics(d: np.ndarray) -> np.ndarray:
    """(n, 9) real orthonormal harmonics of bands 0 to 2 without the Condon-Shortley phase, l then m = -l ... l
    (proto/README.md)."""
    x, y, z = d.T
    c0, c1, c2 = 0.5 * np.sqrt(1 / np.pi), np.sqrt(3 / (4 * np.pi)), 0.5 * np.sqrt(15 / np.pi)
    return np.stack([np.full(len(d), c0), c1 * y, c1 * z, c1 * x, c2 * x * y, c2 * y * z,
                     0.25 * np.sqrt(5 / np.pi) * (3 * z**2 - 1), c2 * x * z, c2 / 2 * (x**2 - y**2)], 1)


def centre_light(scene: draw.Scene, bare) -> dict:
    """Light at the body's centre as if the body were not there. `bare`: tracer of the scene without the body."""
    rays = fibonacci(CENTRE_RAYS)
    ambient = bare.arriving(np.zeros_like(rays), rays)
    in_camera = rays @ to_camera(scene).T
    n = normals_in_camera()
    total = np.maximum(0, n @ in_camera.T) @ ambient * 4 * np.pi / CENTRE_RAYS
    world = n @ to_camera(scene)
    for lamp in scene.lamps:
        total = total + lamp_light(lamp, np.zeros(3), world)
    sh = harmonics(in_camera).T @ ambient * 4 * np.pi / CENTRE_RAYS
    up = np.array([[0.0, 1.0, 0.0]])
    table = [lamp_light(lamp, np.zeros(3), up)[0] @ LUMINANCE for lamp in scene.lamps]
    sky = (np.maximum(0, rays[:, 1]) @ ambient * 4 * np.pi / CENTRE_RAYS) @ LUMINANCE
    return {"irradiance": total, "ambient_sh": sh, "shadow_depth": table[0] / (sum(table) + sky)}


def cosine_rays(count: int) -> np.ndarray:
    """(count, 3) around +z with density cos / pi."""
    k = np.arange(count)
    r, a = np.sqrt((k + 0.5) / count), np.pi * (1 + 5**0.5) * k
    return np.stack([r * np.cos(a), r * np.sin(a), np.sqrt(1 - r**2)], 1)


def surfaces(scene: draw.Scene) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """(tag, normal, points) of each surface that is turned to the camera: the folded faces; of a ball, the places with
    the normals of a dodecahedron (tag -1)."""
    r, body, out = np.array(scene.attitude), scene.model(), []
    eye = np.array(scene.camera.position)
    for face, frame in zip(body.faces, scene.faces):
        inradius = min(abs(bodies.cross((*a, 0), (*b, 0))[2]) / np.hypot(b[0] - a[0], b[1] - a[1])
                       for a, b in zip(face.outline, face.outline[1:] + face.outline[:1]))
        places = FACE_POINTS if not body.ball else [(-0.6, -0.6), (0.6, -0.6)]  # beside the ball
        points = np.array([frame.at((x * inradius, y * inradius, 1e-4)) for x, y in places]) @ r.T
        out.append((face.tag, r @ np.array(frame.normal), points))
    if body.ball:
        g = (1 + 5**0.5) / 2
        for n in [(s * a, t * b, 0.0) for s in (-1, 1) for t in (-1, 1) for a, b in ((1.0, g),)]:
            for k in range(3):
                normal = np.roll(n, k) / np.hypot(1, g)
                out.append((-1, normal, (r @ np.array(scene.ball_center) + (body.ball.radius + 1e-4) * normal)[None]))
    seen = []
    for tag, normal, points in out:
        way = eye - points.mean(0)
        if normal @ way / np.linalg.norm(way) > LEAST_VIEW_COSINE:
            seen.append((tag, normal, points))
    return seen


def face_lights(scene: draw.Scene, traced) -> list[dict]:
    """Irradiance of each seen surface and the strongest lamp's share of it."""
    local, seen = cosine_rays(FACE_RAYS), surfaces(scene)
    origins, directions = [], []
    for _, normal, points in seen:
        rotation = np.array(bodies.between((0.0, 0.0, 1.0), tuple(normal)))
        for p in points:
            origins.append(np.tile(p, (FACE_RAYS, 1)))
            directions.append(local @ rotation.T)
    ambient = traced.arriving(np.concatenate(origins), np.concatenate(directions), seed=1)
    ambient = np.pi * ambient.reshape(-1, FACE_RAYS, 3).mean(1)
    out, start = [], 0
    for tag, normal, points in seen:
        around = ambient[start:start + len(points)].mean(0)
        start += len(points)
        lamps = [np.mean([lamp_light(lamp, p, normal[None], traced)[0] for p in points], 0) for lamp in scene.lamps]
        total = around + sum(lamps)
        way = np.array(scene.camera.position) - points.mean(0)
        out.append({"tag": tag, "cosine": float(normal @ way / np.linalg.norm(way)), "irradiance": total,
                    "strongest_share": float(lamps[0] @ LUMINANCE / (total @ LUMINANCE))})
    return out


def shadow_px(scene: draw.Scene, traced) -> int:
    """Pixels of the picture that show table from which the nominal body hides the strongest lamp's centre."""
    rays, _ = traced.camera_rays(SHADOW_STEP_PX)
    eyes = np.tile(scene.camera.position, (len(rays), 1))
    distance, _, of = traced.hits(eyes, rays)
    table = of["table"]
    points = eyes[table] + distance[table, None] * rays[table]
    way = np.array(scene.lamps[0].position()) - points
    body, r = scene.model(), np.array(scene.attitude)
    if body.ball:
        center = r @ np.array(scene.ball_center)
        t = ((center - points) * way).sum(1) / (way**2).sum(1)
        hidden = np.linalg.norm(points + t[:, None] * way - center, axis=1) < body.ball.radius
    else:
        normals = np.array([r @ np.array(f.frame.normal) for f in body.faces])
        height = np.array([bodies.dot(f.frame.normal, f.frame.origin) for f in body.faces])
        along, off = way @ normals.T, height - points @ normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = off / along
        enter = np.where(along < 0, t, -np.inf).max(1)
        leave = np.where(along > 0, t, np.inf).min(1)
        hidden = (enter < leave) & (leave > 0)
    return int(hidden.sum()) * SHADOW_STEP_PX**2


def numbers(a, digits: int = 4) -> list:
    """Nested lists with so many significant digits."""
    if np.ndim(a) > 0:
        return [numbers(v, digits) for v in a]
    return float(f"{float(a):.{digits}g}")


def truth_of(scene: draw.Scene, texture, centre: dict, faces: list[dict], shadow: int, gains: np.ndarray) -> dict:
    r = to_camera(scene)
    c, (x, y, w, h), s = scene.camera, scene.crop, scene.sensor
    attitude = bodies.composed(tuple(map(tuple, r)), scene.attitude)
    looking = np.degrees(np.arctan2(c.position[0], c.position[2]))
    cut = s.vignetting / camera_sensor.corner_angle(c) ** 2
    return {
        "name": scene.name, "body": scene.body, "size_px": numbers(scene.size_px), "defect": scene.defect,
        "frame": scene.frame, "width": w, "height": h, "focal_px": numbers(c.focal_px, 9),
        "center_px": [(c.width - 1) / 2 - x, (c.height - 1) / 2 - y],
        "T_camera_body": {"q_xyzw": numbers(bodies.quaternion_of(attitude), 9),
                          "t_m": numbers(c.to_camera((0.0, 0.0, 0.0)), 9)},
        "shot_noise": numbers(1 / s.electrons if s.electrons else 0), "read_noise": numbers(s.read_noise),
        "vignetting": [numbers(-cut, 9) if s.calibrated else 0.0, 0.0, 0.0], "gain_rgb": numbers(gains, 6),
        "lamps": [{"direction": numbers(r @ np.array(bodies.unit(lamp.position())), 9),
                   "irradiance_rgb": numbers(lamp.irradiance), "distance_m": numbers(lamp.distance),
                   "size_m": numbers(lamp.size_m), "shape": lamp.shape,
                   "azimuth_deg": numbers((lamp.azimuth_deg - looking + 180) % 360 - 180),
                   "elevation_deg": numbers(lamp.elevation_deg)}
                  for lamp in scene.lamps],
        "room_share": numbers(scene.room.share), "ambient_sh": numbers(centre["ambient_sh"]),
        "irradiance_rgb": numbers(centre["irradiance"]),
        "faces": [{"tag": f["tag"], "cosine": numbers(f["cosine"]), "irradiance_rgb": numbers(f["irradiance"]),
                   "strongest_share": numbers(f["strongest_share"])} for f in faces],
        "shadow_px": shadow, "shadow_depth": numbers(centre["shadow_depth"]),
        "table": {"kind": scene.table.kind, "albedo": numbers(texture.reflectance.mean((0, 1))),
                  "contrast": numbers(texture.contrast), "roughness": numbers(scene.table.roughness)},
        "clutter": len(scene.clutter), "paper_roughness": numbers(scene.paper_roughness),
        "elevation_deg": numbers(np.degrees(np.arcsin(c.position[1] / bodies.length(c.position)))),
        "blur_px": numbers(s.blur_px), "vignetting_corner": numbers(s.vignetting),
    }
