"""The K=7 encoder, bit by bit."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

G_A, G_B = 0o133, 0o171
N_STATES = 64


def _parity(register: int) -> int:
    return register.bit_count() & 1


# By register: the new bit, then the six before it, newest first.
PARITY_A = np.array([_parity(r & G_A) for r in range(2 * N_STATES)], np.uint8)
PARITY_B = np.array([_parity(r & G_B) for r in range(2 * N_STATES)], np.uint8)


@njit(nogil=True, cache=True, error_model="numpy")
def convolve(bits: NDArray[np.uint8], out: NDArray[np.uint8]) -> None:
    """Write the mother code's bits A and B in turn `[n, 2 t]` of `bits` `[n, t]`, from state 0."""
    for row in range(bits.shape[0]):
        state = 0
        for t in range(bits.shape[1]):
            register = int(bits[row, t]) << 6 | state
            out[row, 2 * t] = PARITY_A[register]
            out[row, 2 * t + 1] = PARITY_B[register]
            state = register >> 1
