"""The subcarriers of an OFDM symbol and their purpose (64: IEEE 802.11-2020, 17.3.5.10)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Subcarriers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Numerology:
    """An OFDM grid; there is only one object of each.

    Subcarriers are numbered from −n_fft/2; subcarrier 0, at DC, is unused.
    """

    n_fft: int
    n_cp: int
    edge: int
    """Outermost subcarrier in use."""
    pilots: tuple[int, ...]
    pilot_signs: tuple[int, ...]

    @property
    def n_symbol(self) -> int:
        """Samples of a symbol, including its cyclic prefix."""
        return self.n_fft + self.n_cp

    @cached_property
    def n_data(self) -> int:
        """Number of data subcarriers of a symbol."""
        return self.n_used - len(self.pilots)

    @property
    def n_used(self) -> int:
        """Number of subcarriers in use, data and pilots together."""
        return 2 * self.edge

    @cached_property
    def used(self) -> Subcarriers:
        """Numbers of the subcarriers in use, ascending `[n_used]`."""
        return np.array([k for k in range(-self.edge, self.edge + 1) if k], np.int64)

    @cached_property
    def bins(self) -> Subcarriers:
        """FFT bins of the subcarriers in use, in the order of `used` `[n_used]`."""
        return self.used % self.n_fft

    @cached_property
    def data_at(self) -> Subcarriers:
        """Positions of the data subcarriers in `used` `[n_data]`."""
        return np.flatnonzero(~np.isin(self.used, self.pilots))

    @cached_property
    def pilots_at(self) -> Subcarriers:
        """Positions of the pilots in `used` `[n_pilots]`."""
        return np.flatnonzero(np.isin(self.used, self.pilots))

    @cached_property
    def tones(self) -> Subcarriers:
        """Positions in `used`, first of the data subcarriers, then of the pilots `[n_used]`."""
        return np.concatenate((self.data_at, self.pilots_at))

    @cached_property
    def pilot_values(self) -> NDArray[np.float32]:
        """Pilots of a symbol with polarity +1 `[n_pilots]`."""
        return np.array(self.pilot_signs, np.float32)

    @cached_property
    def scale(self) -> float:
        """Factor of the inverse FFT that yields samples of mean power 1."""
        return float(self.n_fft / np.sqrt(self.n_used))


def _map_of_802_11(n_cp: int) -> Numerology:
    return Numerology(64, n_cp, 26, (-21, -7, 7, 21), (1, 1, 1, -1))


OFDM_64_16 = _map_of_802_11(16)
"""The default: 48 data subcarriers and 4 pilots; the cyclic prefix is 1/4 of the FFT length."""
OFDM_64_8 = _map_of_802_11(8)
"""For rates of a few Msps, where echoes are shorter than 8 samples."""
OFDM_128_16 = Numerology(
    128, 16, 52, (-45, -32, -19, -6, 6, 19, 32, 45), (1, 1, -1, 1, 1, 1, 1, -1)
)
"""Echoes as long as on OFDM_64_16 at half the overhead, for robots that move slowly."""
OFDM_256_32 = Numerology(
    256, 32, 104,
    (-97, -84, -71, -58, -45, -32, -19, -6, 6, 19, 32, 45, 58, 71, 84, 97),
    (1, 1, 1, -1, -1, 1, -1, 1, 1, 1, -1, 1, 1, -1, 1, 1),
)  # fmt: skip
"""For long echoes: tunnels at many Msps."""

GRIDS = {
    f"{grid.n_fft}/{grid.n_cp}": grid for grid in (OFDM_64_16, OFDM_64_8, OFDM_128_16, OFDM_256_32)
}
"""Every grid, by FFT size and samples of prefix."""
