#!/usr/bin/env python3
"""A second decoder of Lightwell's LightingDescriptor, wire version 1, written from the text of proto/README.md alone.

A reference implementation for tests: slow, simple, and independent of protobuf, of the .proto files and of the codec.

    decode(message)              bytes -> dict, or WireError
    irradiance(decoded, normal)  dict and unit vector -> [r, g, b]
    wire_decoder.py < lines      a message in hex a line -> a JSON object a line
"""

import json
import math
import struct
import sys

from wire_schema import SCHEMA

MESSAGE_BYTES = 64 * 1024
HIGHEST_BAND = 6
COEFFICIENTS = (HIGHEST_BAND + 1) ** 2
MANTISSA = 8191
COVARIANCE_MANTISSA = 63
DEEPEST = 100  # nesting depth of groups and messages, without the outermost message
LOWEST_EXPONENT, HIGHEST_EXPONENT = -150, 100
LIGHTS, LEVELS, TEXELS = 64, 8, 8192
EDGES = (8, 16, 32, 64)
WIRE_VERSION, CLOCK_PROBE_MONOTONIC, RGB9E5 = 1, 1, 1
KNOWN_UNITS = (1, 2)
KNOWN_SETTINGS = KNOWN_FLICKERS = (0, 1, 2, 3)
INFINITE_BOUND = 4294967295
LARGEST_TRANSLATION, SMALLEST_SQUARED_LENGTH = 1e6, 1e-18  # of T_probe_origin

VARINT, EIGHT_BYTES, LENGTH, GROUP_BEGINS, GROUP_ENDS, FOUR_BYTES = range(6)

WIRE_TYPES = {"uint32": VARINT, "uint64": VARINT, "enum": VARINT, "sint32": VARINT, "fixed64": EIGHT_BYTES,
              "double": EIGHT_BYTES, "fixed32": FOUR_BYTES, "float": FOUR_BYTES, "bytes": LENGTH,
              **{name: LENGTH for name in SCHEMA}}


class WireError(ValueError):
    """The message is refused; the text says why."""


def _require(holds, why):
    """Raises WireError with the text `why` unless `holds`. A comparison with NaN is false, so NaN is refused."""
    if not holds:
        raise WireError(why)


# ---------------------------------------------------------------------------------------------------------- bytes

def _varint(data, at, longest=10):
    """The varint at offset `at`, of up to 7 * longest bits, and the offset behind it."""
    value = 0
    for index in range(longest):
        _require(at + index < len(data), "ends within a varint")
        byte = data[at + index]
        value |= (byte & 0x7F) << (7 * index)
        if byte < 0x80:
            return value, at + index + 1
    raise WireError(f"a varint of more than {longest} bytes")


def _tag(data, at):
    """Field number, wire type and the offset behind the tag. Only the lowest 32 bits of a tag count."""
    tag, at = _varint(data, at, longest=5)
    tag &= 0xFFFFFFFF
    number, wire_type = tag >> 3, tag & 7
    _require(number != 0, "a field with the number 0")
    _require(wire_type <= FOUR_BYTES, f"wire type {wire_type}")
    return number, wire_type, at


def _piece(data, at, size):
    """`size` bytes at offset `at`, and the offset behind them."""
    _require(size <= len(data) - at, "ends within a field")
    return data[at:at + size], at + size


def _payload(data, at, number, wire_type, depth):
    """The payload after a tag (int for varints, bytes for types 1, 2 and 5, None for groups), and the offset behind it.
    `depth`: the number of messages around the one that contains the field."""
    if wire_type == VARINT:
        return _varint(data, at)
    if wire_type == EIGHT_BYTES:
        return _piece(data, at, 8)
    if wire_type == FOUR_BYTES:
        return _piece(data, at, 4)
    if wire_type == LENGTH:
        size, at = _varint(data, at)
        return _piece(data, at, size)
    _require(wire_type == GROUP_BEGINS, "the end of a group that did not begin")
    open_groups = [number]
    while open_groups:
        _require(depth + len(open_groups) <= DEEPEST, f"groups and messages nested more than {DEEPEST} deep")
        number, wire_type, at = _tag(data, at)
        if wire_type == GROUP_BEGINS:
            open_groups.append(number)
        elif wire_type == GROUP_ENDS:
            _require(open_groups.pop() == number, "the end of another group than the innermost")
        else:
            _, at = _payload(data, at, number, wire_type, depth)
    return None, at


