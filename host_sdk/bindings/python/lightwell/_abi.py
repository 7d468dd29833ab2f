"""Loads liblightwell.so with cffi; functions and structs are declared by parsing the C headers.

ffi, lib      cffi's objects
take(struct)  a struct of the C ABI with its size set
check(status) raises Error if a call failed
text(fill)    a text from a function of the C ABI that fills a buffer
"""

import os
import re
from pathlib import Path

import cffi

from ._values import Error, Status

_HERE = Path(__file__).resolve().parent


def _header(name):
    """Text of a header: the installed package's own copy, otherwise that of the source tree."""
    places = [_HERE / name, _HERE.parents[2] / "include" / "lightwell" / name]
    for place in places:
        if place.is_file():
            return place.read_text(encoding="utf-8")
    raise ImportError(f"{name} is neither {places[0]} nor {places[1]}; install the package again")


def _declarations(header):
    """The header as cffi can parse it: without comments and preprocessor lines, except numeric constants."""
    code = re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)
    code = re.sub(r"^#ifdef __cplusplus$.*?^#endif$", "", code, flags=re.DOTALL | re.MULTILINE)
    kept = [line for line in code.splitlines()
            if not line.startswith("#") or re.match(r"#define LW_\w+ (0x[0-9a-fA-F]+|\d+)$", line)]
    return "\n".join(kept).replace("LW_API ", "")


def _library():
    """Path of the library: LIGHTWELL_LIBRARY if set, else the one installed beside this package, else the loader's."""
    named = os.environ.get("LIGHTWELL_LIBRARY")
    if named:
        return named
    # PREFIX/lib/python3/dist-packages/lightwell
    prefix = _HERE.parents[3] if len(_HERE.parents) > 3 else _HERE
    for place in sorted(prefix.glob("lib/**/liblightwell.so.1")):
        return str(place)
    return "liblightwell.so.1"


ffi = cffi.FFI()
for _name in ("lightwell.h", "conventions.h", "plane_appearance.h", "shadows.h", "plane_objects.h",
              "cube_map.h", "probe_status.h", "light_estimate.h"):
    ffi.cdef(_declarations(_header(_name)))
try:
    lib = ffi.dlopen(_library())
except OSError as error:
    raise ImportError(f"{error}; set LIGHTWELL_LIBRARY to the path of liblightwell.so.1") from error

if lib.lw_abi_version() >> 16 != lib.LW_ABI_VERSION >> 16 or lib.lw_abi_version() < lib.LW_ABI_VERSION:
    raise ImportError(f"{_library()} has the ABI {lib.lw_abi_version():#x}, this package needs "
                      f"{lib.LW_ABI_VERSION:#x}: install both from one version of Lightwell")


def take(struct):
    made = ffi.new(f"{struct} *")
    made.size = ffi.sizeof(struct)
    return made


def check(status):
    if status != lib.LW_OK:
        length = ffi.new("size_t *")
        message = lib.lw_last_error(length)
        raise Error(Status(status), ffi.buffer(message, length[0])[:].decode("utf-8", "replace"))


def text(fill):
    """Calls `fill(memory, capacity, length)` twice: for the length, then for the text."""
    length = ffi.new("size_t *")
    check(fill(ffi.NULL, 0, length))
    memory = ffi.new("char[]", length[0] + 1)
    check(fill(memory, length[0] + 1, length))
    return ffi.string(memory).decode("utf-8", "replace")
