"""Finds the `n_list` likeliest code words of the K=7 code, not only the likeliest.

This is the Viterbi algorithm with a list in every state (Seshadri and Sundberg 1994). A check sum
then finds the right word among them. It is slow compared with `phy.kernels.viterbi`, and used only
when that has failed.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.convolution import N_STATES, PARITY_A, PARITY_B
from phy.kernels.local import local

_UNREACHED = -(1 << 30)


@njit(nogil=True, cache=True, error_model="numpy")
def list_decode(llr: NDArray[np.int16], out: NDArray[np.uint8]) -> None:
    """Write the bits `[n_list, t]` of the likeliest paths, best first; LLRs are `[2 t]`.

    Paths begin and end in state 0.
    """
    n_list, n_steps = out.shape
    metrics, grown = local(np.int64, (N_STATES, n_list)), local(np.int64, (N_STATES, n_list))
    metrics[:] = _UNREACHED
    metrics[0, 0] = 0
    # Choice of predecessor and of its path: 2 · rank + predecessor.
    came_from = local(np.int16, (n_steps, N_STATES, n_list))
    for t in range(n_steps):
        a, b = int(llr[2 * t]), int(llr[2 * t + 1])
        for state in range(N_STATES):
            even, odd = 2 * state, 2 * state + 1
            gain_even = _agreement(a, b, even)
            gain_odd = _agreement(a, b, odd)
            rank_even, rank_odd = 0, 0
            for rank in range(n_list):
                by_even = metrics[even % N_STATES, rank_even] + gain_even
                by_odd = metrics[odd % N_STATES, rank_odd] + gain_odd
                if by_even >= by_odd:
                    grown[state, rank] = by_even
                    came_from[t, state, rank] = 2 * rank_even
                    rank_even += 1
                else:
                    grown[state, rank] = by_odd
                    came_from[t, state, rank] = 2 * rank_odd + 1
                    rank_odd += 1
        metrics, grown = grown, metrics
    for number in range(n_list):
        state, rank = 0, number
        for t in range(n_steps - 1, -1, -1):
            out[number, t] = state >> 5
            origin = int(came_from[t, state, rank])
            state, rank = (2 * state + (origin & 1)) % N_STATES, origin >> 1


@njit(nogil=True, cache=True, error_model="numpy")
def _agreement(a: int, b: int, register: int) -> int:
    """How well LLRs agree with the encoder's output from `register`."""
    return (-a if PARITY_A[register] else a) + (-b if PARITY_B[register] else b)
