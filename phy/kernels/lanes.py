"""Eight float32 as one value, for loops that must be vectorised.

numba leaves the vectorisation of loops over arrays to LLVM. LLVM gives up if too many arrays may
overlap, or if the loop contains another loop. Code in `Lanes` is explicit: `load` eight
subcarriers, calculate with + - * /, `store` eight results. LLVM lowers each operation to what the
machine has (one instruction of AVX, two of NEON). Nothing is contracted or reordered, so numpy's
float32 gives the same bits.
"""

import operator
from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from phy.sizes import N_LANES

_F32, _I16, _I32 = ir.FloatType(), ir.IntType(16), ir.IntType(32)
_VECTOR = ir.VectorType(_F32, N_LANES)


class Lanes(types.Type):
    """The type of eight float32 as one value."""

    if TYPE_CHECKING:

        def __add__(self, other: "Lanes") -> "Lanes": ...
        def __sub__(self, other: "Lanes") -> "Lanes": ...
        def __mul__(self, other: "Lanes") -> "Lanes": ...
        def __truediv__(self, other: "Lanes") -> "Lanes": ...
        def __neg__(self) -> "Lanes": ...

    def __init__(self) -> None:
        super().__init__(name="Lanes")


LANES = Lanes()


@register_model(Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _operator(function: Any, instruction: str) -> None:
    class _Typing(ConcreteTemplate):
        cases = (signature(LANES, LANES, LANES),)

    infer_global(function)(_Typing)

    @lower_builtin(function, Lanes, Lanes)
    def _lower(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return getattr(builder, instruction)(*args)


_operator(operator.add, "fadd")
_operator(operator.sub, "fsub")
_operator(operator.mul, "fmul")
_operator(operator.truediv, "fdiv")


@infer_global(operator.neg)
class _Negation(ConcreteTemplate):
    cases = (signature(LANES, LANES),)


@lower_builtin(operator.neg, Lanes)
def _negate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
    return builder.fneg(args[0])


def place(context: Any, builder: Any, signature: Any, args: Any, vector: Any) -> Any:
    """For intrinsics: a vector pointer to an element; the arguments are an array and an index."""
    data = context.make_array(signature.args[0])(context, builder, args[0]).data
    return builder.bitcast(builder.gep(data, [args[1]]), vector.as_pointer())


def _load(_typing: Any, array: Any, at: Any) -> Any:
    """Load eight values of a contiguous array, from index `at` of its flat form on."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = builder.load(place(context, builder, signature, args, _VECTOR))
        value.align = 4
        return value

    return LANES(array, at), generate


def _store(_typing: Any, array: Any, at: Any, value: Any) -> Any:
    """Store eight values to a contiguous array, from index `at` of its flat form on."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        where = place(context, builder, signature, args, _VECTOR)
        builder.store(args[2], where).align = 4
        return context.get_dummy_value()

    return types.void(array, at, value), generate


def _store_int16(_typing: Any, array: Any, at: Any, value: Any) -> Any:
    """Store eight values as int16, rounded towards zero; they must be in range."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.VectorType(_I16, N_LANES)
        where = place(context, builder, signature, args, kind)
        whole = builder.fptosi(args[2], ir.VectorType(_I32, N_LANES))
        builder.store(builder.trunc(whole, kind), where).align = 2
        return context.get_dummy_value()

    return types.void(array, at, value), generate


def _splat(_typing: Any, value: Any) -> Any:
    """A number, repeated in all lanes."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        number = context.cast(builder, args[0], signature.args[0], types.float32)
        one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, _lane(0))
        everywhere = ir.Constant(ir.VectorType(_I32, N_LANES), [0] * N_LANES)
        return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), everywhere)

    return LANES(value), generate


def _total(_typing: Any, value: Any) -> Any:
    """The sum of the lanes, added up in a fixed order: halves, then quarters, then pairs."""

    def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        lanes = [builder.extract_element(args[0], _lane(i)) for i in range(N_LANES)]
        while len(lanes) > 1:
            half = len(lanes) // 2
            lanes = [builder.fadd(lanes[i], lanes[i + half]) for i in range(half)]
        return lanes[0]

    return types.float32(value), generate


def _pairs(_typing: Any, value: Any) -> Any:
    """The sum of the even lanes and that of the odd lanes, as real and imaginary part."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        lanes = [builder.extract_element(args[0], _lane(i)) for i in range(N_LANES)]
        while len(lanes) > 2:
            half = len(lanes) // 2
            lanes = [builder.fadd(lanes[i], lanes[i + half]) for i in range(half)]
        made = context.make_complex(builder, signature.return_type)
        made.real, made.imag = lanes
        return made._getvalue()  # noqa: SLF001

    return types.complex64(value), generate


def _magnitude(_typing: Any, value: Any) -> Any:
    """The magnitude of each lane."""

    def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return _call(builder, "llvm.fabs", [args[0]])

    return LANES(value), generate


def _root(_typing: Any, value: Any) -> Any:
    """The square root in each lane."""

    def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return _call(builder, "llvm.sqrt", [args[0]])

    return LANES(value), generate


def _with_sign(_typing: Any, value: Any, sign: Any) -> Any:
    """The magnitude of `value` with the sign of `sign`."""

    def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return _call(builder, "llvm.copysign", list(args))

    return LANES(value, sign), generate


def _extreme(compare: str, text: str) -> Any:
    def typed(_typing: Any, a: Any, b: Any) -> Any:
        def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return builder.select(builder.fcmp_ordered(compare, *args), *args)

        return LANES(a, b), generate

    typed.__doc__ = text
    return intrinsic(typed)


def _shuffle(mask: list[int], text: str) -> Any:
    def typed(_typing: Any, a: Any, b: Any) -> Any:
        def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            places = ir.Constant(ir.VectorType(_I32, N_LANES), mask)
            return builder.shuffle_vector(*args, places)

        return LANES(a, b), generate

    typed.__doc__ = text
    return intrinsic(typed)


def _lane(number: int) -> Any:
    return ir.Constant(_I32, number)


def _call(builder: Any, name: str, args: list[Any]) -> Any:
    kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(args))
    function = cgutils.get_or_insert_function(builder.module, kind, f"{name}.v8f32")
    return builder.call(function, args)


load: Any = intrinsic(_load)
store: Any = intrinsic(_store)
store_int16: Any = intrinsic(_store_int16)
splat: Any = intrinsic(_splat)
total: Any = intrinsic(_total)
pairs: Any = intrinsic(_pairs)
magnitude: Any = intrinsic(_magnitude)
root: Any = intrinsic(_root)
with_sign: Any = intrinsic(_with_sign)
least: Any = _extreme("<", "The smaller in each lane.")
most: Any = _extreme(">", "The larger in each lane.")
first_halves: Any = _shuffle([0, 8, 1, 9, 2, 10, 3, 11], "Lanes 0 to 3 of both, by turns.")
second_halves: Any = _shuffle([4, 12, 5, 13, 6, 14, 7, 15], "Lanes 4 to 7 of both, by turns.")
