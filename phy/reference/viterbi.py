"""The K = 7 code with the generators 133 and 171 (octal), decoded by Viterbi's algorithm (1967).

A state is the last six bits, the newest highest. Each step of the trellis takes a new bit u: state
s changes to (u·64 + s) >> 1 and sends two bits, parities of the seven-bit register u·64 + s under
the generators. The likeliest path into a state leads through the likeliest path into one of its two
predecessors, so 64 paths are enough.

Here each state keeps a list of its likeliest paths, not one (Seshadri and Sundberg 1994). The
caller's check sum then finds the right one among those that end in state 0.
"""

import numpy as np
from numpy.typing import NDArray

GENERATORS = (0o133, 0o171)
N_STATES = 64
N_TAIL = 6
MAX_LLR = 511
"""Limit of LLRs: a single subcarrier must not outvote all others."""
UNREACHED = -(1 << 30)

_STATE = np.arange(N_STATES)
# State s is reached from 2s and 2s + 1 (modulo 64), by a new bit that is s's highest.
_CAME_FROM = np.stack((2 * _STATE % N_STATES, 2 * _STATE % N_STATES + 1), axis=1)
_REGISTER = (_STATE >> 5)[:, None] << 6 | _CAME_FROM


def _sent(generator: int) -> NDArray[np.int64]:
    """Signs of the transitions `[64, 2]`: +1 where they send 0, −1 where they send 1."""
    tapped = _REGISTER & generator
    parity = sum(tapped >> i & 1 for i in range(7)) % 2
    return np.asarray(1 - 2 * parity, np.int64)


_SENT_A, _SENT_B = map(_sent, GENERATORS)


def encode(bits: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Encode bits `[n]` and a tail of six zeros to A and B in turn `[2 (n + 6)]`.

        A[t] = Σ_i a_i u[t − i],  B[t] = Σ_i b_i u[t − i]  (mod 2)

    a and b are the bits of 133 and 171, the highest at i = 0 (IEEE 802.11-2020, 17.3.5.6).
    """
    n = len(bits) + N_TAIL
    coded = np.empty((n, 2), np.uint8)
    for i, generator in enumerate(GENERATORS):
        taps = [generator >> (6 - delay) & 1 for delay in range(7)]
        coded[:, i] = np.convolve(bits.astype(np.int64), taps)[:n] % 2
    return coded.reshape(-1)


def decode(llr: NDArray[np.integer], n_list: int = 1) -> NDArray[np.uint8]:
    """Decode LLRs `[2 t]`, positive for 0, to the `n_list` likeliest paths from state 0 to state 0.

        metric of a path = Σ_t ±L_A[t] ± L_B[t], + where it sends 0

    Returns bits `[n_list, t]`, the likeliest first, with their tails. Of two equally likely paths,
    the one from the even state wins.
    """
    steps = llr.astype(np.int64).reshape(-1, 2)
    metrics = np.full((N_STATES, n_list), UNREACHED)
    metrics[0, 0] = 0
    chosen = np.empty((len(steps), N_STATES, n_list), np.int64)
    for t, (a, b) in enumerate(steps):
        gain = a * _SENT_A + b * _SENT_B
        candidates = (metrics[_CAME_FROM] + gain[..., None]).reshape(N_STATES, 2 * n_list)
        chosen[t] = np.argsort(-candidates, axis=1, kind="stable")[:, :n_list]
        metrics = np.take_along_axis(candidates, chosen[t], axis=1)
    out = np.empty((n_list, len(steps)), np.uint8)
    for number in range(n_list):
        state, rank = 0, number
        for t in reversed(range(len(steps))):
            out[number, t] = state >> 5
            predecessor, rank = divmod(int(chosen[t, state, rank]), n_list)
            state = int(_CAME_FROM[state, predecessor])
    return out
