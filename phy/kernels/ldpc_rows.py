"""A block row of LDPC checks as LLVM vector instructions; for the method see `phy.kernels.ldpc`.

numba widens int16 arithmetic to int64 and must assume that arrays overlap, which defeats
vectorisation. So a row is written as instructions on 32 int16, which LLVM lowers to what the
machine has (AVX2, AVX-512, NEON).
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from phy.sizes import N_LANES_INT16

LANES = N_LANES_INT16
MAX_POSTERIOR = 8000
"""Limit of posteriors, so that they fit 16 bits with any message added or subtracted."""
WEIGHT = 14
"""Factor of messages, in sixteenths."""
MAX_MAGNITUDE = 2000
"""Limit of magnitudes; times WEIGHT, it fits 16 bits."""
_NO_MINIMUM = 32000

_I16, _I32, _I64 = ir.IntType(16), ir.IntType(32), ir.IntType(64)
_VECTOR = ir.VectorType(_I16, LANES)


def _row_generator(
    _context: Any, posteriors: Any, messages: Any, told: Any, scratch: Any, columns: Any,
    shifts: Any, first: Any, last: Any, z: Any,
) -> Any:  # fmt: skip
    """Visit one block row with edges `first` … `last` − 1; returns 0 if its checks already held."""
    arrays = (posteriors, messages, told, scratch, columns, shifts)
    signature = types.int64(*arrays, first, last, z)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        made = [
            context.make_array(kind)(context, builder, value)
            for kind, value in zip(signature.args[:6], args[:6], strict=True)
        ]
        row = _Row(builder, made, *args[6:])
        return row.emit()

    return signature, generate


ldpc_row: Any = intrinsic(_row_generator)


class _Row:
    """Emits the instructions of a block row."""

    def __init__(self, builder: Any, arrays: list[Any], first: Any, last: Any, z: Any) -> None:
        self.builder = builder
        posteriors, messages, told, scratch, columns, shifts = arrays
        self.posteriors, self.messages, self.told = posteriors.data, messages.data, told.data
        self.scratch, self.columns, self.shifts = scratch.data, columns.data, shifts.data
        self.stride = builder.extract_value(posteriors.shape, 1)
        self.message_stride = builder.extract_value(messages.shape, 1)
        self.first, self.last, self.z = first, last, z
        self.n_vectors = self.vectors(z)

    def emit(self) -> Any:
        builder = self.builder
        odd = self.variable(0)
        with cgutils.for_range(builder, self.n_vectors) as vector:
            at = builder.mul(vector.index, _long(LANES))
            self.checks(at, odd)
        with self.edges() as (edge, _):
            self.mend(edge)
        # A sign in any lane means that a check did not hold.
        signs = builder.icmp_signed("<", builder.load(odd), _splat(0))
        return builder.zext(builder.bitcast(signs, _I32), _I64)

    def checks(self, at: Any, odd: Any) -> None:
        """Emit 32 checks: new messages and posteriors of all their bits."""
        builder = self.builder
        least, second = self.variable(_NO_MINIMUM), self.variable(_NO_MINIMUM)
        sign, parity = self.variable(0), self.variable(0)
        with self.edges() as (edge, number):
            posterior = self.load(self.posteriors, self.place(edge, at))
            message = self.load(self.messages, self.message_place(edge, at))
            rest = builder.sub(posterior, message)
            self.store(rest, self.scratch, builder.mul(number, _long(LANES)))
            rest = self.unless_turned(rest, self.message_place(edge, at))
            size = self.magnitude(rest)
            larger = self.larger(size, builder.load(least))
            builder.store(self.smaller(builder.load(second), larger), second)
            builder.store(self.smaller(builder.load(least), size), least)
            builder.store(builder.xor(builder.load(sign), rest), sign)
            builder.store(builder.xor(builder.load(parity), posterior), parity)
        builder.store(builder.or_(builder.load(odd), builder.load(parity)), odd)
        smallest, signs = builder.load(least), builder.load(sign)
        usual, for_smallest = self.weighted(smallest), self.weighted(builder.load(second))
        with self.edges() as (edge, number):
            told = self.load(self.told, self.message_place(edge, at))
            is_smallest = builder.icmp_signed("==", self.magnitude(told), smallest)
            size = builder.select(is_smallest, for_smallest, usual)
            is_negative = builder.icmp_signed("<", builder.xor(signs, told), _splat(0))
            message = builder.select(is_negative, builder.neg(size), size)
            self.store(message, self.messages, self.message_place(edge, at))
            rest = self.load(self.scratch, builder.mul(number, _long(LANES)))
            posterior = self.smaller(builder.add(rest, message), _splat(MAX_POSTERIOR))
            posterior = self.larger(posterior, _splat(-MAX_POSTERIOR))
            self.store(posterior, self.posteriors, self.place(edge, at))

    def unless_turned(self, rest: Any, place: Any) -> Any:
        """The message of a bit to a check, also stored: `rest`, or 0 if its sign has changed."""
        builder = self.builder
        before = self.load(self.told, place)
        turned = builder.and_(
            builder.icmp_signed("<", builder.xor(rest, before), _splat(0)),
            builder.icmp_signed("!=", before, _splat(0)),
        )
        now = builder.select(turned, _splat(0), rest)
        self.store(now, self.told, place)
        return now

    def mend(self, edge: Any) -> None:
        """Make a block column periodic: copy the values at `shift` … to Z before and after."""
        builder = self.builder
        column, shift = self.column_and_shift(edge)
        base = builder.mul(column, self.stride)
        behind = builder.add(builder.add(base, shift), builder.mul(self.n_vectors, _long(LANES)))
        with cgutils.for_range(builder, self.vectors(builder.sub(self.z, shift))) as vector:
            to = builder.add(behind, builder.mul(vector.index, _long(LANES)))
            self.store(self.load(self.posteriors, builder.sub(to, self.z)), self.posteriors, to)
        with cgutils.for_range(builder, self.vectors(shift)) as vector:
            to = builder.add(base, builder.mul(vector.index, _long(LANES)))
            self.store(self.load(self.posteriors, builder.add(to, self.z)), self.posteriors, to)

    def edges(self) -> Any:
        """A loop over the row's edges: (edge, its index in the row)."""
        return _edges(self.builder, self.first, self.last)

    def column_and_shift(self, edge: Any) -> tuple[Any, Any]:
        builder = self.builder
        column = builder.load(builder.gep(self.columns, [edge]))
        shift = builder.load(builder.gep(self.shifts, [edge]))
        return builder.sext(column, _I64), builder.sext(shift, _I64)

    def place(self, edge: Any, at: Any) -> Any:
        builder = self.builder
        column, shift = self.column_and_shift(edge)
        return builder.add(builder.mul(column, self.stride), builder.add(shift, at))

    def message_place(self, edge: Any, at: Any) -> Any:
        return self.builder.add(self.builder.mul(edge, self.message_stride), at)

    def vectors(self, n: Any) -> Any:
        """Number of vectors that hold `n` lanes."""
        return self.builder.sdiv(self.builder.add(n, _long(LANES - 1)), _long(LANES))

    def variable(self, value: int) -> Any:
        variable = cgutils.alloca_once(self.builder, _VECTOR)
        self.builder.store(_splat(value), variable)
        return variable

    def load(self, array: Any, at: Any) -> Any:
        value = self.builder.load(self.vector_at(array, at))
        value.align = 2
        return value

    def store(self, value: Any, array: Any, at: Any) -> None:
        self.builder.store(value, self.vector_at(array, at)).align = 2

    def vector_at(self, array: Any, at: Any) -> Any:
        return self.builder.bitcast(self.builder.gep(array, [at]), _VECTOR.as_pointer())

    def magnitude(self, x: Any) -> Any:
        is_negative = self.builder.icmp_signed("<", x, _splat(0))
        return self.builder.select(is_negative, self.builder.neg(x), x)

    def smaller(self, x: Any, y: Any) -> Any:
        return self.builder.select(self.builder.icmp_signed("<", x, y), x, y)

    def larger(self, x: Any, y: Any) -> Any:
        return self.builder.select(self.builder.icmp_signed(">", x, y), x, y)

    def weighted(self, x: Any) -> Any:
        """A magnitude times WEIGHT / 16, rounded."""
        builder = self.builder
        product = builder.mul(self.smaller(x, _splat(MAX_MAGNITUDE)), _splat(WEIGHT))
        return builder.ashr(builder.add(product, _splat(8)), _splat(4))


def _edges(builder: Any, first: Any, last: Any) -> Any:
    """A loop over edges `first` … `last` − 1: (edge, number of edges before it)."""
    return cgutils.for_range_slice(builder, first, last, _long(1), _I64)


def _long(value: int) -> ir.Constant:
    return ir.Constant(_I64, value)


def _splat(value: int) -> ir.Constant:
    return ir.Constant(_VECTOR, [ir.Constant(_I16, value)] * LANES)
