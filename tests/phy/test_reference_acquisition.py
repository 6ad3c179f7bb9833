"""Compares the kernels that find a burst and read its header with the reference."""

import numpy as np
import pytest

from phy import GRIDS, Transmitter, kernels, reference
from phy.reference import detection, timing
from phy.testing import (
    PHASE,
    Acquisition,
    BurstHeader,
    Missed,
    checked_header,
    compute,
    header_bits,
    new_search_memory,
    parse_header,
    preamble,
)
from tests.phy.channels import assert_same
from tests.phy.signals import noise, silence, turned

SEED = 79

every_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)


def rng(more=0):
    return np.random.default_rng(SEED + more)


def planes_of(x):
    return np.stack((x.real, x.imag)).astype(np.float32)


def searched(x, at, excess=0.0, dc=0j, n_seen=0):
    """(index of the first crossing or None, DC, hops seen) by the kernel, hop by hop."""
    memory = new_search_memory(512)
    memory.content.state[:4] = dc.real, dc.imag, n_seen, 0.0
    n_hops = (len(x) - 191) // 512
    found = compute.search(x, n_hops, 512, detection.THRESHOLD, excess, 0, memory)
    return (at - 191 + found if found >= 0 else None), memory.content.dc


@pytest.mark.parametrize("alarms", [0, 2])
@pytest.mark.parametrize("snr_db", [-3, 3, 20])
def test_the_search_crosses_at_the_same_sample(snr_db, alarms):
    for lead in (300, 1100, 2047):
        draws = rng(lead)
        x = noise(draws, 191 + 8 * 512, 10 ** (-snr_db / 10)) + np.complex64(0.1 - 0.05j)
        x[191 + lead :][:352] += preamble.preamble()
        detector, at, crossed = detection.Detector(0), 0, None
        for _ in range(alarms):
            detector.was_nothing(0)
        while crossed is None and at < 8 * 512:
            crossed, at = detector.crossing(x[at : at + 191 + 512], at), at + 512
        found, dc = searched(x, 0, min(alarms * detection.WARIER, 0.25))
        assert found == crossed
        assert dc == pytest.approx(detector.dc, abs=1e-6)
        assert crossed is not None or snr_db < 0


@pytest.mark.parametrize("kind", ["preamble", "noise", "level", "silence"])
def test_the_peak_and_its_frequency_are_the_same(kind):
    draws = rng()
    x = {
        "preamble": np.concatenate((silence(150), turned(preamble.preamble(), 0.0213))),
        "level": np.ones(600, np.complex64) * np.complex64(3 + 1j),
    }.get(kind, silence(600))[: 191 + 192]
    if kind != "silence":
        x = x + noise(draws, len(x), 0.05)
    best, p, plain = compute.strongest(x, 192, new_search_memory(192))
    where, frequency = detection.Detector(0).strongest(x)
    assert where == best
    assert (frequency is None) == (plain > detection.PLAINEST)
    assert frequency is not None or kind != "preamble"
    if frequency is not None:
        assert frequency == pytest.approx(np.angle(p) / (2 * np.pi * 16), abs=1e-5)


@every_grid
@pytest.mark.parametrize("max_frequency", [0.02, 0.1])
def test_the_long_training_is_located_at_the_same_sample(grid, max_frequency):
    shifted = timing.templates(grid, max_frequency)
    n_found = 0
    for seed in range(20):
        draws = rng(seed)
        reach = len(shifted) // 2
        frequency = draws.integers(-reach, reach + 1) / 16 + draws.uniform(-1e-3, 1e-3)
        span = 2 * timing.SEARCH + 2 * grid.n_fft
        x = noise(draws, span, 10 ** draws.uniform(-3, 0.5))
        if seed % 4:
            at = int(draws.integers(0, 2 * timing.SEARCH))
            for delay, gain in ((0, 0.5), (3, 0.8j), (9, 0.3)):
                sent = gain * turned(np.tile(preamble.long_symbol(grid), 2), frequency)
                x[at + delay :][: len(sent)] += sent[: max(0, span - at - delay)]
        early, told = kernels.locate(planes_of(x), shifted.astype(np.complex64))
        found = timing.locate(x.astype(np.complex128), shifted)
        assert (early < 0) == (found is None)
        if found is not None:
            n_found += 1
            assert early == found[0]
            assert told == pytest.approx(found[1], abs=1e-6)
    assert 6 <= n_found < 20


@every_grid
@pytest.mark.parametrize("centre_cycles", [0.0, 500.0])
def test_a_burst_is_acquired_alike(grid, centre_cycles):
    """Start, offset, header, quality, and the channel at the start of the payload.

    With an echo, so that what the offset is told from is no copy of what was sent.
    """
    ours = Acquisition(grid, 0.1, centre_cycles)
    other = reference.acquisition.Acquisition(grid, 0.1, centre_cycles)
    n_read = n_missed = 0
    for seed in range(10):
        draws = rng(seed)
        burst = Transmitter(grid=grid).modulate([draws.bytes(20)], 3)
        x = np.concatenate((silence(24 + int(draws.integers(-9, 9))), burst))
        x = np.convolve(x, [1, 0, 0.5j, -0.2])
        x = turned(x, draws.uniform(-0.01, 0.01) + (seed % 3 - 1) / 16)
        x = (x + noise(draws, len(x), 10 ** (-draws.uniform(-8, 25) / 10))).astype(np.complex64)
        coarse = draws.uniform(-0.002, 0.002)
        found, made = (each.acquire(x, 1000, coarse, 0.01j) for each in (ours, other))
        assert type(found).__name__ == type(made).__name__
        if isinstance(found, Missed):
            n_missed += 1
            assert made == tuple(found)
            continue
        n_read += 1
        assert (made.header, made.origin, made.window) == (found.header, found.origin, found.window)
        assert made.frequency == pytest.approx(found.frequency, abs=1e-7)
        assert made.quality[:5] == found.quality[:5]
        assert made.quality[5:7] == pytest.approx(found.quality[5:7], abs=0.02)
        assert_same(found.channel.content, made.equaliser.channel, grid, 2e-3)
        tracked = found.channel.content.tracking
        assert made.equaliser.tracking.phase.value == pytest.approx(tracked[PHASE, 0], abs=1e-3)
    assert n_read >= 4
    assert n_missed >= 1


@pytest.mark.slow
def test_headers_repetitions_are_folded_and_read_alike():
    """From clean to hopeless; many can only be read with the list."""
    n_listed = n_read = 0
    for seed in range(120):
        draws = rng(seed)
        told = BurstHeader(*(int(draws.integers(1, most)) for most in (10, 64, 2048, 8)))
        coded = header_bits(told, 96)
        llr = 8 * (1 - 2.0 * coded) + draws.normal(0, draws.uniform(1, 16), 96)
        llr = np.clip(8 * llr, -511, 511).astype(np.int16)
        at_once = np.empty(76, np.int16)
        kernels.fold(llr, at_once)
        assert np.array_equal(reference.header.folded(llr), at_once)
        likeliest = np.empty(4, np.uint8)
        kernels.decode_block(at_once, np.empty(38, np.uint64), likeliest)
        expected = parse_header(likeliest, at_once)
        assert reference.header.parse_header(at_once) == expected
        n_read += expected is not None
        n_listed += expected is not None and checked_header(likeliest.tobytes()) is None
    assert 20 < n_read < 120
    assert n_listed > 2
