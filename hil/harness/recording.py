"""Protobuf messages from .proto files, and recordings of frames as lightwelld --record writes them;
proto/README.md defines the container."""

import functools
import struct
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, text_format

PROTO = Path(__file__).resolve().parents[2] / "proto"
MAGIC = b"LWREC\x01\r\n"
_HEAD = struct.Struct("<IIq")


@functools.cache
def message_class(folder: Path, file: str, name: str) -> Any:
    """The class of the message `name` (with its package). `file`: the .proto file, relative to the import folder
    `folder`. Runs protoc, which the firmware's build needs as well."""
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "messages.pb"
        subprocess.run(["protoc", f"-I{folder}", "--include_imports", f"--descriptor_set_out={out}", file], check=True)
        files = descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes())
    pool = descriptor_pool.DescriptorPool()
    for one in files.file:
        pool.Add(one)
    return message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(name))


class RecordingError(Exception):
    """The file is not a recording of frames; the text names it."""


@dataclass(frozen=True)
class Frame:
    """A frame of a camera with one lens."""
    sequence: int
    format: str
    width: int
    height: int
    # Bytes of the image, with the padding of its rows.
    data: bytes


def _message(name: str) -> Any:
    return message_class(PROTO, "lightwell/v1/recording.proto", f"lightwell.v1.{name}")


def _records(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Header and payload of each record, up to the first truncated one. Checksums are not verified; the replay camera
    verifies them."""
    with open(path, "rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise RecordingError(f"{path} is not a recording")
        while len(head := file.read(_HEAD.size)) == _HEAD.size:
            size = _HEAD.unpack(head)[0]
            payload = file.read(size)
            if len(payload) < size:
                return
            yield head, payload


def _frame(payload: bytes) -> Frame:
    record = _message("FrameRecord").FromString(payload)
    view = record.view[0]
    return Frame(record.sequence, view.format, view.width, view.height, view.data)


def read(path: Path) -> tuple[str, list[Frame]]:
    """The calibration in text form, and the frames. Raises RecordingError."""
    records = _records(path)
    first = next(records, None)
    if first is None:
        raise RecordingError(f"{path} has no records")
    header = _message("RecordingHeader").FromString(first[1])
    if not header.HasField("calibration"):
        raise RecordingError(f"{path} is not a recording of frames")
    return text_format.MessageToString(header.calibration), [_frame(payload) for _, payload in records]


def thin(source: Path, target: Path, *, apart: int, frames: int) -> int:
    """Copies at most `frames` frames, whose sequence numbers differ by at least `apart`, unchanged into a new
    recording; returns their number."""
    kept, last = 0, None
    with open(target, "wb") as out:
        out.write(MAGIC)
        for number, (head, payload) in enumerate(_records(source)):
            if number > 0:
                sequence = _frame(payload).sequence
                if kept == frames or (last is not None and sequence < last + apart):
                    continue
                kept, last = kept + 1, sequence
            out.write(head + payload)
    return kept
