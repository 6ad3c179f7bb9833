"""Every grid can carry bursts, and its tables are consistent."""

import numpy as np
import pytest

from phy import GRIDS, MCS_TABLE, Path, PathParams, Receiver, Transmitter, layout
from phy.testing import preamble
from tests.phy.signals import heard, noisy, payloads, silence, turned

SEED = 59

every_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)


@every_grid
@pytest.mark.parametrize("mcs", [each.index for each in MCS_TABLE])
def test_bursts_of_every_mcs_are_heard(grid, mcs):
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 150)
    burst = Transmitter(grid=grid).modulate(pdus, mcs)
    assert len(burst) == layout(grid, mcs, 3, 150).n_samples
    parts = [silence(500), turned(burst, 0.011), silence(300), turned(burst, -0.009)]
    receiver = Receiver(grid=grid)
    events = receiver.push(noisy(rng, np.concatenate(parts), 32)) + receiver.flush()
    assert heard(events) == 2 * pdus
    assert events[0].burst.cfo == pytest.approx(0.011, abs=1e-4)
    assert events[0].burst.snr_db == pytest.approx(32, abs=2)


@every_grid
def test_bursts_through_echoes_as_long_as_the_prefix_allows(grid):
    """The last echo comes within the prefix, less the windows' backoff and timing errors."""
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 4, 100)
    burst = Transmitter(grid=grid).modulate(pdus, 1)
    echoes = np.zeros(grid.n_cp - 4, np.complex64)
    echoes[[0, len(echoes) // 2, -1]] = 0.8, 0.5j, 0.4
    x = np.convolve(np.concatenate((silence(500), burst)), echoes)
    receiver = Receiver(grid=grid)
    assert heard(receiver.push(noisy(rng, x, 20)) + receiver.flush()) == pdus


@every_grid
def test_bursts_below_the_noise_are_heard(grid):
    rng = np.random.default_rng(SEED)
    receiver, sent, events = Receiver(grid=grid), [], []
    for _ in range(40):
        sent += payloads(rng, 1, 100)
        burst = turned(Transmitter(grid=grid).modulate(sent[-1:], 0), rng.uniform(-0.02, 0.02))
        events += receiver.push(noisy(rng, np.concatenate((silence(400), burst)), -0.5))
    assert len(heard(events + receiver.flush())) >= 38


@every_grid
def test_a_clock_40_ppm_off_is_followed_through_a_long_burst(grid):
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 20, 1000)
    params = PathParams(rate_hz=5e6, centre_hz=5e8, clock_ppm=40)
    _, x = Path(params, rng).carry(Transmitter(grid=grid).modulate(pdus, 1))
    receiver = Receiver(grid=grid)
    x = noisy(rng, np.concatenate((silence(400), x)), 12)
    assert heard(receiver.push(x) + receiver.flush()) == pdus


@every_grid
def test_training_is_of_magnitude_1_and_low_peaks(grid):
    assert np.abs(preamble.long_subcarriers(grid)) == pytest.approx(1)
    assert len(preamble.preamble(grid)) == preamble.length(grid)
    long = preamble.long_symbol(grid)
    assert np.mean(np.abs(long) ** 2) == pytest.approx(1, rel=1e-5)
    assert np.abs(long).max() ** 2 < 10**0.55
    # The search uses the same short training for all grids.
    short = preamble.preamble()[: preamble.SHORT]
    assert preamble.preamble(grid)[: preamble.SHORT] == pytest.approx(short, abs=1e-6)
