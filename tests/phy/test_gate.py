"""The search skips hops with the power of noise: what that costs, and how it learns that power."""

import numpy as np
import pytest

from phy import Receiver, Transmitter, reference
from phy.reference import detection
from phy.testing import (
    DC_IMAG,
    DC_REAL,
    FLOOR,
    HISTORY,
    PATIENCE,
    SURE,
    compute,
    new_search_memory,
    preamble,
)
from tests.phy.signals import heard, noise, noisy, payloads, silence

HOP = 512
SEED = 83


class Search:
    """The kernel on one stream after another, with the state that it keeps."""

    def __init__(self, floor=0.0):
        self._memory = new_search_memory(HOP)
        self.state = self._memory.content.state
        self.state[FLOOR] = floor
        self.state[SURE] = PATIENCE if floor else 0

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
    gated(hops(rng, PATIENCE + PATIENCE // 10), threshold=1.0)
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
    # A hop is enough below it; above, each hop is searched until so many were.
    gated(hops(rng, 400 + PATIENCE * (factor > 1), 0.04 * factor), threshold=1.0)
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


def stream(rng, gap, snr_db, n=16):
    """Bursts of 4 PDUs of 220 B, `gap` samples apart; (samples, where they begin, PDUs)."""
    pdus = [payloads(rng, 4, 220) for _ in range(n)]
    bursts = [Transmitter().modulate(each, 1) for each in pdus]
    parts = [part for burst in bursts for part in (burst, silence(gap))]
    begins = np.cumsum([0, *(len(burst) + gap for burst in bursts[:-1])])
    return noisy(rng, np.concatenate(parts), snr_db), begins, pdus


@pytest.mark.parametrize("snr_db", [8, 25])
@pytest.mark.parametrize("gap", [32, 200, 400])
def test_a_receiver_that_begins_within_a_burst_hears_the_next(gap, snr_db):
    """The burst's power was taken for noise; the search closed on it, and never opened."""
    rng = np.random.default_rng(SEED)
    x, begins, pdus = stream(rng, gap, snr_db)
    missed = 0
    for start in rng.integers(0, begins[-3], 12):
        receiver = Receiver()
        got = heard(receiver.push(x[start:]) + receiver.flush())
        first = int(np.searchsorted(begins, start)) + 1
        missed += len([pdu for each in pdus[first:] for pdu in each if pdu not in got])
    assert missed == 0


def test_so_does_the_reference():
    rng = np.random.default_rng(SEED)
    x, _, pdus = stream(rng, 32, 25, n=3)
    receiver = reference.Receiver()
    assert heard(receiver.push(x[1000:]) + receiver.flush()) == [*pdus[1], *pdus[2]]


def test_a_floor_that_bursts_taught_is_unlearned_by_the_first_burst_that_is_read():
    rng = np.random.default_rng(SEED)
    x, _, _ = stream(rng, 32, 10)
    power = float(np.mean(np.abs(x) ** 2))
    memory = new_search_memory(HOP).content
    memory.state[[FLOOR, SURE]] = power, PATIENCE
    memory.heard(power)
    assert memory.state[SURE] == PATIENCE
    receiver = Receiver()
    (quality, *_) = [event.burst for event in receiver.push(x)]
    memory.heard(quality.noise)
    assert memory.state[SURE] == 0


@pytest.mark.parametrize("level", [4, 100, 1e6])
def test_what_a_strong_signal_taught_is_forgotten_in_the_first_hop_without_it(level):
    """Weak bursts directly behind it are heard, as are those beside it."""
    rng = np.random.default_rng(SEED)
    receiver = Receiver()
    receiver.push(noise(rng, PATIENCE * HOP, 0.01))
    receiver.push(noise(rng, 2 * PATIENCE * HOP, level))
    burst = Transmitter().modulate([b"soon after"], 0)
    x = np.concatenate((silence(HOP), burst, silence(3000))) + noise(rng, len(burst) + 3512, 0.01)
    assert heard(receiver.push(x.astype(np.complex64))) == [b"soon after"]


@pytest.mark.parametrize("jump", [1.0, 300.0])
def test_a_jump_of_the_dc_is_learned_in_two_hops(jump):
    rng = np.random.default_rng(SEED)
    receiver = Receiver()
    receiver.push(noise(rng, 200 * HOP, 0.01))
    burst = Transmitter().modulate([b"soon after"], 0)
    x = np.concatenate((silence(2 * HOP), burst, silence(3000)))
    x = x + noise(rng, len(x), 0.01) + np.complex64(jump * (0.6 - 0.8j))
    assert heard(receiver.push(x.astype(np.complex64))) == [b"soon after"]


def test_the_end_of_a_stream_teaches_nothing():
    rng = np.random.default_rng(SEED)
    receiver = Receiver()
    receiver.push(noise(rng, 100 * HOP + 100))
    for _ in range(5):
        # Half duplex: the radio does not hear what it sends.
        assert receiver.gap(5000) == []
        receiver.push(noise(rng, 1000 * HOP + 100))
    triggers = receiver.counters["triggers"]
    receiver.push(noise(rng, 10_000 * HOP))
    assert receiver.counters["triggers"] - triggers < 0.06 * 10_000 * HOP * np.exp(-11)


@pytest.mark.parametrize("level", [1e-10, 1e-13, 1e-16, 1e-22])
def test_a_preamble_that_ends_in_almost_nothing_is_aligned(level):
    """The energy's square was 0 in single precision, and the kernel divided by it."""
    x = np.full(HISTORY + HOP, level, np.complex64)
    x[HISTORY : HISTORY + 200] += preamble.preamble()[:200]
    offset, _, plain = compute.strongest(x, HOP, new_search_memory(HOP))
    assert abs(offset - 191) < 4
    assert plain < 0.7


@pytest.mark.parametrize("is_sure", [False, True])
def test_the_reference_opens_for_the_same_hops_and_knows_the_same_noise(is_sure):
    rng, gated, plain = np.random.default_rng(SEED), Search(), detection.Detector(0)
    x = hops(rng, 600, 1.0)
    levels = np.repeat([1.0, 1.1, 0.3, 0.0, 2.0, 1.5], 100 * HOP)
    x[HISTORY:] *= levels.astype(np.float32)
    if is_sure:
        x = np.concatenate((hops(rng, PATIENCE), x[HISTORY:]))
    for at in range(0, len(x) - HISTORY, HOP):
        part = x[at : at + HISTORY + HOP]
        assert (gated(part) < 0) == (plain.crossing(part, at) is None)
        assert gated.state[FLOOR] == pytest.approx(plain.noise, rel=1e-4)
