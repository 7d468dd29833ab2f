"""Makes classes of protobuf messages from .proto files at run time."""

import functools
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory


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
