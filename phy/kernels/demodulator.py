"""The demodulator's kernels as the interpreter calls them: with argument blocks."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.equaliser import equalise, start_tracking, use_slope
from phy.kernels.fft import circle, eight_windows, windows_to_tones
from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, splat, total
from phy.kernels.local import local
from phy.kernels.openers import open_axes, open_channel, open_scratch, open_tones
from phy.kernels.training import estimate
from phy.sizes import N_LANES
from phy.tables.block import PackedArguments
from phy.tables.burst import GAIN, NO, SLOPE, SLOPE_USED, Channel, Tones


@njit(nogil=True, cache=True, error_model="numpy")
def demodulate(
    samples: NDArray[np.complex64],
    n: int,
    frequency: float,
    dc: complex,
    origin: int,
    number: int,
    tones_in: PackedArguments,
    axes_in: PackedArguments,
    channel_in: PackedArguments,
    scratch_in: PackedArguments,
    points: NDArray[np.complex64],
    llr: NDArray[np.int16],
    powers: NDArray[np.float32],
    hidden: NDArray[np.float64],
) -> float:
    """Write the LLRs of `n` symbols, the first of whose FFT windows begins at `samples[0]`.

    `powers` `[≥ n]` gets each symbol's mean power on a tone; the largest is returned. `hidden`
    `[≥ n]` gets the bits on a tone that interference hid, of all symbols up to each. For the other
    arguments see `windows_to_tones` and `equalise`.
    """
    tones, axes = open_tones(tones_in), open_axes(axes_in)
    channel, scratch = open_channel(channel_in), open_scratch(scratch_in)
    starts, width, y = scratch.starts, scratch.y.shape[2], scratch.y
    circle(-frequency, tones.gain, scratch.turn)
    loudest = hid = 0.0
    snr = channel.figures[GAIN] / channel.figures[NO] * tones.bins.size / tones.n_fft
    full = math.log(1 + snr)
    for row in range(0, n, N_LANES):
        rows = min(n - row, N_LANES)
        for i in range(rows):
            starts[i] = (row + i) * tones.n_symbol
        eight_windows(samples, starts, rows, frequency, dc, origin, tones, scratch, y)
        for i in range(rows):
            power: Lanes = splat(0)
            for k in range(2 * width * i, 2 * width * (i + 1), N_LANES):
                power = power + load(y, k) * load(y, k)
            powers[row + i] = total(power) / tones.bins.size
            loudest = max(loudest, float(powers[row + i]))
        equalise(y, rows, number + row, tones, axes, channel, scratch, points, llr, row)
        for i in range(row, row + rows):
            hid += _hidden(snr, full, i % channel.trust.size, tones, channel)
            hidden[i] = hid
    return loudest


@step
def _hidden(snr: float, full: float, place: int, tones: Tones, channel: Channel) -> float:
    """Bits on a tone that could not be sent in a symbol, but could without interference.

    `full` is log(1 + snr).
    """
    trust, kept, cut = channel.trust[place], channel.kept[place], splat(0)
    for k in range(0, kept.size, N_LANES):
        cut = cut + (splat(1) - load(kept, k))
    share = 1 - total(cut) / tones.bins.size
    if trust == 1 and share == 1:
        return 0.0
    return float(full - share * math.log(1 + snr * trust)) / math.log(2.0)


@njit(nogil=True, cache=True, error_model="numpy")
def to_tones(
    samples: NDArray[np.complex64],
    starts: NDArray[np.int64],
    frequency: float,
    dc: complex,
    origin: int,
    tones_in: PackedArguments,
    scratch_in: PackedArguments,
    out: NDArray[np.float32],
) -> None:
    """Run `windows_to_tones` with tables and working memory from argument blocks."""
    tones, scratch = open_tones(tones_in), open_scratch(scratch_in)
    windows_to_tones(samples, starts, frequency, dc, origin, tones, scratch, out)


@njit(nogil=True, cache=True, error_model="numpy")
def slip(early: int, tones_in: PackedArguments, channel_in: PackedArguments) -> None:
    """Move FFT windows `early` samples earlier, and adapt the slope over subcarriers."""
    tones, channel = open_tones(tones_in), open_channel(channel_in)
    lean = early * 2 * math.pi / tones.n_fft
    channel.tracking[SLOPE, 0] -= lean
    use_slope(channel.figures[SLOPE_USED] - lean, tones, channel)


@njit(nogil=True, cache=True, error_model="numpy")
def learn_channel(
    y: NDArray[np.float32],
    sent: NDArray[np.float32],
    tones_in: PackedArguments,
    channel_in: PackedArguments,
    scratch_in: PackedArguments,
) -> None:
    """Estimate the channel from known symbols, as `estimate` does, and start to track it."""
    tones, channel = open_tones(tones_in), open_channel(channel_in)
    amplitude = local(np.float32, sent.shape[0])
    amplitude[:] = 1
    estimate(y, amplitude, sent, tones, channel, open_scratch(scratch_in))
    start_tracking(tones, channel, 0.0, False)
