#!/usr/bin/python3
"""Prints the lighting measured by a probe, with the messages of proto/ only, without the SDK.

usage: client.py grpc://127.0.0.1:7420
       client.py grpcs://probe.local:7420 --credentials ~/.config/lightwell/probes/0123456789abcdef
The folder is one written by `lightwell pair`; its token, or with --certificate its certificate, authenticates the
client. Exit status: 0 all descriptors were received, 1 the probe did not respond or refused, 2 wrong usage.
"""

import argparse
import importlib
import math
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import urlsplit

import grpc

REPOSITORY = Path(__file__).resolve().parents[3]
DEFAULT_PORT = 7420
# The host name in every certificate that a probe issues for itself, whose address can change. It is also assumed for
# credentials of older versions, without a file `host`; if such a probe is refused, pair again.
PROBE_HOST_NAME = "probe.lightwell.internal"
END_OF_CERTIFICATE = b"-----END CERTIFICATE-----"
# Irradiance from radiance, band by band: pi, 2 pi/3, pi/4, 0, -pi/24, 0, pi/64 (proto/README.md).
COSINE_LOBE = (math.pi, 2 * math.pi / 3, math.pi / 4, 0, -math.pi / 24, 0, math.pi / 64)


def generate(protos, folder):
    """Generates Python modules of all messages and services with protoc and its gRPC plug-in."""
    plugin = shutil.which("grpc_python_plugin")
    if plugin is None or shutil.which("protoc") is None:
        sys.exit("client.py: protoc or grpc_python_plugin is missing: "
                 "apt install protobuf-compiler protobuf-compiler-grpc python3-grpcio python3-protobuf")
    files = sorted(str(p.relative_to(protos)) for p in protos.glob("lightwell/v1/*.proto"))
    if not files:
        sys.exit(f"client.py: no lightwell/v1/*.proto under {protos}: name the folder with --proto")
    subprocess.run(["protoc", f"--proto_path={protos}", f"--python_out={folder}", f"--grpc_python_out={folder}",
                    f"--plugin=protoc-gen-grpc_python={plugin}", *files], check=True)
    sys.path.insert(0, folder)


def open_channel(uri, credentials, by_certificate):
    parts = urlsplit(uri)
    if parts.scheme not in ("grpc", "grpcs") or not parts.hostname:
        sys.exit(f"client.py: '{uri}' is neither grpc://HOST:PORT nor grpcs://HOST:PORT")
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    target = f"{host}:{parts.port or DEFAULT_PORT}"
    options = [("grpc.enable_http_proxy", 0)]
    if parts.scheme == "grpc":
        return grpc.insecure_channel(target, options)
    if credentials is None:
        sys.exit("client.py: grpcs:// needs --credentials, a folder written by `lightwell pair`")

    def read(name):
        return (credentials / name).read_bytes()

    own = (read("client_key.pem"), read("client.pem")) if by_certificate else (None, None)
    # The first certificate is pinned. Any others are of an authority that also issues certificates to other hosts.
    pin, end, _ = read("probe_ca.pem").partition(END_OF_CERTIFICATE)
    channel = grpc.ssl_channel_credentials(pin + end, *own)
    if not by_certificate:
        token = read("token").decode().strip()
        channel = grpc.composite_channel_credentials(channel, grpc.access_token_call_credentials(token))
    host = read("host").decode().strip() if (credentials / "host").exists() else PROBE_HOST_NAME
    options.append(("grpc.ssl_target_name_override", host))
    return grpc.secure_channel(target, channel, options)


def coefficients(harmonics):
    """(l, m) -> (r, g, b) of the bands that were sent; the others are zero."""
    out = {}
    mantissa = iter(harmonics.mantissa)
    scale = math.ldexp(1, harmonics.exponent)
    for band in range(7):
        if harmonics.bands >> band & 1:
            for m in range(-band, band + 1):
                out[band, m] = tuple(scale * next(mantissa) for _ in range(3))
    return out


def from_above(descriptor, sh):
    """Irradiance of a surface that faces up (+Y), approximated by bands 0 and 1 of the harmonics and lights without
    extent. The exact formulas are in proto/README.md."""
    total = [0.0, 0.0, 0.0]
    for (band, m), rgb in sh.items():
        basis = {(0, 0): 0.282095, (1, -1): 0.488603}.get((band, m), 0)  # of (0, 1, 0)
        for c in range(3):
            total[c] += COSINE_LOBE[band] * basis * rgb[c]
    for light in descriptor.lights:
        length = math.sqrt(sum(d * d for d in light.direction))
        up = max(0.0, light.direction[1] / length)
        for c in range(3):
            total[c] += up * math.ldexp(light.irradiance_mantissa[c], light.irradiance_exponent)
    return total


def describe(descriptor, units):
    sh = coefficients(descriptor.radiance)
    bound = descriptor.bound.total
    return " ".join([
        f"sequence {descriptor.sequence}", units.Name(descriptor.units).removeprefix("UNITS_").lower(),
        f"bands {max((band for band, _ in sh), default=0)}", f"lights {len(descriptor.lights)}",
        "bound " + ("infinite" if bound == 0xFFFFFFFF else f"{bound / 1e4:.3g} %"),
        "Y00 " + " ".join(f"{v:.9g}" for v in sh.get((0, 0), (0, 0, 0))),
        "up " + " ".join(f"{v:.6g}" for v in from_above(descriptor, sh))])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("uri")
    parser.add_argument("--credentials", type=Path, help="folder written by `lightwell pair`")
    parser.add_argument("--certificate", action="store_true", help="use the certificate instead of the token")
    parser.add_argument("--count", type=int, default=5, help="descriptors to print [5]")
    parser.add_argument("--seconds", type=float, default=20, help="timeout [20]")
    parser.add_argument("--proto", type=Path, default=REPOSITORY / "proto", help="the folder with lightwell/v1/*.proto")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        generate(arguments.proto, folder)
        messages = importlib.import_module("lightwell.v1.probe_service_pb2")
        service = importlib.import_module("lightwell.v1.probe_service_pb2_grpc")
        units = importlib.import_module("lightwell.v1.descriptor_pb2").Units
    try:
        with open_channel(arguments.uri, arguments.credentials, arguments.certificate) as channel:
            probe = service.ProbeServiceStub(channel)
            info = probe.Info(messages.InfoRequest(), timeout=arguments.seconds)
            print(f"{info.probe_name}, {info.camera}, firmware {info.version}")
            stream = probe.StreamDescriptors(messages.StreamDescriptorsRequest(), timeout=arguments.seconds)
            for _, descriptor in zip(range(arguments.count), stream):
                print(describe(descriptor, units), flush=True)
    except grpc.RpcError as error:
        print(f"client.py: {arguments.uri}: {error.code().name}: {error.details()}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"client.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
