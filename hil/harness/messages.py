"""Classes of protobuf messages, from their .proto files."""

import functools
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory


@functools.cache
def message_class(folder: Path, file: str, name: str) -> Any:
    """Of the message `name` with its package, by protoc, which is there because the firmware needs it; `file` as it is
    imported from `folder`."""
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "messages.pb"
        subprocess.run(["protoc", f"-I{folder}", "--include_imports", f"--descriptor_set_out={out}", file], check=True)
        files = descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes())
    pool = descriptor_pool.DescriptorPool()
    for one in files.file:
        pool.Add(one)
    return message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(name))
