"""Makes a kernel callable with 64-bit words, as `phy.engine.entries` lays them out."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from phy.engine.entries import Entry
from phy.kernels.argument_block import numba_type, open_words

_I64 = ir.IntType(64)


def call_of(kernel: Any, entry: Entry) -> Callable[[Any, Any], None]:
    """A function that opens the words, calls the kernel, and writes its results to other words."""
    arguments = [numba_type(field) for field in entry.arguments]
    results = [numba_type(field) for field in entry.results]
    opened = types.Tuple(arguments)

    def open_arguments(_context: Any, words: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            found = open_words(context, builder, args[0], arguments)
            return context.make_tuple(builder, opened, found)

        return opened(words), generate

    def close(_context: Any, words: Any, returned: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            several = isinstance(returned, types.BaseTuple)
            kinds = list(returned) if several else [returned]
            values = [
                builder.extract_value(args[1], i) if several else args[1] for i in range(len(kinds))
            ]
            place = 0
            for value, own, kind in zip(values, kinds, results, strict=True):
                for part in _parts(context, builder, context.cast(builder, value, own, kind), kind):
                    builder.store(builder.bitcast(part, _I64), builder.gep(args[0], [_I64(place)]))
                    place += 1
            return context.get_dummy_value()

        return types.void(words, returned), generate

    # For type checkers, an intrinsic takes what its typing function takes.
    opening: Any = intrinsic(open_arguments)
    closing: Any = intrinsic(close)

    if results:

        def call(words: Any, left: Any) -> None:
            closing(left, kernel(*opening(words)))

    else:

        def call(words: Any, left: Any) -> None:  # noqa: ARG001 (there is none)
            kernel(*opening(words))

    return call


def _parts(context: Any, builder: Any, value: Any, kind: Any) -> list[Any]:
    if isinstance(kind, types.Complex):
        number = context.make_complex(builder, kind, value)
        return [number.real, number.imag]
    return [value]
