"""Loads liblightwell with ctypes; functions and structs are declared by reading the C headers.

lib            functions and constants
take(struct)   a struct of the C ABI with its size set
Handle(...)    an object of the library, released with the Python object
memory(array)  the address of an array, or of a message's bytes, as an argument
check(status)  raises Error if a call failed
text(fill)     a text from a function of the C ABI that fills a buffer
"""

import ctypes
import os
from pathlib import Path

import numpy as np

from ._declarations import Declarations
from ._values import Error, Status

_HERE = Path(__file__).resolve().parent
_NAME = "liblightwell.so.1"


def _header(name):
    """Text of a header: the installed package's own copy, otherwise that of the source tree."""
    places = [_HERE / name, _HERE.parents[2] / "include" / "lightwell" / name]
    for place in places:
        if place.is_file():
            return place.read_text(encoding="utf-8")
    raise ImportError(f"{name} is neither {places[0]} nor {places[1]}; install the package again")


def _library():
    """Path of the library: LIGHTWELL_LIBRARY if set, else the one inside this package, else the one installed beside
    it, else the loader's."""
    named = os.environ.get("LIGHTWELL_LIBRARY")
    if named:
        return named
    if (_HERE / _NAME).is_file():
        return str(_HERE / _NAME)
    # PREFIX/lib/python3/dist-packages/lightwell; the library in PREFIX/lib or, on Debian, PREFIX/lib/ARCHITECTURE.
    prefix = _HERE.parents[3] if len(_HERE.parents) > 3 else _HERE
    for folder in ("lib", "lib/*", "lib64"):
        for place in sorted(prefix.glob(f"{folder}/{_NAME}")):
            return str(place)
    return _NAME


lib = Declarations()
for _name in ("lightwell.h", "conventions.h", "plane_appearance.h", "shadows.h", "plane_objects.h",
              "cube_map.h", "probe_status.h", "light_estimate.h", "field.h"):
    lib.add(_header(_name))
try:
    _loaded = ctypes.CDLL(_library())
    _version = ctypes.CFUNCTYPE(ctypes.c_uint32)(("lw_abi_version", _loaded))()
except (AttributeError, OSError) as error:
    raise ImportError(f"{error}; set LIGHTWELL_LIBRARY to the path of {_NAME}") from error

_needed = lib.constants["LW_ABI_VERSION"]
if _version >> 16 != _needed >> 16 or _version < _needed:
    raise ImportError(f"{_library()} has the ABI {_version:#x}, this package needs {_needed:#x}: install both from one "
                      "version of Lightwell")
lib.load(_loaded)


def take(struct):
    return lib.structs[struct]()


def memory(data):
    """The address of a contiguous array or of bytes as an argument of the C ABI; keeps the data alive."""
    array = data if isinstance(data, np.ndarray) else np.frombuffer(data, np.uint8)
    return array.ctypes.data_as(ctypes.c_void_p)


def check(status):
    if status != lib.LW_OK:
        raise Error(Status(status), lib.lw_last_error(None).decode("utf-8", "replace"))


def text(fill):
    """Calls `fill(memory, capacity, length)` twice: for the length, then for the text."""
    length = ctypes.c_size_t()
    check(fill(None, 0, ctypes.byref(length)))
    made = ctypes.create_string_buffer(length.value + 1)
    check(fill(made, length.value + 1, ctypes.byref(length)))
    return made.value.decode("utf-8", "replace")


def chars(field):
    """A text of a struct, which ctypes gives as bytes; empty for NULL."""
    return (field or b"").decode("utf-8", "replace")


class Handle:
    """An object of the library: `create(*arguments, out)` makes it, `release` is called when this object goes."""

    def __init__(self, create, release, *arguments):
        made = ctypes.c_void_p()
        check(create(*arguments, ctypes.byref(made)))
        self._as_parameter_ = made
        self._release = release

    def __del__(self):
        if hasattr(self, "_release"):
            self._release(self._as_parameter_)
