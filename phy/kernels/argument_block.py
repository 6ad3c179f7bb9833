"""Passes many arrays as one argument of a kernel.

numba inspects every array that crosses from the interpreter, and every field of a tuple; decoding a
short burst takes hardly longer than that. So arguments that stay the same from call to call are
packed once: an `ArgumentBlock` holds their addresses, and the kernel opens it into the original
tuple.
"""

import ctypes
import itertools
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np
from llvmlite import ir
from numba import typeof, types
from numba.extending import intrinsic
from numba.np import numpy_support
from numba.np.arrayobj import populate_array
from numpy.typing import NDArray

_I64 = ir.IntType(64)

PackedArguments = NDArray[np.int64]
"""An argument block in the packed form that kernels take."""

_Content = TypeVar("_Content", bound=tuple[Any, ...])
_FIELDS: dict[type[Any], list[Any]] = {}


class ArgumentBlock(Generic[_Content]):
    """A named tuple of arrays and numbers; `packed` is its form for kernels.

    Raises TypeError when a field is not of the type that its opener expects: kernels would not
    notice.
    """

    def __init__(self, content: _Content) -> None:
        self.content = content
        words: list[int] = []
        for value, kind in zip(content, _FIELDS[type(content)], strict=True):
            found = typeof(value)
            if isinstance(value, np.ndarray):
                found = found.copy(readonly=False)
                words += [value.ctypes.data, *value.shape]
            else:
                words.append(int(np.array(value).view(np.int64)))
            if found != kind:
                raise TypeError(f"{type(content).__name__}: got {found}; allowed: {kind}")
        # The packed form keeps the arrays alive that it points to.
        buffer: Any = (ctypes.c_int64 * len(words))(*words)
        buffer.content = content
        self.packed: PackedArguments = np.frombuffer(buffer, np.int64)


def opener(kind: type[Any], fields: str) -> Any:
    """Make a kernel function that turns the packed form of an argument block into the tuple `kind`.

    `fields` gives the type of each field in order: a scalar's dtype, and for an array also its
    number of dimensions in brackets, as in "i8 f4[2] c8[1]".
    """
    found = [_numba_type(field) for field in fields.split()]
    result = types.NamedTuple(found, kind)
    _FIELDS[kind] = found

    def typed(_context: Any, words: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            data = context.make_array(signature.args[0])(context, builder, args[0]).data
            places = itertools.count()

            def word() -> Any:
                return builder.load(builder.gep(data, [_I64(next(places))]))

            values = [_open(context, builder, each, word) for each in found]
            return context.make_tuple(builder, result, values)

        return result(words), generate

    typed.__doc__ = f"The `{kind.__name__}` in an argument block."
    return intrinsic(typed)


def _numba_type(field: str) -> Any:
    name, _, rest = field.partition("[")
    scalar = numpy_support.from_dtype(np.dtype(name))
    return types.Array(scalar, int(rest.rstrip("]")), "C") if rest else scalar


def _open(context: Any, builder: Any, kind: Any, word: Callable[[], Any]) -> Any:
    if not isinstance(kind, types.Array):
        return builder.bitcast(word(), context.get_value_type(kind))
    array = context.make_array(kind)(context, builder)
    item = context.get_abi_sizeof(context.get_data_type(kind.dtype))
    address = builder.inttoptr(word(), context.get_data_type(kind.dtype).as_pointer())
    shape = [word() for _ in range(kind.ndim)]
    strides = [_I64(item)]
    for size in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], size))
    populate_array(array, address, shape, strides, _I64(item), meminfo=None)
    return array._getvalue()  # noqa: SLF001
