"""Working memory on the stack of the kernel that uses it.

Such an array ends with the kernel, which must not return it. It may have some 100 KB, and must not
be made in a loop. A kernel without any other new array needs no allocator, so that it can also be
part of a library without numba; see `phy.engine.compile`.
"""

from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

_I64 = ir.IntType(64)


def _typed(_context: Any, kind: Any, shape: Any) -> Any:
    n_dimensions = len(shape) if isinstance(shape, types.BaseTuple) else 1
    result = types.Array(kind.instance_type, n_dimensions, "C")

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        given, kinds = [args[1]], [signature.args[1]]
        if isinstance(kinds[0], types.BaseTuple):
            given = [builder.extract_value(args[1], i) for i in range(n_dimensions)]
            kinds = list(signature.args[1])
        sizes = [
            context.cast(builder, size, own, types.intp)
            for size, own in zip(given, kinds, strict=True)
        ]
        item = context.get_data_type(result.dtype)
        item_size = context.get_abi_sizeof(item)
        strides = [_I64(item_size)]
        for size in reversed(sizes[1:]):
            strides.insert(0, builder.mul(strides[0], size))
        n = sizes[0]
        for size in sizes[1:]:
            n = builder.mul(n, size)
        room = builder.alloca(item, size=n)
        room.align = 32
        array = context.make_array(result)(context, builder)
        populate_array(array, room, sizes, strides, _I64(item_size), meminfo=None)
        return array._getvalue()  # noqa: SLF001

    return result(kind, shape), generate


if TYPE_CHECKING:

    def local(kind: Any, shape: Any) -> Any:
        """A new array of `shape`, a number or a tuple, with arbitrary content."""

else:
    local = intrinsic(_typed)
