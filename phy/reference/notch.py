"""Lines in the spectrum of overlapping windows, and the samples without them; see `phy.excisor`."""

import numpy as np
from numpy.typing import NDArray

from phy.tables.block import ArgumentBlock
from phy.tables.notch import CLOSE, DC_BACK, LINE_DB, MOST_CUT, SEED_DB, SIZE, STRIDE, NotchMemory


def find_lines(
    x: NDArray[np.complex64],
    n: int,
    apart: int,
    block: ArgumentBlock[NotchMemory],
    cut: NDArray[np.uint8],
) -> int:
    """Number of the first of `n` windows of `x`, `apart` samples apart, with lines, or −1."""
    spectra = _spectra(x, n, apart, block.content)
    none = np.zeros(SIZE, np.uint8)
    powers = (np.abs(each) ** 2 for each in spectra)
    found = [_judge(power, none, row) > 0 for power, row in zip(powers, cut, strict=False)]
    return found.index(True) if any(found) else -1


def cut_lines(
    x: NDArray[np.complex64],
    n: int,
    block: ArgumentBlock[NotchMemory],
    out: NDArray[np.complex64],
    cut: NDArray[np.uint8],
    found: NDArray[np.int64],
) -> None:
    """Write the first halves of `n` windows of `x`, STRIDE apart, to `out`, without lines."""
    memory = block.content
    window = memory.window
    for i, spectrum in enumerate(_spectra(x, n, STRIDE, memory)):
        found[i] = _judge(np.abs(spectrum) ** 2, memory.held, cut[i])
        memory.held[:] = cut[i]
        memory.quiet[0] = 0 if found[i] > 0 else memory.quiet[0] + 1
        if memory.quiet[0] <= DC_BACK:
            y = window * np.fft.ifft(np.where(cut[i], 0, spectrum))
        else:
            # With its DC.
            y = np.asarray(window**2 * x[i * STRIDE : i * STRIDE + SIZE], np.complex128)
        out[i * STRIDE : (i + 1) * STRIDE] = y[:STRIDE] + (memory.tail[0] + 1j * memory.tail[1])
        memory.tail[:] = y[STRIDE:].real, y[STRIDE:].imag


def _spectra(
    x: NDArray[np.complex64], n: int, apart: int, memory: NotchMemory
) -> list[NDArray[np.complex128]]:
    """X = FFT(w (x − m)) of each window `[SIZE]`, m = Σ w² x / Σ w²: without DC."""
    made = []
    for begin in range(0, n * apart, apart):
        window = x[begin : begin + SIZE]
        mean = (window * memory.weights[::2]).sum()
        made.append(np.fft.fft((window - mean) * memory.window))
    return made


def _judge(power: NDArray[np.float64], held: NDArray[np.uint8], cut: NDArray[np.uint8]) -> int:
    """Mark the bins to cut, and their neighbors; −1: too many.

    They are those SEED_DB above the median, those LINE_DB above it that were `held` before, and
    those LINE_DB above it that are close to one of either, or to one that is close to it.
    """
    middle = np.median(power)
    lines = power > 10 ** (LINE_DB / 10) * middle
    sure = (power > 10 ** (SEED_DB / 10) * middle) | (lines & (held > 0))
    cut[:] = 0
    if not sure.any():
        return 0
    # Twice around, from a sure one on.
    order = (np.flatnonzero(sure)[0] + np.arange(2 * SIZE)) % SIZE
    for way in (order, order[::-1]):
        apart = 0
        for k in way:
            apart += 1
            if sure[k] or (lines[k] and (cut[k] or apart <= CLOSE)):
                cut[k], apart = 1, 0
    near = cut | np.roll(cut, 1) | np.roll(cut, -1)
    cut[:] = near if near.sum() <= MOST_CUT else 0
    return int(near.sum()) if near.sum() <= MOST_CUT else -1