def _from_varint(kind, raw):
    """The value of a varint: its lowest 64 or 32 bits; enums are signed like protobuf's int32; sint32 is zigzag."""
    if kind == "uint64":
        return raw & 0xFFFFFFFFFFFFFFFF
    raw &= 0xFFFFFFFF
    if kind == "enum":
        return raw - 0x100000000 if raw >= 0x80000000 else raw
    if kind == "sint32":
        return raw // 2 if raw % 2 == 0 else -((raw + 1) // 2)
    return raw


def _single(kind, payload):
    """The value of one number or of bytes, from the payload that _payload() returned."""
    if WIRE_TYPES[kind] == VARINT:
        return _from_varint(kind, payload)
    if kind in ("float", "double"):
        return struct.unpack("<f" if kind == "float" else "<d", payload)[0]
    return payload if kind == "bytes" else int.from_bytes(payload, "little")


def _empty(message_type):
    """The fields of an empty message. An absent field of message type is None."""
    fields = {}
    for name, kind, repeated in SCHEMA[message_type].values():
        fields[name] = [] if repeated else None if kind in SCHEMA else b"" if kind == "bytes" else 0
    return fields


def _parse(data, message_type, into=None, depth=0):
    """The fields of one message, by name; merged into `into` if given."""
    fields = _empty(message_type) if into is None else into
    at = 0
    while at < len(data):
        number, wire_type, at = _tag(data, at)
        payload, at = _payload(data, at, number, wire_type, depth)
        if number not in SCHEMA[message_type]:
            continue
        name, kind, repeated = SCHEMA[message_type][number]
        if repeated and wire_type == LENGTH and WIRE_TYPES[kind] == VARINT:  # every repeated number here is a varint
            behind = 0
            while behind < len(payload):
                raw, behind = _varint(payload, behind)
                fields[name].append(_from_varint(kind, raw))
        elif wire_type != WIRE_TYPES[kind]:
            continue
        elif kind in SCHEMA:
            if repeated:
                fields[name].append(_parse(payload, kind, depth=depth + 1))
            else:
                fields[name] = _parse(payload, kind, fields[name], depth + 1)
        elif repeated:
            fields[name].append(_single(kind, payload))
        else:
            fields[name] = _single(kind, payload)
    return fields


# --------------------------------------------------------------------------------------------------------- values

def _exponent(value, of):
    _require(LOWEST_EXPONENT <= value <= HIGHEST_EXPONENT, f"exponent {value} of {of}")
    return value


def _mantissas(values, lengths, largest, of):
    _require(len(values) in lengths, f"{len(values)} numbers of {of}")
    _require(all(abs(value) <= largest for value in values), f"a mantissa of {of} above {largest}")
    return values


def _harmonics(fields):
    """49 coefficients [r, g, b], that of Y_lm at index l(l+1)+m; zero if not sent."""
    bands = fields["bands"]
    _require(bands < 1 << (HIGHEST_BAND + 1), f"bands {bands:#x}")
    held = [band for band in range(HIGHEST_BAND + 1) if bands >> band & 1]
    exponent = _exponent(fields["exponent"], "radiance")
    mantissa = _mantissas(fields["mantissa"], [3 * sum(2 * band + 1 for band in held)], MANTISSA, "radiance")
    result = [[0.0, 0.0, 0.0] for _ in range(COEFFICIENTS)]
    position = 0
    for band in held:
        for index in range(band * band, (band + 1) ** 2):
            result[index] = [math.ldexp(value, exponent) for value in mantissa[position:position + 3]]
            position += 3
    return result


def _nearest_covariance(uu, uv, vv):
    """The positive semi-definite [uu, uv, vv] at the least Frobenius distance: negative eigenvalues become zero."""
    if uu >= 0 and vv >= 0 and uv ** 2 <= uu * vv:
        return [uu, uv, vv]
    h = (uu - vv) / 2
    r = math.sqrt(h ** 2 + uv ** 2)
    k = (uu + vv) / 2 + r
    if k <= 0:
        return [0, 0, 0]
    return [k * (r + h) / (2 * r), k * uv / (2 * r), k * (r - h) / (2 * r)]


