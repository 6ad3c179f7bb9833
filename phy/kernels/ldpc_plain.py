"""What `phy.kernels.ldpc` computes, said plainly: to read, and to check it against."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from phy.kernels.ldpc_form import N_COLUMNS, Form
from phy.kernels.ldpc_rows import MAX_MAGNITUDE, MAX_POSTERIOR, WEIGHT


def decode_codeword_plain(
    llr: NDArray[np.int16], form: Form, max_iterations: int
) -> tuple[int, NDArray[np.int32]]:
    """(iterations until all checks held or 0, posteriors `[24, z]`)."""
    z, columns, shifts = form.z, form.columns, form.shifts
    posteriors = llr.reshape(N_COLUMNS, z).astype(np.int32)
    messages, told = np.zeros((2, len(columns), z), np.int32)
    # Check z of a row takes bit (z + shift) mod Z of each block column.
    takes = (np.arange(z) + shifts[:, None]) % z
    for iteration in range(max_iterations):
        all_hold = True
        for first, last in pairwise(form.row_ends):
            row = slice(first, last)
            bits = (columns[row, None], takes[row])
            all_hold &= not np.any(np.logical_xor.reduce(posteriors[bits] < 0))
            rest = posteriors[bits] - messages[row]
            # What a check is told with another sign than last time counts as 0.
            told[row] = np.where(rest * np.sign(told[row]) < 0, 0, rest)
            messages[row] = _messages(told[row])
            posteriors[bits] = np.clip(rest + messages[row], -MAX_POSTERIOR, MAX_POSTERIOR)
        if all_hold:
            return iteration + 1, posteriors
    return 0, posteriors


def _messages(rest: NDArray[np.int32]) -> NDArray[np.int32]:
    """What each check sends to each of its bits `[bits, checks]`, from what the bits say.

    A bit that says 0 is taken for a positive one.
    """
    size = np.abs(rest)
    least, second = np.sort(size, axis=0)[:2]
    others_least = np.where(size == least, second, least)
    value = (np.minimum(others_least, MAX_MAGNITUDE) * WEIGHT + 8) >> 4
    is_negative = np.logical_xor.reduce(rest < 0) ^ (rest < 0)
    messages: NDArray[np.int32] = np.where(is_negative, -value, value)
    return messages
