"""Opens packed arguments inside kernels; see `phy.tables.block`."""

import itertools
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np import numpy_support
from numba.np.arrayobj import populate_array

from phy.tables.block import FIELDS, Field

_I64 = ir.IntType(64)


def opener(kind: type[Any]) -> Any:
    """Make a kernel function that turns the packed form of an argument block into the tuple."""
    found = [numba_type(field) for field in FIELDS[kind]]
    result = types.NamedTuple(found, kind)

    def typed(_context: Any, words: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            data = context.make_array(signature.args[0])(context, builder, args[0]).data
            return context.make_tuple(builder, result, open_words(context, builder, data, found))

        return result(words), generate

    typed.__doc__ = f"The `{kind.__name__}` in an argument block."
    return intrinsic(typed)


def numba_type(field: Field) -> Any:
    """The numba type of a field."""
    scalar = numpy_support.from_dtype(field.dtype)
    return types.Array(scalar, field.n_dimensions, "C") if field.n_dimensions else scalar


def open_words(context: Any, builder: Any, data: Any, found: list[Any]) -> list[Any]:
    """The values of types `found` in the 64-bit words at `data`: addresses, sizes and numbers."""
    places = itertools.count()

    def word() -> Any:
        return builder.load(builder.gep(data, [_I64(next(places))]))

    return [_open(context, builder, each, word) for each in found]


def _open(context: Any, builder: Any, kind: Any, word: Callable[[], Any]) -> Any:
    if kind == types.complex128:
        value = context.make_complex(builder, kind)
        value.real, value.imag = (builder.bitcast(word(), ir.DoubleType()) for _ in range(2))
        return value._getvalue()  # noqa: SLF001
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