def _light(fields):
    """direction: unit vector towards the light; irradiance [r, g, b]; angular radius in rad; covariance in rad²;
    distance and its standard deviation in m, 0 if not known."""
    direction = fields["direction"]
    _require(len(direction) == 3, f"{len(direction)} numbers of a light's direction")
    _require(any(direction), "a light without a direction")
    length = math.hypot(*direction)
    mantissa = _mantissas(fields["irradiance_mantissa"], [3], MANTISSA, "a light's irradiance")
    exponent = _exponent(fields["irradiance_exponent"], "a light's irradiance")
    radius = fields["angular_radius_e5"]
    _require(radius <= math.floor(math.pi / 2 * 1e5) + 2, f"angular radius {radius}e-5 rad")
    covariance = _mantissas(fields["covariance_mantissa"], [0, 1, 3], COVARIANCE_MANTISSA, "a light's covariance")
    covariance_exponent = _exponent(fields["covariance_exponent"], "a light's covariance")
    uu, uv, vv = {0: lambda: [0, 0, 0], 1: lambda: [covariance[0], 0, covariance[0]],
                  3: lambda: covariance}[len(covariance)]()
    distance, sigma = fields["distance_e4"], fields["distance_sigma_e4"]
    _require((distance == 0) == (sigma == 0), f"a distance of {distance} with a standard deviation of {sigma}")
    return {"direction": [value / length for value in direction],
            "irradiance": [math.ldexp(value, exponent) for value in mantissa],
            "angular_radius_rad": min(radius / 1e5, math.pi / 2),
            "covariance": [math.ldexp(value, covariance_exponent) for value in _nearest_covariance(uu, uv, vv)],
            "track": fields["track"], "distance_m": distance / 1e4, "distance_sigma_m": sigma / 1e4}


def _origin(fields):
    """T_probe_origin as {rotation: unit quaternion [x, y, z, w], translation: [x, y, z] in m}."""
    rotation, translation = ([fields[name] for name in names] for names in (("qx", "qy", "qz", "qw"),
                                                                             ("tx", "ty", "tz")))
    squared = sum(value * value for value in rotation)
    _require(SMALLEST_SQUARED_LENGTH < squared < math.inf, f"the quaternion {rotation}")
    _require(all(abs(value) <= LARGEST_TRANSLATION for value in translation), f"the translation {translation}")
    return {"rotation": [value / math.sqrt(squared) for value in rotation], "translation": translation}


