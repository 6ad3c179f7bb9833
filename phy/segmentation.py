"""How a PDU of any size becomes codewords: the LDPC codes of IEEE 802.11, shortened and punctured.

Tables and arithmetic only; `phy.ldpc` encodes and decodes.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from phy.ldpc_80211n import BASE
from phy.sizes import N_COLUMNS

LIFTINGS = (27, 54, 81)
MAX_ITERATIONS = 60
"""Number of iterations after which a decoder gives up."""


@dataclass(frozen=True)
class QuasiCyclic:
    """A code of 24 Z bits, given by its base matrix; see `phy.kernels.ldpc` for the terms."""

    z: int
    rate: Fraction

    @cached_property
    def base(self) -> NDArray[np.int32]:
        """Shifts `[rows, 24]`, −1 where there is no block."""
        rows = BASE[self.z, f"{self.rate.numerator}/{self.rate.denominator}"].split("\n")
        shifts = [[-1 if each == "." else int(each) for each in row.split()] for row in rows]
        return np.array([row for row in shifts if row], np.int32)

    @property
    def n(self) -> int:
        """Bits of a codeword, 24 Z."""
        return N_COLUMNS * self.z

    @property
    def k(self) -> int:
        """Information bits of a codeword, which come first."""
        return self.n - len(self.base) * self.z

    @cached_property
    def row_ends(self) -> NDArray[np.int32]:
        """Start of each block row's edges, and the end of the last row `[rows + 1]`."""
        per_row = np.count_nonzero(self.base >= 0, axis=1)
        return np.concatenate(([0], np.cumsum(per_row))).astype(np.int32)

    @cached_property
    def columns(self) -> NDArray[np.int32]:
        """Block column of each edge `[edges]`, row by row."""
        return np.nonzero(self.base >= 0)[1].astype(np.int32)

    @cached_property
    def shifts(self) -> NDArray[np.int32]:
        """Shift of each edge `[edges]`, row by row."""
        found: NDArray[np.int32] = self.base[self.base >= 0]
        return found

    @cached_property
    def middle(self) -> int:
        """The row in which the first parity column has its middle block."""
        return int(np.flatnonzero(self.base[:, N_COLUMNS - len(self.base)] >= 0)[1])


@dataclass(frozen=True, eq=False)
class Segmentation:
    """How a block of `n_bits` becomes codewords of `code`.

    Each codeword carries an almost equal share of the block. The rest of its information bits are 0
    and not sent (shortened). Parity bits at the end that do not fit into `n_coded` are not sent
    either (punctured).
    """

    code: QuasiCyclic
    n_bits: int
    n_codewords: int
    n_coded: int

    @cached_property
    def shares(self) -> NDArray[np.int32]:
        """Bits of the block in each codeword `[codewords]`."""
        return _shares(self.n_bits, self.n_codewords)

    @cached_property
    def ends(self) -> NDArray[np.int32]:
        """Start of each codeword's bits, and the end of the last `[codewords + 1]`."""
        parity = _shares(self.n_coded - self.n_bits, self.n_codewords)
        return np.concatenate(([0], np.cumsum(self.shares + parity))).astype(np.int32)


def least_coded(n_bits: int, rate: Fraction) -> int:
    """Number of coded bits for a block of `n_bits` at exactly `rate`."""
    return math.ceil(n_bits / rate)


@lru_cache(maxsize=256)
def segmentation(n_bits: int, rate: Fraction, room: int) -> Segmentation:
    """Fit a block of `n_bits` into at most `room` coded bits.

    The result has the fewest possible codewords, and of those the shortest. `room` is at least
    `least_coded`; coded bits that the codewords cannot use remain free.
    """
    n_codewords = -(-n_bits // _code(LIFTINGS[-1], rate).k)
    code = next(each for z in LIFTINGS if n_codewords * (each := _code(z, rate)).k >= n_bits)
    most = n_bits + n_codewords * (code.n - code.k)
    return Segmentation(code, n_bits, n_codewords, min(room, most))


@cache
def _code(z: int, rate: Fraction) -> QuasiCyclic:
    return QuasiCyclic(z, rate)


def _shares(n: int, n_codewords: int) -> NDArray[np.int32]:
    share, more = divmod(n, n_codewords)
    return np.array([share + (i < more) for i in range(n_codewords)], np.int32)
