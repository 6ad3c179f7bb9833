"""Reads a recording piece by piece, and runs a receiver over it."""

from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

import phy
from backends import BackendError, RecordingInfo, RecordingReader, Samples, describe
from sdrlinkd.errors import UserError

PIECE = 1 << 18
MAX_POINTS = 20_000
MAX_FREQUENCY = 0.25
"""Largest frequency offset that is searched, in cycles per sample: the receiver's full range, as
the radios' crystals are unknown."""

Progress = Callable[[int], None]


class Points(NamedTuple):
    """Equalised points by modulation, the last MAX_POINTS of each, and their bursts."""

    by_modulation: dict[phy.Modulation, NDArray[np.complex64]]
    bursts: list[phy.BurstQuality]


class IqRecording:
    """A recording opened for reading, for use in `with`. Raises UserError if that fails."""

    def __init__(self, path: Path, type_name: str = "", rate_hz: float | None = None) -> None:
        try:
            self.info: RecordingInfo = describe(path, type_name, rate_hz)
            self._reader = RecordingReader(self.info)
        except BackendError as error:
            raise UserError(str(error)) from None
        if not self.info.n_samples:
            self._reader.close()
            raise UserError(f"{self.info.path}: contains no samples")

    def read(self, first: int, n: int) -> Samples:
        """Up to `n` samples of the recording from `first` on."""
        return self._reader.read(first, n)

    def decode(
        self, network: int | None, progress: Progress, grid: phy.Numerology = phy.OFDM_64_16
    ) -> Iterator[tuple[phy.Event, phy.Receiver]]:
        """The events of a receiver of `network` (None: any), with that receiver.

        `progress(samples read)` is called meanwhile.
        """
        receiver = phy.Receiver(network, MAX_FREQUENCY, grid)
        yield from self._decode(receiver, progress)

    def points(
        self, network: int | None, progress: Progress, grid: phy.Numerology = phy.OFDM_64_16
    ) -> Points:
        """The equalised points of all bursts."""
        kept: dict[phy.Modulation, list[NDArray[np.complex64]]] = defaultdict(list)

        def keep(points: NDArray[np.complex64], modulation: phy.Modulation) -> None:
            pieces = kept[modulation]
            pieces.append(points.reshape(-1))
            while len(pieces) > 1 and sum(map(len, pieces[1:])) >= MAX_POINTS:
                del pieces[0]

        receiver = phy.Receiver(network, MAX_FREQUENCY, grid, on_points=keep)
        bursts = [
            event.burst
            for event, _ in self._decode(receiver, progress)
            if isinstance(event, phy.BurstOver)
        ]
        return Points(
            {each: np.concatenate(pieces)[-MAX_POINTS:] for each, pieces in kept.items()}, bursts
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.close()

    def _decode(
        self, receiver: phy.Receiver, progress: Progress
    ) -> Iterator[tuple[phy.Event, phy.Receiver]]:
        for first in range(0, self.info.n_samples, PIECE):
            for event in receiver.push(self.read(first, PIECE)):
                yield event, receiver
            progress(min(first + PIECE, self.info.n_samples))
        for event in receiver.flush():
            yield event, receiver