def crc32c(data):
    """CRC-32C (Castagnoli): polynomial 0x1EDC6F41, reflected, initial value and final XOR of all ones."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def map_key(exponent, levels, texels):
    """The key of a whole map. levels: pairs of edge and roughness; texels: their bytes as sent."""
    content = struct.pack("<i", exponent)
    for edge, roughness in levels:
        content += struct.pack("<If", edge, roughness)
    return crc32c(content + texels) or 1


def _texels(data, exponent):
    """[r, g, b] of each RGB9E5 word of four bytes, times 2^exponent."""
    result = []
    for (word,) in struct.iter_unpack("<I", data):
        scale = (word >> 27) - 24 + exponent
        result.append([math.ldexp(word >> shift & 0x1FF, scale) for shift in (0, 9, 18)])
    return result


def _require_runs(runs, texels, limit):
    """runs: of texels that stay and of those that change, by turns; texels: the bytes of the latter."""
    _require(len(runs) % 2 == 0, "runs that are not in pairs")
    _require(0 not in runs[1:], "a run of 0 that is not the first")
    _require(sum(runs) <= limit, f"runs that reach as far as {sum(runs)} texels")
    _require(len(texels) == 4 * sum(runs[1::2]), f"{len(texels)} bytes for {sum(runs[1::2])} changed texels")


def _environment(fields):
    """A whole map (levels is not empty) or changes to one; see decode()."""
    _require(fields["key"] != 0, "a map with the key 0")
    _require(fields["encoding"] == RGB9E5, f"encoding {fields['encoding']} of texels")
    exponent = _exponent(fields["exponent"], "a map")
    levels = [[level["edge"], float(level["roughness"])] for level in fields["levels"]]
    runs, texels = fields["runs"], fields["texels"]
    if levels:
        _require(len(levels) <= LEVELS, f"a map of {len(levels)} levels")
        for edge, roughness in levels:
            _require(edge in EDGES, f"a map's edge of {edge} texels")
            _require(0 <= roughness <= 1, f"a map's roughness of {roughness}")
        for (edge, roughness), (next_edge, next_roughness) in zip(levels, levels[1:]):
            _require(next_edge <= edge, "a map whose edges grow")
            _require(next_roughness > roughness, "a map whose roughness does not rise")
        count = sum(edge * edge for edge, _ in levels)
        _require(count <= TEXELS, f"a map of {count} texels")
        _require(not runs, "a whole map with runs")
        _require(len(texels) == 4 * count, f"{len(texels)} bytes for {count} texels")
        _require(map_key(exponent, levels, texels) == fields["key"], "a whole map whose key is another")
    else:
        _require(exponent == 0, "changes to a map with an exponent")
        _require(fields["key_interval_ms"] == 0, "changes to a map with an interval of keys")
        _require_runs(runs, texels, TEXELS)
    tracks, light_texels = fields["light_tracks"], fields["light_texels"]
    _require(len(tracks) <= LIGHTS, f"{len(tracks)} tracks of lights in texels")
    _require(tracks == sorted(set(tracks)) and 0 not in tracks, f"the tracks {tracks} of lights in texels")
    _require_runs(fields["light_runs"], light_texels, levels[0][0] ** 2 if levels else max(EDGES) ** 2)
    _require(bool(tracks) == bool(light_texels), "tracks without texels, or texels without tracks")
    return {"key": fields["key"], "levels": levels, "exponent": exponent,
            "key_interval_ms": fields["key_interval_ms"], "texels": _texels(texels, exponent), "runs": runs,
            "light_tracks": tracks, "light_runs": fields["light_runs"],
            "light_texels": _texels(light_texels, exponent)}


def decode(message):
    """Decodes a LightingDescriptor into a dict; raises WireError if the message is invalid.

    sequence, mid_exposure_ns, delivered_after_us, encoded_after_us, probe_id, calibration_id: int
    units, setting, flicker: int, the enum's number; an unknown setting or flicker is 0
    flags: list of int, as sent
    radiance: 49 x [r, g, b], the coefficient of Y_lm at index l(l+1)+m; zero if not sent
    lights: list of dict: direction [x, y, z] (unit, towards the light), irradiance [r, g, b], angular_radius_rad (0 to
        pi/2), covariance [uu, uv, vv] (rad²), track (0 is none), distance_m and distance_sigma_m (0: not known)
    T_probe_origin: dict: rotation [x, y, z, w] (unit quaternion), translation [x, y, z] (m); the identity if not sent
    environment: None or dict: key, levels [[edge, roughness], ...], exponent, key_interval_ms, texels [[r, g, b], ...]
        (of a whole map radiance; of changes without the factor 2^exponent of their whole map), runs, light_tracks,
        light_runs, light_texels (scaled as texels)
    unseen, saturated: float, shares of 0 to 1
    bound: dict of float, relative (0.01 is 1 %), math.inf where infinite
    """
    _require(len(message) <= MESSAGE_BYTES, f"a message of {len(message)} bytes")
    fields = _parse(bytes(message), "LightingDescriptor")
    _require(fields["wire_version"] == WIRE_VERSION, f"wire version {fields['wire_version']}")
    time = fields["time"] or _empty("CaptureTime")
    _require(time["clock"] == CLOCK_PROBE_MONOTONIC, f"clock {time['clock']}")
    _require(fields["units"] in KNOWN_UNITS, f"units {fields['units']}")
    _require(len(fields["lights"]) <= LIGHTS, f"{len(fields['lights'])} lights")
    for share in ("unseen", "saturated"):
        _require(0 <= fields[share] <= 1, f"{share} of {fields[share]}")
    bound = fields["bound"] or _empty("ErrorBound")
    environment, origin = fields["environment"], fields["T_probe_origin"]
    return {
        "sequence": fields["sequence"], "mid_exposure_ns": time["mid_exposure_ns"],
        "delivered_after_us": time["delivered_after_us"], "encoded_after_us": time["encoded_after_us"],
        "probe_id": fields["probe_id"], "calibration_id": fields["calibration_id"], "units": fields["units"],
        "setting": fields["setting"] if fields["setting"] in KNOWN_SETTINGS else 0,
        "flicker": fields["flicker"] if fields["flicker"] in KNOWN_FLICKERS else 0,
        "flags": fields["flags"],
        "radiance": _harmonics(fields["radiance"] or _empty("SphericalHarmonics")),
        "lights": [_light(light) for light in fields["lights"]],
        "environment": None if environment is None else _environment(environment),
        "T_probe_origin": _origin({**_empty("Pose"), "qw": 1.0} if origin is None else origin),
        "unseen": float(fields["unseen"]), "saturated": float(fields["saturated"]),
        "bound": {part: math.inf if value == INFINITE_BOUND else value / 1e6 for part, value in bound.items()}}


# ----------------------------------------------------------------------------------------------------- irradiance

def _legendre_over_sine(degree, order, z):
    """P_l^m(z) / (1 - z²)^(m/2) without the Condon-Shortley phase: a polynomial in z, by the recurrence in l."""
    before, here = 0.0, 1.0
    for odd in range(1, 2 * order, 2):
        here *= odd  # (2m-1)!!, at l = m
    for l in range(order + 1, degree + 1):
        before, here = here, ((2 * l - 1) * z * here - (l + order - 1) * before) / (l - order)
    return here


def harmonic(degree, order, direction):
    """Y_lm at a unit direction: real, orthonormal, no Condon-Shortley phase, the polar axis +Z, the azimuth from +X."""
    x, y, z = direction
    m = abs(order)
    scale = math.sqrt((2 * degree + 1) / (4 * math.pi) * math.factorial(degree - m) / math.factorial(degree + m))
    turned = complex(x, y) ** m  # sin^m(theta) (cos(m phi) + i sin(m phi))
    around = 1.0 if m == 0 else math.sqrt(2) * (turned.real if order > 0 else turned.imag)
    return scale * _legendre_over_sine(degree, m, z) * around


def _within_one(value):
    return max(-1.0, min(1.0, value))


def clipped_cosine(cosine, radius):
    """Irradiance factor of a uniform cap of angular radius `radius` (rad), clipped at the horizon (Snyder 1996).
    `cosine`: of the angle between the normal and the cap's centre."""
    w = math.acos(_within_one(cosine))
    if w + radius <= math.pi / 2:
        return cosine
    if w - radius >= math.pi / 2:
        return 0.0
    sin_rho, cos_rho, sin_w = math.sin(radius), math.cos(radius), math.sin(w)
    g = math.asin(_within_one(cos_rho / sin_w))
    cos_g = math.cos(g)
    large_g = -2 * sin_w * cos_rho * cos_g + math.pi / 2 - g + math.sin(g) * cos_g
    large_h = cosine * (cos_g * math.sqrt(max(0.0, sin_rho ** 2 - cos_g ** 2))
                        + sin_rho ** 2 * math.asin(_within_one(cos_g / sin_rho)))
    if w < math.pi / 2:
        return cosine + (large_g - large_h) / (math.pi * sin_rho ** 2)
    return (large_g + large_h) / (math.pi * sin_rho ** 2)


