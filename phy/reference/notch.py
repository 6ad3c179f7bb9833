"""Lines in the spectrum of overlapping windows, and the samples without them; see `phy.excisor`."""

import numpy as np
from numpy.typing import NDArray

from phy.tables.block import ArgumentBlock
from phy.tables.notch import LINE_DB, MOST_CUT, SIZE, STRIDE, NotchMemory


def find_lines(
    x: NDArray[np.complex64],
    n: int,
    apart: int,
    block: ArgumentBlock[NotchMemory],
    cut: NDArray[np.uint8],
) -> int:
    """Number of the first of `n` windows of `x`, `apart` samples apart, with lines, or −1."""
    spectra = _spectra(x, n, apart, block.content)
    found = [_judge(np.abs(each) ** 2, row) > 0 for each, row in zip(spectra, cut, strict=False)]
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
        found[i] = _judge(np.abs(spectrum) ** 2, cut[i])
        y = window * np.fft.ifft(np.where(cut[i], 0, spectrum))
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


def _judge(power: NDArray[np.float64], cut: NDArray[np.uint8]) -> int:
    """Mark the bins to cut: those LINE_DB above the median, and their neighbors; −1: too many."""
    lines = power > 10 ** (LINE_DB / 10) * np.median(power)
    cut[:] = lines | np.roll(lines, 1) | np.roll(lines, -1)
    n = int(cut.sum())
    if n <= MOST_CUT:
        return n
    cut[:] = 0
    return -1
