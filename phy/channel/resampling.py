"""Windowed-sinc interpolation between samples, for delays and clock differences."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy import compute

N_TAPS = 32
N_PHASES = 512
_KAISER = 9.0


@cache
def _filters() -> NDArray[np.float32]:
    """Interpolation filters for delays of 0 … 1 sample `[N_PHASES + 1, N_TAPS]`."""
    delay = np.arange(N_PHASES + 1)[:, None] / N_PHASES
    t = np.arange(N_TAPS) - (N_TAPS // 2 - 1) - delay
    window = np.i0(_KAISER * np.sqrt(np.clip(1 - (t / (N_TAPS / 2)) ** 2, 0, None)))
    return (np.sinc(t) * window / np.i0(_KAISER)).astype(np.float32)


def stretch(x: NDArray[np.complex64], delay: float, clock_error: float) -> NDArray[np.complex64]:
    """`x` delayed by `delay` ≥ 0 samples, from a sender whose clock is fast by `clock_error`.

    Sample n of the result is x at (1 + clock_error) n − delay; the result is long enough for all of
    `x`.
    """
    n = int(np.ceil((len(x) + delay) / (1 + clock_error))) + N_TAPS // 2
    out = np.empty(n, np.complex64)
    parts = np.stack((x.real, x.imag))
    compute.interpolate(parts, _filters(), -delay, 1 + clock_error, out)
    return out


def echo_filters(
    delays: NDArray[np.float64], gains: NDArray[np.complex128]
) -> NDArray[np.complex64]:
    """FIR filters `[n, n_taps]` of echoes at `delays` in samples `[e]` with `gains` `[n, e]`.

    The filters themselves delay by N_TAPS / 2 − 1 samples.
    """
    echoes = np.zeros((len(delays), int(np.ceil(delays.max())) + N_TAPS), np.float32)
    filters = _filters()
    for echo, delay in zip(echoes, delays, strict=True):
        whole = int(delay)
        phase = round((1 - (delay - whole)) * N_PHASES)
        # A filter looks ahead by its phase from one sample back; reversed, it is an impulse
        # response.
        echo[whole : whole + N_TAPS] = filters[phase][::-1]
    taps: NDArray[np.complex64] = (gains @ echoes).astype(np.complex64)
    return taps
