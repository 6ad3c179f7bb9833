"""The search skips hops with the power of noise: what that costs, and how it follows the noise."""

import math

import numpy as np
import pytest

from phy import Receiver, Transmitter
from phy.reference import detection
from phy.testing import DC_IMAG, DC_REAL, FLOOR, HISTORY, compute, new_search_memory, preamble
from tests.phy.signals import heard, noise, silence

HOP = 512
SEED = 83


class Search:
    """The kernel on one stream after another, with the state that it keeps."""

    def __init__(self, floor=0.0):
        self._memory = new_search_memory(HOP)
        self.state = self._memory.content.state
        self.state[FLOOR] = floor

    def __call__(self, x, threshold=0.25):
        n_hops = (len(x) - HISTORY) // HOP
        return compute.search(x, n_hops, HOP, threshold, 0.0, 0, self._memory)


def hops(rng, n, power=1.0):
    return noise(rng, HISTORY + n * HOP, power)


@pytest.mark.parametrize(("snr_db", "kept"), [(0, 1.0), (-2, 0.995)])
def test_the_gate_keeps_the_bursts_that_an_open_search_finds(snr_db, kept):
    rng = np.random.default_rng(SEED)
    found = open_found = 0
    for _ in range(400):
        x = hops(rng, 4)
        at = HISTORY + HOP + int(rng.integers(HOP))
        x[at : at + 352] += preamble.preamble() * np.float32(10 ** (snr_db / 20))
        # A burst goes on after its preamble.
        x[at + 352 :] += noise(rng, len(x) - at - 352, 10 ** (snr_db / 10))
        if at < Search(floor=1e-9)(x) <= at + 352:
            open_found += 1
            found += at < Search(floor=1.0)(x) <= at + 352
    assert open_found > 300
    assert found >= kept * open_found


def test_almost_no_noise_is_searched():
    rng, gated = np.random.default_rng(SEED), Search()
    gated(hops(rng, 200), threshold=1.0)
    n_searched = 0
    for _ in range(1800):
        before = gated.state.copy()
        # In a hop that is searched, all noise crosses this threshold.
        n_searched += gated(x := hops(rng, 1), threshold=1e-3) >= 0
        gated.state[:] = before
        gated(x, threshold=1.0)
    assert 0 < n_searched < 0.06 * 1800


@pytest.mark.parametrize("factor", [0.01, 0.7, 1.4, 30.0])
def test_the_floor_follows_the_noise_to_another_level(factor):
    rng, gated = np.random.default_rng(SEED), Search()
    gated(hops(rng, 100, 0.04), threshold=1.0)
    assert gated.state[FLOOR] == pytest.approx(0.04, rel=0.05)
    # Above the floor, it doubles in 4096 hops.
    n = 400 + int(4096 * max(0.0, math.log2(factor)))
    gated(hops(rng, n, 0.04 * factor), threshold=1.0)
    assert gated.state[FLOOR] == pytest.approx(0.04 * factor, rel=0.05)


def test_a_level_of_the_receiver_is_no_power():
    rng, gated = np.random.default_rng(SEED), Search()
    gated(hops(rng, 300, 1e-4) + np.complex64(0.3 - 0.4j))
    assert complex(gated.state[DC_REAL], gated.state[DC_IMAG]) == pytest.approx(
        0.3 - 0.4j, abs=1e-3
    )
    assert gated.state[FLOOR] == pytest.approx(1e-4, rel=0.05)


@pytest.mark.parametrize("lead", [0, 100, 511, 5000])
def test_bursts_in_silence_are_found(lead):
    """There is no noise that they could stand out from."""
    burst = Transmitter().modulate([b"in silence"], 0)
    receiver = Receiver()
    events = []
    for _ in range(3):
        events += receiver.push(np.concatenate((silence(lead), burst, silence(3000))))
    assert heard(events + receiver.flush()) == [b"in silence"] * 3


def test_the_reference_opens_for_the_same_hops_and_knows_the_same_noise():
    rng, gated, plain = np.random.default_rng(SEED), Search(), detection.Detector(0)
    x = hops(rng, 600, 1.0)
    levels = np.repeat([1.0, 1.1, 0.3, 0.0, 2.0, 1.5], 100 * HOP)
    x[HISTORY:] *= levels.astype(np.float32)
    for at in range(0, 600 * HOP, HOP):
        part = x[at : at + HISTORY + HOP]
        assert (gated(part) < 0) == (plain.crossing(part, at) is None)
        assert gated.state[FLOOR] == pytest.approx(plain.noise, rel=1e-4)
