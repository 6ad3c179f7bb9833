"""Soft-decision Viterbi decoder of the K=7 code, 64 states as two vectors of 32 int16.

A state is the last six bits, newest highest. State j < 32 (newest bit 0) and state j + 32 (newest
bit 1) both come from states 2j and 2j + 1. All generators have their first and last tap set, so of
these four transitions, the two outer ones agree with the branch metric m_j and the two inner ones
with its opposite:

    from 2j:  to j  +m_j,  to j+32  −m_j        from 2j+1:  to j  −m_j,  to j+32  +m_j

With E[j] = metric(2j) and O[j] = metric(2j+1), a step of all 64 states is four vector additions and
two maxima. The new metrics come out in the order 0…31 and 32…63; the even and odd elements of both
are the next E and O. The decision is one bit per state: 64 bits per step.

Metrics are compared by the sign of their wrapped difference, so they may overflow and never need
normalising: the spread of 64 states is at most 6 steps of 4 · MAX_LLR each, below 2^15.

numba widens int16 arithmetic to int64, which defeats vectorisation. So the step is written as LLVM
vector instructions, which LLVM lowers to what the machine has (AVX2, AVX-512, NEON).
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from phy.kernels.convolution import PARITY_A, PARITY_B

UNREACHED = -12000
N_HALF = 32

_I16, _I32, _I64 = ir.IntType(16), ir.IntType(32), ir.IntType(64)
_VECTOR = ir.VectorType(_I16, N_HALF)
_LANES = ir.VectorType(_I32, N_HALF)

# Sign with which an LLR supports the transition from state 2j on a new bit 0.
_SIGN_A = [1 - 2 * int(PARITY_A[2 * j]) for j in range(N_HALF)]
_SIGN_B = [1 - 2 * int(PARITY_B[2 * j]) for j in range(N_HALF)]


def _constant(values: list[int]) -> ir.Constant:
    return ir.Constant(_VECTOR, [ir.Constant(_I16, value) for value in values])


def _variable(builder: Any, values: list[int]) -> Any:
    variable = cgutils.alloca_once(builder, _VECTOR)
    builder.store(_constant(values), variable)
    return variable


def _forward_generator(_context: Any, llr: Any, decisions: Any) -> Any:
    """Run all steps of the trellis from state 0: LLRs `[2 t]` to decisions `[t]`."""
    signature = types.void(llr, decisions)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        llr_array, decision_array = (
            context.make_array(kind)(context, builder, value)
            for kind, value in zip(signature.args, args, strict=True)
        )
        n_steps = builder.extract_value(decision_array.shape, 0)
        _emit_steps(builder, llr_array.data, decision_array.data, n_steps)
        return context.get_dummy_value()

    return signature, generate


_forward: Any = intrinsic(_forward_generator)


def _emit_steps(builder: Any, llr: Any, decisions: Any, n_steps: Any) -> None:
    undefined = ir.Constant(_VECTOR, ir.Undefined)
    zero = _constant([0] * N_HALF)
    evens = ir.Constant(_LANES, [ir.Constant(_I32, 2 * j) for j in range(N_HALF)])
    odds = ir.Constant(_LANES, [ir.Constant(_I32, 2 * j + 1) for j in range(N_HALF)])
    first = ir.Constant(_LANES, [ir.Constant(_I32, 0)] * N_HALF)

    def splat(value: Any) -> Any:
        one = builder.insert_element(undefined, value, ir.Constant(_I32, 0))
        return builder.shuffle_vector(one, undefined, first)

    def better(one: Any, other: Any) -> tuple[Any, Any]:
        """(the larger metrics, one bit a lane: whether it was `other`), wrap-around allowed."""
        other_won = builder.icmp_signed(">", builder.sub(other, one), zero)
        bits = builder.zext(builder.bitcast(other_won, _I32), _I64)
        return builder.select(other_won, other, one), bits

    even = _variable(builder, [0] + [UNREACHED] * (N_HALF - 1))
    odd = _variable(builder, [UNREACHED] * N_HALF)
    with cgutils.for_range(builder, n_steps) as loop:
        at = builder.shl(loop.index, ir.Constant(_I64, 1))
        llr_a = builder.load(builder.gep(llr, [at]))
        llr_b = builder.load(builder.gep(llr, [builder.add(at, ir.Constant(_I64, 1))]))
        branch = builder.add(
            builder.mul(splat(llr_a), _constant(_SIGN_A)),
            builder.mul(splat(llr_b), _constant(_SIGN_B)),
        )
        from_even, from_odd = builder.load(even), builder.load(odd)
        low, low_bits = better(builder.add(from_even, branch), builder.sub(from_odd, branch))
        high, high_bits = better(builder.sub(from_even, branch), builder.add(from_odd, branch))
        both = builder.or_(low_bits, builder.shl(high_bits, ir.Constant(_I64, N_HALF)))
        builder.store(both, builder.gep(decisions, [loop.index]))
        builder.store(builder.shuffle_vector(low, high, evens), even)
        builder.store(builder.shuffle_vector(low, high, odds), odd)


@njit(nogil=True, cache=True, error_model="numpy")
def decode_block(
    llr: NDArray[np.int16], decisions: NDArray[np.uint64], out: NDArray[np.uint8]
) -> None:
    """Decode LLRs of the mother code `[2 t]` to the likeliest bytes, without the tail."""
    out[:] = 0
    n_bits = 8 * out.size
    _forward(llr, decisions)
    state = 0
    for t in range(decisions.size - 1, -1, -1):
        if t < n_bits:
            out[t >> 3] |= np.uint8((state >> 5) << (7 - (t & 7)))
        won_by_odd = int(decisions[t] >> np.uint64(state)) & 1
        state = (state & 31) << 1 | won_by_odd


@njit(nogil=True, cache=True, error_model="numpy")
def decode_rows(
    llr: NDArray[np.int16],
    kept: NDArray[np.int32],
    mother: NDArray[np.int16],
    decisions: NDArray[np.uint64],
    out: NDArray[np.uint8],
) -> None:
    """Decode LLRs `[n, n_coded]` to bytes `[n, n_bytes]`; column i is bit `kept[i]` of the code."""
    mother[:] = 0
    for block in range(llr.shape[0]):
        for i in range(kept.size):
            mother[kept[i]] = llr[block, i]
        decode_block(mother, decisions, out[block])
