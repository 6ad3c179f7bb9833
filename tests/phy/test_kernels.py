"""Compares kernels with the reference, or with their formulas where it has no counterpart."""

import importlib
import pkgutil

import numpy as np
import pytest
from numba import njit

from phy import GRIDS, OFDM_64_16, Modulation, kernels, reference
from phy.kernels import detector_sums, lean, lean_more
from phy.reference import detection
from phy.testing import (
    FORGETS,
    HISTORY,
    SampleStream,
    compute,
    mapping,
    new_search_memory,
    preamble,
)
from tests.phy.signals import noise, silence, turned

SEED = 47


def rng():
    return np.random.default_rng(SEED)


def sums(x, dc, n):
    work = np.full((7, HISTORY + n), np.nan, np.float32)
    detector_sums(x, dc, work, n)
    return work[0, :n] + 1j * work[1, :n], work[2, :n].copy()


@pytest.mark.parametrize("n", [1, 5, 192])
@pytest.mark.parametrize("dc", [0j, 0.3 - 0.2j])
def test_the_detectors_sums_are_their_formula(n, dc):
    x = noise(rng(), HISTORY + n)
    x[20 : 20 + 192] += preamble.preamble()[: len(x[20 : 20 + 192])]
    p, e = sums(x, dc, n)
    wanted_p, wanted_e = detection.sums(x, dc)
    assert p == pytest.approx(wanted_p, abs=2e-4)
    assert e == pytest.approx(wanted_e, rel=1e-5)


def test_the_metric_is_1_at_the_last_sample_of_the_short_training_and_nowhere_else():
    x = np.concatenate((silence(HISTORY + 100), turned(preamble.preamble(), 0.02), silence(200)))
    p, e = sums(x, 0j, len(x) - HISTORY)
    metric = np.abs(p) / np.where(e > 0, e, 1)
    assert metric.max() == pytest.approx(1, abs=1e-5)
    peak = int(metric.argmax())
    assert peak == 100 + 191
    assert np.angle(p[peak]) / (2 * np.pi * 16) == pytest.approx(0.02, abs=1e-6)
    away = np.abs(np.arange(len(metric)) - peak) > 16
    assert metric[away].max() < 0.6


def searched(x, threshold=0.25, hop=512, dc=(0.0, 0.0, 0.0, 0.0), excess=0.0, age=0):
    memory = new_search_memory(hop)
    memory.content.state[: len(dc)] = dc
    n_hops = (len(x) - HISTORY) // hop
    found = compute.search(x, n_hops, hop, threshold, excess, age, memory)
    return found, memory.content.state


@pytest.mark.parametrize("lead", [HISTORY, 700, 703, 1500])
def test_search_finds_the_first_sample_over_the_threshold(lead):
    x = 0.1 * noise(rng(), HISTORY + 5 * 512)
    x[lead : lead + 352] += preamble.preamble()
    found, _ = searched(x)
    p, e = sums(x, 0j, len(x) - HISTORY)
    assert found == HISTORY + int(np.argmax(np.abs(p) > 0.25 * e))
    assert lead < found <= lead + 191


