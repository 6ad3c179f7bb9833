"""Channels in the form of the kernels and of the reference, to compare the two."""

import numpy as np
import pytest

from phy.kernels import estimate
from phy.reference import training
from phy.testing import DRIFT, in_planes, new_channel, new_scratch, tones
from tests.phy.signals import noise


def gains_of(channel, grid):
    """A kernel's gains in the order of `grid.used`."""
    h = np.empty(grid.n_used, np.complex128)
    h[grid.tones] = (channel.h[0] + 1j * channel.h[1])[: grid.n_used]
    return h


def in_tones(y, grid):
    """Symbols `[n, n_used]` in the kernels' form."""
    return in_planes(y[:, grid.tones].astype(np.complex64))


def echoed(draws, grid, n_echoes=3):
    """Gains of a channel with several echoes, of mean power about 1."""
    delays = draws.uniform(0, grid.n_cp / 2, n_echoes)
    gains = noise(draws, n_echoes, 1 / n_echoes)
    return np.exp(-2j * np.pi * grid.used[:, None] * delays / grid.n_fft) @ gains


def assert_same(channel, other, grid, error=2e-4):
    """Assert that a kernel's channel equals the reference's."""
    power = other.gain + other.no
    assert gains_of(channel, grid) == pytest.approx(other.h, abs=error * np.sqrt(power))
    assert channel.no == pytest.approx(other.no, rel=2e-3)
    assert channel.gain == pytest.approx(other.gain, rel=2e-3, abs=1e-6 * power)
    assert channel.figures[DRIFT] == pytest.approx(other.drift, rel=0.02, abs=1e-5)
    assert channel.unknown == pytest.approx(other.unknown, rel=0.02, abs=0.01 * other.no)
    assert channel.power == pytest.approx(other.power, rel=0.01, abs=1e-3 * power)


def trained(draws, grid, no, n=2, amplitude=None):
    """(received symbols, sent symbols, gains) of `n` symbols of ±1."""
    sent = draws.choice([-1.0, 1.0], (n, grid.n_used)).astype(np.complex64)
    h = echoed(draws, grid)
    y = (np.ones(n) if amplitude is None else amplitude)[:, None] * h * sent
    return y + noise(draws, n * grid.n_used, no).reshape(n, -1), sent, h


def both_estimates(grid, y, sent):
    """Estimates from known symbols: (the kernel's channel, its argument block, the reference's)."""
    block, scratch = new_channel(grid), new_scratch(grid)
    table, n = tones(grid).content, len(sent)
    known = in_tones(sent, grid), np.ones(n, np.float32)
    estimate(in_tones(y, grid), known[1], known[0], table, block.content, scratch.content)
    return block, training.estimate(y, sent, np.ones(n), grid)