# A_l: irradiance (not divided by pi) per radiance in band l (Ramamoorthi and Hanrahan 2001).
COSINE_LOBE = [math.pi, 2 * math.pi / 3, math.pi / 4, 0.0, -math.pi / 24, 0.0, math.pi / 64]


def irradiance(decoded, normal):
    """Irradiance [r, g, b] at a unit normal: that of the harmonics, which may be negative, plus that of the lights."""
    result = [0.0, 0.0, 0.0]
    for band in range(HIGHEST_BAND + 1):
        for order in range(-band, band + 1):
            weight = COSINE_LOBE[band] * harmonic(band, order, normal)
            for channel, coefficient in enumerate(decoded["radiance"][band * (band + 1) + order]):
                result[channel] += weight * coefficient
    for light in decoded["lights"]:
        cosine = sum(a * b for a, b in zip(normal, light["direction"]))
        factor = clipped_cosine(cosine, light["angular_radius_rad"])
        for channel in range(3):
            result[channel] += factor * light["irradiance"][channel]
    return result


# --------------------------------------------------------------------------------------------------- command line

def _answer(line):
    """The JSON text for one line of hexadecimal digits; an empty line is an empty message, which is invalid."""
    try:
        decoded = decode(bytes.fromhex(line.strip()))
    except ValueError as error:  # WireError, or no hex digits
        return json.dumps({"error": str(error)})
    decoded["bound"] = {part: None if math.isinf(value) else value for part, value in decoded["bound"].items()}
    return json.dumps(decoded, allow_nan=False)


if __name__ == "__main__":
    for one_line in sys.stdin:
        print(_answer(one_line), flush=True)
