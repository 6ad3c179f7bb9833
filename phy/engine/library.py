"""Calls the kernels of a library with NumPy arrays."""

import ctypes
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

from phy.engine import files
from phy.engine.entries import BLOCK, ENTRIES, Entry
from phy.tables.block import Field

Kernel = Callable[..., Any]

_FORMATS = {"i": "q", "f": "d", "c": "dd"}
# A short burst takes a dozen calls, so each call must be cheap: the function that packs a kernel's
# arguments is written out for it, as `namedtuple` does.
_CALL = """
def {name}({given}):
    {check}
    words = pack({words})
    {call}
"""


def load(path: Path) -> dict[str, Kernel]:
    """The kernels of a library by name. Raises OSError if it is not one of these kernels."""
    library = ctypes.CDLL(str(path))
    found = {}
    for name, entry in ENTRIES.items():
        try:
            function = library[files.SYMBOL + name]
        except AttributeError as error:
            raise OSError(f"{path}: no kernel {name}") from error
        function.argtypes, function.restype = [ctypes.c_char_p, ctypes.c_void_p], None
        found[name] = _kernel(name, entry, function)
    return found


def _kernel(name: str, entry: Entry, function: Any) -> Kernel:
    """A Python function that calls a kernel.

    Raises TypeError for an array that is not contiguous, or not of the type that the kernel takes.
    """
    arrays = [
        (f"a{i}", f"t{i}", field)
        for i, field in enumerate(entry.arguments)
        if field.n_dimensions and field is not BLOCK
    ]
    wrong = [f"{a}.dtype != {t} or {a}.ndim != {f.n_dimensions}" for a, t, f in arrays]
    source = _CALL.format(
        name=name,
        given=", ".join(f"a{i}" for i in range(len(entry.arguments))),
        check=f"if {' or '.join(wrong)}: refuse(locals())" if wrong else "",
        words=", ".join(_words(f"a{i}", field) for i, field in enumerate(entry.arguments)),
        call=_call(entry.results),
    )
    scope: dict[str, Any] = {t: field.dtype for _, t, field in arrays}

    def refuse(given: dict[str, Any]) -> None:
        for number, (a, _, field) in enumerate(arrays):
            _check(given[a], field, f"{name}, array {number + 1}")

    scope |= {
        "address": _address,
        "function": function,
        "pack": struct.Struct("=" + "".join(map(_format, entry.arguments))).pack,
        "refuse": refuse,
        "room": ctypes.c_char * (8 * sum(_size(field) for field in entry.results)),
        "unpack": struct.Struct("=" + "".join(map(_format, entry.results))).unpack,
    }
    exec(source, scope)  # noqa: S102 (made of the table of entries)
    made: Kernel = scope[name]
    return made


def _words(argument: str, field: Field) -> str:
    """The words of an argument, as source."""
    if field is BLOCK:
        return f"*{argument}.words"
    if field.n_dimensions:
        return f"address({argument}), *{argument}.shape"
    return f"{argument}.real, {argument}.imag" if field.dtype.kind == "c" else argument


def _call(results: tuple[Field, ...]) -> str:
    """The call itself and the return of its results, as source."""
    if not results:
        return "function(words, None)"
    parts, at = [], 0
    for field in results:
        is_complex = field.dtype.kind == "c"
        parts.append(f"complex(got[{at}], got[{at + 1}])" if is_complex else f"got[{at}]")
        at += _size(field)
    returned = "got" if at == len(results) > 1 else ", ".join(parts)
    return f"left = room(); function(words, left); got = unpack(left); return {returned}"


def _format(field: Field) -> str:
    return f"Q{field.n_dimensions}q" if field.n_dimensions else _FORMATS[field.dtype.kind]


def _size(field: Field) -> int:
    return 2 if field.dtype.kind == "c" else 1


def _check(array: Any, field: Field, where: str) -> None:
    if array.dtype != field.dtype or array.ndim != field.n_dimensions:
        raise TypeError(
            f"{where}: got {array.dtype}, {array.ndim} dimensions; "
            f"allowed: {field.dtype}, {field.n_dimensions} dimensions"
        )


_locate, _Empty = ctypes.addressof, ctypes.c_char * 0
_begin_of = _Empty.from_buffer


def _address(array: Any) -> int:
    try:
        return _locate(_begin_of(array))
    except (TypeError, ValueError, BufferError):
        # An array that is read-only, or has gaps.
        if not array.flags.c_contiguous:
            raise TypeError("got an array with gaps; allowed: contiguous ones") from None
        address: int = array.ctypes.data
        return address
