"""Passes many arrays as one argument of a kernel.

Every array that crosses from the interpreter to a kernel must be inspected; decoding a short burst
takes hardly longer than that. So arguments that stay the same from call to call are packed once: an
`ArgumentBlock` holds their addresses, and the kernel opens it into the original tuple.
"""

from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

_Kind = TypeVar("_Kind", bound=type[Any])
_Content = TypeVar("_Content", bound=tuple[Any, ...])


class Field(NamedTuple):
    """The type of one field: its dtype, and the number of dimensions; 0: a scalar."""

    dtype: np.dtype[Any]
    n_dimensions: int


FIELDS: dict[type[Any], tuple[Field, ...]] = {}
"""The fields of every kind of block."""


def parse_fields(told: str) -> tuple[Field, ...]:
    """Fields from text such as "i8 f4[2] c8[1]": dtypes, and dimensions of arrays in brackets."""
    return tuple(_parse(each) for each in told.split())


def _parse(told: str) -> Field:
    name, _, rest = told.partition("[")
    return Field(np.dtype(name), int(rest.rstrip("]")) if rest else 0)


def block_of(told: str) -> Callable[[_Kind], _Kind]:
    """Declare the fields of a named tuple that argument blocks may hold, in order."""

    def declare(kind: _Kind) -> _Kind:
        FIELDS[kind] = parse_fields(told)
        return kind

    return declare


class ArgumentBlock(Generic[_Content]):
    """A named tuple of arrays and numbers; `packed` is its form for kernels, with their addresses.

    Raises TypeError when a field is not of the declared type: kernels would not notice.
    """

    def __init__(self, content: _Content) -> None:
        self.content = content
        words: list[int] = []
        kind = type(content)
        for name, value, field in zip(content._fields, content, FIELDS[kind], strict=True):  # type: ignore[attr-defined]
            where = f"{kind.__name__}.{name}"
            if field.n_dimensions:
                _check(value, field, where)
                words += [value.ctypes.data, *value.shape]
            elif not np.can_cast(np.min_scalar_type(value), field.dtype):
                raise TypeError(f"{where}: got {value!r}; allowed: {field.dtype}")
            else:
                words.append(int(np.array(value, field.dtype).view(np.int64)))
        self.packed: NDArray[np.int64] = np.array(words, np.int64)
        self.address: int = self.packed.ctypes.data
        """Where the packed form lies; it is valid as long as this object."""


PackedArguments = NDArray[np.int64] | ArgumentBlock[Any]
"""An argument block; inside kernels, its packed form."""


def _check(value: object, field: Field, where: str) -> None:
    wanted = f"a contiguous array of {field.dtype}, {field.n_dimensions} dimensions"
    if not isinstance(value, np.ndarray):
        raise TypeError(f"{where}: got {type(value).__name__}; allowed: {wanted}")
    same = value.dtype == field.dtype and value.ndim == field.n_dimensions
    if not same or not value.flags.c_contiguous:
        raise TypeError(f"{where}: got {value.dtype}, {value.ndim} dimensions; allowed: {wanted}")
