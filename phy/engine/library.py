"""Loads a library of kernels as functions that take NumPy arrays."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phy.engine.entries import BLOCK, ENTRIES
from phy.tables.block import Field

Kernel = Callable[..., Any]

HEAD_BYTES = 16
"""What every Python object begins with, unless Python was built for threads without a lock."""
_FIELDS = [field for entry in ENTRIES.values() for field in entry.arguments]
_DTYPES = sorted({field.dtype for field in _FIELDS if field.n_dimensions}, key=str)
_NUMBERS = {"i": "i", "f": "d", "c": "c"}


def load(path: Path) -> dict[str, Kernel]:
    """The kernels of a library by name. Raises OSError if it, or this Python, does not fit.

    They raise TypeError for an array that is not contiguous, or not of the type that they take.
    """
    if object.__basicsize__ != HEAD_BYTES:
        raise OSError("this Python keeps its objects in another form")
    library = ctypes.PyDLL(str(path))
    try:
        functions, address_of = library.phy_functions, library.phy_address_of
    except AttributeError:
        raise OSError(f"{path}: no kernels") from None
    probe = np.ones(3)
    for each in (functions, address_of):
        each.restype = ctypes.py_object
    address_of.argtypes, functions.argtypes = [ctypes.py_object], [ctypes.py_object] * 2
    if address_of(probe) != content_of(probe):
        raise OSError("this NumPy keeps its arrays in another form")
    return dict(zip(ENTRIES, functions(np.ndarray, tuple(_DTYPES)), strict=True))


def header() -> str:
    """The kernels with their types, as `call.c` reads them."""
    lines = [
        f'KERNEL({name}, "{"".join(map(_type, entry.arguments))}", '
        f'"{"".join(map(_type, entry.results))}")'
        for name, entry in ENTRIES.items()
    ]
    return "\n".join(lines) + "\n"


def _type(field: Field) -> str:
    if field is BLOCK:
        return "b"
    if field.n_dimensions:
        return f"{chr(ord('A') + _DTYPES.index(field.dtype))}{field.n_dimensions}"
    return _NUMBERS[field.dtype.kind]


def content_of(array: NDArray[np.float64]) -> int:
    """The address of an array's content, as NumPy tells it."""
    return array.ctypes.data
