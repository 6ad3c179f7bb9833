"""What a receiver's front end adds to every sample: noise, image, DC and quantisation."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from phy import compute
from phy.sizes import NOISE_CHUNK


@dataclass(frozen=True)
class FrontEndParams:
    """The impairments of a receiver.

    `noise_dbfs` and `dc_dbfs` are powers in dB relative to full scale (−inf: none), `image_db` is
    how far the image is below the signal (inf: none). `bits` is the resolution of the converter,
    which also clips at full scale; 0: no quantisation and no clipping.
    """

    noise_dbfs: float = -np.inf
    image_db: float = np.inf
    dc_dbfs: float = -np.inf
    bits: int = 0


class FrontEnd:
    """Noise, IQ imbalance, DC offset and quantisation of one receiver."""

    def __init__(self, params: FrontEndParams, rng: Generator) -> None:
        self._params = params
        self._noise = np.float32(np.sqrt(10 ** (params.noise_dbfs / 10) / 2))
        self._key = int(rng.integers(2**63))
        self._next_index = 0
        self._bits = np.empty(NOISE_CHUNK, np.uint32)
        self._radii = np.empty(NOISE_CHUNK, np.float32)
        self._image = np.float32(10 ** (-params.image_db / 20))
        self._dc = np.complex64(10 ** (params.dc_dbfs / 20))

    def receive(self, x: NDArray[np.complex64]) -> NDArray[np.complex64]:
        """The digital samples `[n]` of antenna samples `[n]`, which are not modified.

        Any chunking of the same stream gives the same samples.
        """
        if self._noise:
            x = self._noisy(np.ascontiguousarray(x))
        if self._image:
            x = x + self._image * x.conj()
        if self._dc:
            x = x + self._dc
        if self._params.bits:
            x = _quantised(x, self._params.bits)
        return x

    def _noisy(self, x: NDArray[np.complex64]) -> NDArray[np.complex64]:
        noisy = np.empty_like(x)
        first, self._next_index = self._next_index, self._next_index + len(x)
        compute.add_noise(
            x.view(np.float32),
            self._key,
            first,
            float(self._noise),
            self._bits,
            self._radii,
            noisy.view(np.float32),
        )
        return noisy


def _quantised(x: NDArray[np.complex64], bits: int) -> NDArray[np.complex64]:
    full = np.float32(2 ** (bits - 1))
    parts = np.ascontiguousarray(x).view(np.float32) * full
    parts = np.clip(np.round(parts), -full, full - 1) / full
    return parts.astype(np.float32).view(np.complex64)
