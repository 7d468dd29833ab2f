"""Reads the C headers of the library: constants, structs and functions, as ctypes knows them.

It knows the C that these headers are written in: one declaration a statement, numbers of fixed width, arrays of numbers
in structs, pointers to const char for texts. A declaration that it does not know raises ImportError.
"""

import ctypes
import operator
import re

_NUMBERS = {"int32_t": ctypes.c_int32, "uint32_t": ctypes.c_uint32, "int64_t": ctypes.c_int64,
            "uint64_t": ctypes.c_uint64, "uint8_t": ctypes.c_uint8, "size_t": ctypes.c_size_t, "float": ctypes.c_float,
            "double": ctypes.c_double, "char": ctypes.c_char}
_DECLARATION = re.compile(r"(?:const\s+)?(\w+)\s*(\*{0,2})\s*(\w+)(?:\[(\w+)\])?")


def _range(number):
    """(least, largest) value of an integer type; None for other types. ctypes alone would take the lowest bits."""
    if number not in _NUMBERS.values() or number in (ctypes.c_float, ctypes.c_double, ctypes.c_char):
        return None
    bits = 8 * ctypes.sizeof(number)
    return (0, 2**bits - 1) if number(-1).value > 0 else (-2**(bits - 1), 2**(bits - 1) - 1)


def _integer(limits, value, what):
    """Any integer, also NumPy's, as an int in the range."""
    value = operator.index(value)
    if not limits[0] <= value <= limits[1]:
        raise OverflowError(f"{what} is {value}; it is {limits[0]} to {limits[1]}")
    return value


class Struct(ctypes.Structure):
    """A struct of the C ABI. `size` is set; integers that do not fit raise OverflowError."""

    _ranges = {}

    def __init__(self):
        super().__init__()
        self.size = ctypes.sizeof(self)

    def __setattr__(self, name, value):
        if name not in self._ranges:
            raise AttributeError(f"{type(self).__name__} has no field {name!r}")
        limits = self._ranges[name]
        super().__setattr__(name, value if limits is None else _integer(limits, value, name))


def _checked(function, integers):
    """The function, which refuses integers that C cannot hold. integers: position, range and name of parameters."""
    def call(*arguments):
        arguments = list(arguments)
        for at, limits, name in integers:
            arguments[at] = _integer(limits, arguments[at], name)
        return function(*arguments)

    return call if integers else function


class Declarations:
    """What some headers declare."""

    def __init__(self):
        self.constants = {}
        self.structs = {}  # By name.
        self.functions = {}  # Name: (type of the result, [(type, name) of the parameters]).
        self._integers = {}  # Typedefs.
        self._handles = set()  # Structs that are declared only.

    def add(self, header):
        """The text of a header. Those that it includes are added before."""
        code = re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)
        code = re.sub(r"^#ifdef __cplusplus$.*?^#endif$", "", code, flags=re.DOTALL | re.MULTILINE)
        for name, value in re.findall(r"^#define (LW_\w+) (0x[0-9a-fA-F]+|\d+)\b", code, flags=re.MULTILINE):
            self.constants[name] = int(value, 0)
        code = re.sub(r"^#.*$", "", code, flags=re.MULTILINE)
        for statement in re.findall(r"[^;{]*(?:\{[^}]*\}[^;]*)?;", code):
            self._add(" ".join(statement.split()))
        rest = re.sub(r"[^;{]*(?:\{[^}]*\}[^;]*)?;", "", code).strip()
        if rest:
            raise ImportError(f"the header ends in the middle of a declaration: {rest[:80]}")

    def load(self, library):
        """Sets the functions as attributes, with their types, from a ctypes.CDLL; and the constants."""
        for name, (result, parameters) in self.functions.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, [known for known, _ in parameters]
            integers = [(at, _range(known), what) for at, (known, what) in enumerate(parameters) if _range(known)]
            setattr(self, name, _checked(function, integers))
        for name, value in self.constants.items():
            setattr(self, name, value)
        return self

    def _add(self, statement):
        if found := re.fullmatch(r"enum \{(.*)\};", statement):
            for name, value in re.findall(r"(\w+) = ([^,]+)", found[1]):
                shifted = re.fullmatch(r"(\d+)(?: << (\d+))?", value.strip())
                if not shifted:
                    raise ImportError(f"the value of {name} is not known: {value}")
                self.constants[name] = int(shifted[1]) << int(shifted[2] or 0)
        elif found := re.fullmatch(r"typedef (\w+) (\w+);", statement):
            self._integers[found[2]] = self._number(found[1], statement)
        elif found := re.fullmatch(r"typedef struct (\w+) \1;", statement):
            self._handles.add(found[1])
        elif found := re.fullmatch(r"typedef struct (\w+) \{(.*)\} \1;", statement):
            self._add_struct(found[1], [field.strip() for field in found[2].split(";") if field.strip()])
        elif found := re.fullmatch(r"LW_API (.*?)(\w+)\((.*)\);", statement):
            self._add_function(found[2], found[1].strip(), found[3])
        else:
            raise ImportError(f"this declaration is not known: {statement}")

    def _add_struct(self, name, declarations):
        fields, ranges = [], {}
        for declaration in declarations:
            kind, pointers, field, length = self._parts(declaration)
            known = self._pointer(kind, declaration) if pointers else self._number(kind, declaration)
            ranges[field] = None if pointers or length else _range(known)
            fields.append((field, known * int(self.constants.get(length, length)) if length else known))
        self.structs[name] = type(name, (Struct,), {"_fields_": fields, "_ranges": ranges})

    def _add_function(self, name, result, parameters):
        types = []
        for declaration in [] if parameters == "void" else parameters.split(","):
            kind, pointers, parameter, _ = self._parts(declaration.strip())
            known = self._pointer(kind, declaration) if pointers else self._number(kind, declaration)
            types.append((known, parameter))
        texts = {"void": None, "const char*": ctypes.c_char_p}
        self.functions[name] = (texts[result] if result in texts else self._number(result, result), types)

    @staticmethod
    def _parts(declaration):
        found = _DECLARATION.fullmatch(declaration)
        if not found:
            raise ImportError(f"this declaration is not known: {declaration}")
        return found.groups()

    def _number(self, kind, declaration):
        number = _NUMBERS.get(kind) or self._integers.get(kind)
        if number is None:
            raise ImportError(f"{kind} is not known, in: {declaration}")
        return number

    def _pointer(self, kind, declaration):
        """Texts and structs are known to ctypes; of other pointers it takes any address."""
        if kind == "char" and "const" in declaration:
            return ctypes.c_char_p
        if kind in self.structs:
            return ctypes.POINTER(self.structs[kind])
        if kind != "void" and kind not in self._handles:
            self._number(kind, declaration)
        return ctypes.c_void_p
