#!/usr/bin/env python3
"""Compares wire_decoder.py, which was written from the text of proto/README.md alone, with the C++ codec.

usage: wire_decoder_test.py ANSWERS VECTORS
ANSWERS is the folder of make_answers (its header has the format), VECTORS that of the golden messages.
"""

import json
import math
import sys
from pathlib import Path

from wire_decoder import WireError, decode, irradiance

# Relative tolerance: C++ computes in float (24 bits) with a few operations.
RELATIVE = 1e-5
# The smallest normal float: below it, rounding to float is coarser than RELATIVE.
SMALLEST_NORMAL = 2.0 ** -126


class Failure(Exception):
    pass


def near(what, ours, theirs, scale):
    for a, b in zip(ours, theirs, strict=True):
        if not abs(a - b) <= RELATIVE * (abs(b) + scale):
            raise Failure(f"{what}: wire_decoder.py: {ours}, C++: {theirs}")


def equal(what, ours, theirs):
    if ours != theirs:
        raise Failure(f"{what}: wire_decoder.py: {ours}, C++: {theirs}")


def scale_of(d):
    """Sum of the largest absolute terms of this message's irradiance: the scale of the tolerance where terms cancel."""
    return (sum(max(map(abs, c)) for c in d["radiance"])
            + sum(max(map(abs, light["irradiance"])) for light in d["lights"]))


def unit(normal):
    """The normalized normal; C++ accepts normals of any length."""
    return [x / math.hypot(*normal) for x in normal]


def compare_origin(line, message, numbers):
    origin = message["T_probe_origin"]
    # The absolute tolerance of 1e-9 m is the rounding of the nine digits of answers.txt.
    near(line, origin["translation"], numbers[:3], 1e-4)
    near(line, origin["rotation"], numbers[3:7], 1)


def bits_of(flags):
    """The SDK's bit mask of flags: one bit for each named flag, and bit 31 for all others."""
    return sum({1 << flag if 1 <= flag <= 8 else 1 << 31 for flag in flags})


def check_answers(path):
    """Checks every number of answers.txt that depends on the wire format alone; returns the number of messages."""
    message, lights, words, levels = None, 0, 0, []
    for line in path.read_text().splitlines():
        word, *v = line.split()
        if word == "final":
            break
        if word == "message":
            message, lights, words = decode(bytes.fromhex(v[0])), 0, words + 1
            continue
        numbers = [float(x) for x in v] if word != "engine" else []
        if word == "info":
            equal("sequence", message["sequence"], int(v[0]))
            equal("units", message["units"], int(numbers[1]))
            equal("flags", bits_of(message["flags"]), int(numbers[2]))
            near("bound", [min(message["bound"]["total"], 1e30)], [min(numbers[3], 1e30)], 0)
            equal("lights", len(message["lights"]), int(numbers[5]))
            near("coverage", [1 - message["unseen"]], [numbers[6]], 1)
        elif word == "irradiance":
            near(line, irradiance(message, unit(numbers[:3])), numbers[3:], scale_of(message))
        elif word == "coefficient" and v[0] == "0":
            near(line, message["radiance"][int(v[1])], numbers[2:], 0)
        elif word == "light":
            light = message["lights"][lights]
            near("direction", light["direction"], numbers[:3], 1)
            near("light", light["irradiance"], numbers[3:6], 0)
            near("radius", [light["angular_radius_rad"]], numbers[6:7], 0)
            near("covariance", light["covariance"], numbers[7:10], SMALLEST_NORMAL)
            equal("track", light["track"], int(v[10]))
            near("distance", [light["distance_m"], light["distance_sigma_m"]], numbers[11:13], 0)
            lights += 1
        elif word == "origin":
            compare_origin(line, message, numbers)
        elif word == "map" and message["environment"] and message["environment"]["levels"]:
            equal("levels", len(message["environment"]["levels"]), int(numbers[0]))
            levels = []
        elif word == "level":
            near("level", message["environment"]["levels"][len(levels)], numbers, 0)
            levels.append(int(numbers[0]))
        elif word == "texel":
            first = sum(edge * edge for edge in levels[:int(numbers[0])])
            near(line, message["environment"]["texels"][first + int(numbers[1])], numbers[2:], 0)
    if words < 15:
        raise Failure(f"{path} has {words} messages only")
    return words


def check_mutants(path):
    """Checks that both decoders refuse the same damaged messages and decode the others to the same values."""
    message, taken, refused, moved, lines = None, 0, 0, 0, path.read_text().splitlines()
    for line in lines:
        word, *v = line.split()
        if word == "mutant":
            try:
                message = decode(bytes.fromhex("".join(v[1:])))  # One is truncated to no bytes.
            except WireError as error:
                message = error
            if (v[0] == "ok") != isinstance(message, dict):
                raise Failure(f"{line}: wire_decoder.py: {message}")
            taken, refused = taken + (v[0] == "ok"), refused + (v[0] != "ok")
        elif word == "flags":
            equal("flags", bits_of(message["flags"]), int(v[0]))
        elif word == "origin":
            compare_origin(line, message, [float(x) for x in v])
            moved += float(v[6]) != 1
        elif word == "distances":
            near(line, [light["distance_m"] for light in message["lights"]], [float(x) for x in v], 0)
        else:
            numbers = [float(x) for x in v]
            near(line, irradiance(message, unit(numbers[:3])), numbers[3:], scale_of(message))
    if taken < 1000 or refused < 1000 or moved < 100:
        raise Failure(f"{path} has {taken} messages to take, {moved} with an origin, and {refused} to refuse only")
    return taken, refused


def check_vectors(folder):
    """Compares the fields of the golden messages with protobuf's JSON; returns the number of messages."""
    files = sorted(folder.glob("*.bin"))
    for file in files:
        d, expected = decode(file.read_bytes()), json.loads(file.with_suffix(".json").read_text())
        time, bound = expected.get("time", {}), expected.get("bound", {})
        for ours, theirs in (("sequence", expected["sequence"]), ("mid_exposure_ns", time.get("midExposureNs", 0)),
                             ("delivered_after_us", time.get("deliveredAfterUs", 0)),
                             ("encoded_after_us", time.get("encodedAfterUs", 0)),
                             ("probe_id", expected["probeId"]), ("calibration_id", expected["calibrationId"])):
            equal(f"{file.name} {ours}", d[ours], int(theirs))
        for name, value in d["bound"].items():
            theirs = bound.get(name, 0)
            if theirs == 4294967295:
                equal(f"{file.name} bound.{name}", value, math.inf)
            else:
                near(f"{file.name} bound.{name}", [value], [theirs * 1e-6], 0)
        near(f"{file.name} unseen", [d["unseen"], d["saturated"]], [expected["unseen"], expected["saturated"]], 0)
        equal(f"{file.name} flags", len(d["flags"]), len(expected["flags"]))
    if len(files) < 5:
        raise Failure(f"{folder} has {len(files)} golden messages only")
    return len(files)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    answers, vectors = map(Path, sys.argv[1:])
    try:
        golden = check_vectors(vectors)
        messages = check_answers(answers / "answers.txt")
        taken, refused = check_mutants(answers / "mutants.txt")
    except (Failure, WireError) as failure:
        sys.exit(f"wire_decoder_test: {failure}")
    print(f"{golden} golden messages, {messages} with C++'s answers, "
          f"{taken} damaged ones taken alike, {refused} refused alike")


if __name__ == "__main__":
    main()