def test_a_raised_threshold_sinks_again():
    """A peak of about 0.6 every 2048 samples: the first one above the decayed threshold counts."""
    x = 0.75 * noise(rng(), HISTORY + 10 * 2048)
    for begin in range(300, len(x) - 352, 2048):
        x[begin : begin + 352] += preamble.preamble()
    p, e = sums(x, 0j, len(x) - HISTORY)
    level = 0.25 + 4 * np.exp(-(np.arange(len(p)) // 512 * 512 + 1000) / FORGETS)
    wanted = HISTORY + int(np.argmax(np.abs(p) > level * e))
    found, _ = searched(x, excess=4.0, age=1000)
    assert found == wanted > 4 * 2048


def test_search_finds_nothing_in_noise_and_learns_its_mean():
    x = 0.1 * noise(rng(), HISTORY + 40 * 512) + np.complex64(0.5 - 0.25j)
    found, state = searched(x, threshold=0.5)
    assert found == -1
    # Of the first hop, all was DC.
    assert state[:4] == pytest.approx([0.5, -0.25, 39, 0.01], abs=0.01)


def test_numbers_too_large_or_none_become_0_and_are_counted():
    x = np.array(
        [1, np.nan, 2j, np.inf, complex(0, -np.inf), complex(np.nan, 1), 99, 101, -101j, 1e38],
        np.complex64,
    )
    assert compute.sanitise(x, 100) == 7
    assert list(x) == [1, 0, 2j, 0, 0, 0, 99, 0, 0, 0]


@pytest.mark.parametrize("modulation", Modulation)
@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
@pytest.mark.parametrize("n", [1, 7, 8, 19])
def test_coded_bits_become_the_references_symbols(grid, modulation, n):
    """Interleaved, mapped, with pilots, prefix and clipped peaks."""
    by = mapping(modulation, grid)
    coded = rng().integers(0, 2, n * by.symbol_bits, np.uint8)
    subcarriers = reference.mapping.to_subcarriers(coded, modulation, grid, 7)
    for peak in (np.inf, 1.5):
        wanted = reference.ofdm.to_samples(subcarriers, grid, peak)
        assert by.to_samples(coded, 7, peak) == pytest.approx(wanted, abs=3e-6)


def test_interpolate_is_a_sum_of_its_filters_taps():
    x = noise(rng(), 50)
    filters = rng().standard_normal((9, 4)).astype(np.float32)
    out = np.empty(70, np.complex64)
    compute.interpolate(np.stack((x.real, x.imag)), filters, -3.3, 0.9, out)
    padded = np.concatenate((silence(20), x, silence(40)))
    for n, got in enumerate(out):
        t = -3.3 + 0.9 * n
        whole = int(np.floor(t))
        taps = filters[int((t - whole) * 8 + 0.5)]
        wanted = sum(taps[k] * padded[20 + whole - 1 + k] for k in range(4))
        assert got == pytest.approx(wanted, abs=1e-5)


def test_a_stream_keeps_what_is_not_forgotten_by_absolute_index():
    """However it is filled and emptied; the model is the whole stream."""
    draws = rng()
    everything = noise(draws, 30_000)
    stream, start, end = SampleStream(1000, 64), 0, 0
    while end < len(everything):
        n = int(draws.integers(0, 300))
        stream.append(everything[end : end + n])
        end = min(end + n, len(everything))
        if draws.random() < 0.5:
            start = max(start, int(draws.integers(start, end + 50)))
            stream.forget_before(1000 + start)
            start = min(start, end)
        assert (stream.start, stream.end) == (1000 + start, 1000 + end)
        assert np.array_equal(stream.view(1000 + start, 1000 + end), everything[start:end])
    stream.restart(-5)
    assert (stream.start, stream.end) == (-5, -5)


@njit
def _lean_more(slope, numbers, turns):
    lean_more(slope, numbers, turns)


@pytest.mark.parametrize("slope", [0.0, 0.003, -0.0031])
def test_leaning_more_adds_up(slope):
    """A hundred small steps are one large one."""
    numbers = np.zeros(56, np.float32)
    subcarriers = OFDM_64_16.used[OFDM_64_16.tones]
    numbers[:52] = subcarriers
    turns, at_once = np.zeros((2, 2, 56), np.float32)
    lean(0.2, subcarriers, turns)
    for _ in range(100):
        _lean_more(slope, numbers, turns)
    lean(0.2 + 100 * slope, subcarriers, at_once)
    wanted = reference.smoothing.centred(np.ones(52), -0.2 - 100 * slope, OFDM_64_16)
    made = at_once[0, :52] + 1j * at_once[1, :52]
    assert made == pytest.approx(wanted[OFDM_64_16.tones], abs=1e-6)
    assert turns[:, :52] == pytest.approx(at_once[:, :52], abs=2e-5)


def test_no_kernel_raises_when_it_divides_by_0():
    """In a library, an exception ends the process."""
    names = [each.name for each in pkgutil.iter_modules(kernels.__path__, "phy.kernels.")]
    found = [each for name in names for each in vars(importlib.import_module(name)).values()]
    compiled = [each for each in found if hasattr(each, "targetoptions")]
    assert len(compiled) > 100
    raising = [each for each in compiled if each.targetoptions.get("error_model") != "numpy"]
    assert [each.__name__ for each in raising] == []
