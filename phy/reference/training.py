"""Training: symbols known to the receiver, which give the gain of every subcarrier."""

import numpy as np
from numpy.typing import NDArray

from phy.numerology import Numerology
from phy.reference.channel import Channel
from phy.reference.ofdm import Subcarriers
from phy.reference.smoothing import mean_delay, smooth

SURELY = 4.0
"""Number of standard deviations from which a difference in strength is not chance."""
LARGEST_BOOST = 3.0


FILLS = 8
"""Steps in which the gains of subcarriers that were cut are found."""
NEXT = 4
"""They begin with the mean of the gains that are at most so much farther than the nearest."""


def least_squares(
    y: Subcarriers, sent: Subcarriers, amplitude: NDArray[np.float64]
) -> tuple[Subcarriers, float]:
    """Estimate (gains `[n_used]`, noise power on a subcarrier) from symbols `[n, n_used]`, n ≥ 2.

        Ĥ_k = Σ_s a_s Y_sk/X_sk / Σ_s a_s²;  N = mean_k Σ_s |Y_sk/X_sk − a_s Ĥ_k|² / (n − 1)

    Symbol s was `sent` a_s times as strong. |X| is 1 or close to it: Y/X is Y X*. Symbols with
    a_s = 0 and Y_s = 0 do not count.
    """
    ratio, a = y / sent, amplitude[:, None]
    h = np.sum(a * ratio, axis=0) / np.sum(amplitude**2)
    noise = np.sum(np.abs(ratio - a * h) ** 2) / (np.sum(amplitude > 0) - 1)
    return h, float(noise / y.shape[1])


def estimate(
    y: Subcarriers, sent: Subcarriers, amplitude: NDArray[np.float64], grid: Numerology,
    kept: NDArray[np.float32] | None = None,
) -> Channel:  # fmt: skip
    """Estimate the channel from known symbols by least squares, without the probable noise.

    The noise of a gain is v = N / Σ_s a_s². Subcarriers with 0 in `kept` `[n_used]` are not known:
    they get those next to them, with the mean delay, and then the gains that the smoother expects,
    again and again (expectation maximisation).
    """
    is_kept = np.ones(grid.n_used, bool) if kept is None else kept > 0
    h, no = least_squares(np.where(is_kept, y, 0), sent, amplitude)
    share = max(1, int(is_kept.sum())) / grid.n_used
    no = max(no / share, 1e-20)
    power, v = float(np.mean(np.abs(h) ** 2)) / share, no / float(np.sum(amplitude**2))
    channel = Channel(h, no, max(power - v, 1e-3 * power, 1e-20))
    if is_kept.any() and not is_kept.all():
        delay, used = mean_delay(h, grid), grid.used[is_kept]
        for k in np.flatnonzero(~is_kept):
            apart = grid.used[k] - used
            near = np.abs(apart) < np.abs(apart).min() + NEXT
            h[k] = np.mean(h[is_kept][near] * np.exp(1j * delay * apart[near]))
        for _ in range(FILLS):
            smooth(h, v, channel, grid)
            h = np.where(is_kept, h, channel.h)
    smooth(h, v, channel, grid)
    return channel


def learn(
    y: Subcarriers, sent: Subcarriers, n_training: int, rotation: NDArray[np.float64],
    before: Channel, grid: Numerology, kept: NDArray[np.float32] | None = None,
    whole: NDArray[np.float32] | None = None,
) -> Channel:  # fmt: skip
    """Estimate the channel again, with the decoded header as further training.

        strength = Σ|Ĥ|² / Re Σ (Y/X) Ĥ*, over the header

    The first `n_training` symbols of `y` and `sent` `[n, n_used]` are the preamble's; the others
    have turned by `rotation` radians `[n − n_training]`. The preamble may have been sent stronger
    than the rest by `strength`, which counts as 1 if it differs from 1 only by chance, or if
    samples of the training were blanked. Symbols are left out of which only a share is `whole`
    `[n]`, unless fewer than two others are left.
    """
    weights = np.ones(grid.n_used, np.float32) if kept is None else kept
    is_whole = np.ones(len(y), bool) if whole is None else whole == 1
    y = y.copy()
    y[n_training:] *= np.exp(-1j * rotation)[:, None]
    ratio = (weights * y / sent)[n_training:][is_whole[n_training:]]
    seen = float(np.sum((ratio * before.h.conj()).real))
    expected = float(np.sum(weights * np.abs(before.h) ** 2)) * len(ratio)
    amplitude = np.ones(len(y))
    if seen > 0 and is_whole[:n_training].all():
        # The gains may have been scaled to the header.
        strength = expected / seen / before.scaled
        if abs(1 / strength - 1) > SURELY * np.sqrt(0.5 * before.no / expected):
            amplitude[:n_training] = np.clip(strength, 1 / LARGEST_BOOST, LARGEST_BOOST)
    if is_whole.sum() >= 2:
        y[~is_whole] = amplitude[~is_whole] = 0
    return estimate(y, sent, amplitude, grid, kept)
