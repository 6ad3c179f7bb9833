"""The K=7 convolutional code (133, 171) of IEEE 802.11-2020, 17.3.5.6, and its puncturing."""

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from phy import compute
from phy.sizes import MAX_LLR

N_TAIL = 6

__all__ = [
    "HALF",
    "MAX_LLR",
    "THREE_QUARTERS",
    "TWO_THIRDS",
    "CodeRate",
    "ViterbiWorkspace",
    "decode",
    "decode_list",
    "encode",
]


class ViterbiWorkspace:
    """Working memory of decoding, for blocks of up to `n_steps` bits, including the tail.

    One per thread, because the kernels hold no lock.
    """

    def __init__(self, n_steps: int) -> None:
        self.mother = np.zeros(2 * n_steps, np.int16)
        self.decisions = np.zeros(n_steps, np.uint64)
        self.n_steps = n_steps


@dataclass(frozen=True)
class CodeRate:
    """A rate of the punctured code; `pattern` has 1 for each bit sent, outputs A and B in turn."""

    name: str
    rate: Fraction
    pattern: tuple[int, ...]

    def n_coded(self, n_bits: int) -> int:
        """Number of coded bits for `n_bits` of information and the tail."""
        return len(self.kept(n_bits))

    def kept(self, n_bits: int) -> NDArray[np.int32]:
        """Ascending positions of the sent bits among the mother code's 2 (n_bits + 6) bits."""
        return _kept(self.pattern, n_bits)


@lru_cache(maxsize=64)
def _kept(pattern: tuple[int, ...], n_bits: int) -> NDArray[np.int32]:
    n = 2 * (n_bits + N_TAIL)
    return np.flatnonzero(np.resize(np.array(pattern), n)).astype(np.int32)


HALF = CodeRate("1/2", Fraction(1, 2), (1, 1))
TWO_THIRDS = CodeRate("2/3", Fraction(2, 3), (1, 1, 1, 0))
THREE_QUARTERS = CodeRate("3/4", Fraction(3, 4), (1, 1, 1, 0, 0, 1))


def encode(data: NDArray[np.uint8], code: CodeRate) -> NDArray[np.uint8]:
    """Coded bits `[n, n_coded]` of `n` blocks of bytes `[n, n_bytes]`, each followed by a tail."""
    n_bits = 8 * data.shape[1]
    bits = np.zeros((len(data), n_bits + N_TAIL), np.uint8)
    bits[:, :n_bits] = np.unpackbits(data, axis=1)
    mother = np.empty((len(data), 2 * bits.shape[1]), np.uint8)
    compute.convolve(bits, mother)
    return mother if code is HALF else mother[:, code.kept(n_bits)]


def decode(
    llr: NDArray[np.int16],
    n_bytes: int,
    code: CodeRate,
    workspace: ViterbiWorkspace,
) -> NDArray[np.uint8]:
    """Decode LLRs `[n, n_coded]`, ±MAX_LLR at most, + for 0, to likeliest bytes `[n, n_bytes]`."""
    out = np.empty((len(llr), n_bytes), np.uint8)
    n_steps = 8 * n_bytes + N_TAIL
    mother, decisions = workspace.mother[: 2 * n_steps], workspace.decisions[:n_steps]
    compute.decode_rows(llr, code.kept(8 * n_bytes), mother, decisions, out)
    return out


def decode_list(llr: NDArray[np.int16], n_bytes: int, n_list: int) -> NDArray[np.uint8]:
    """Decode one block at rate 1/2 to the `n_list` likeliest, `[n_list, n_bytes]`, best first."""
    bits = np.empty((n_list, 8 * n_bytes + N_TAIL), np.uint8)
    compute.list_decode(llr, bits)
    return np.packbits(bits[:, : 8 * n_bytes], axis=1)
