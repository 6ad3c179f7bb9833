"""The reference receiver hears what the modem's hears, with noise, offsets, echoes and gaps.

Each modulation, each code rate and each grid is heard once, not each with every other: the stages
that tell them apart are compared one by one in the other `test_reference_` modules.
"""

import inspect

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import (
    GRIDS,
    OFDM_64_16,
    BurstOver,
    FrontEnd,
    FrontEndParams,
    Modulation,
    Path,
    PathParams,
    PduHeard,
    Receiver,
    Transmitter,
    layout,
    needed_snr_db,
    points,
    reference,
)
from tests.laws import law, often
from tests.phy.chunks import chunk_sizes, make_stream, push_all
from tests.phy.foreign import FOREIGN
from tests.phy.signals import endings, heard, noise, noisy, payloads, silence, turned

pytestmark = pytest.mark.slow  # together; each is quick

SEED = 73
# The error of a start that the modem's own tests allow.
START = 1.01

# Every modulation and every code rate.
SOME_MCS = [0, 2, 4, 5, 9]


def listen(kind, x, **settings):
    """(events, counters) of a new receiver for all of `x`."""
    receiver = kind(**settings)
    return receiver.push(x) + receiver.flush(), receiver.counters


def overs(events):
    """The qualities of the bursts among `events`."""
    return [event.burst for event in events if isinstance(event, BurstOver)]


def agree(x, **settings):
    """Assert that both receivers agree on `x`; returns the reference's events."""
    ours, counted = listen(Receiver, x, **settings)
    other, counters = listen(reference.Receiver, x, **settings)
    assert [told(event) for event in other] == [told(event) for event in ours]
    # Windows slip when the slope has reached a sample, which need not be in the same symbol.
    for mine, its in zip(ours, other, strict=True):
        if isinstance(mine, PduHeard):
            assert abs(its.at - mine.at) <= 1
            # Below a quarter of a bit, nothing counts as hidden: 0.75 dB.
            assert its.snr_db == pytest.approx(mine.snr_db, abs=0.8)
    assert counters == counted
    for mine, its in zip(overs(ours), overs(other), strict=True):
        assert its.start == mine.start
        assert its[1:5] == mine[1:5]
        assert its.snr_db == pytest.approx(mine.snr_db, abs=0.05)
        assert its.rssi_dbfs == pytest.approx(mine.rssi_dbfs, abs=0.01)
        # The equaliser's kernel lets the slope lag by 0.01 rad at the outermost subcarriers.
        assert its.evm_db == pytest.approx(mine.evm_db, abs=0.5)
        assert its.cfo == pytest.approx(mine.cfo, abs=1e-6)
    return other


def told(event):
    """The parts of an event that must be equal."""
    if isinstance(event, PduHeard):
        return event.data, event.number
    return event.n_good, event.ending


@pytest.mark.parametrize("mcs", SOME_MCS)
def test_bursts_somewhat_above_threshold_are_heard_by_both(mcs):
    """Five bursts, each with its own offset, 2 dB above the SNR at which 1 % is lost."""
    rng = np.random.default_rng(SEED + mcs)
    snr_db = needed_snr_db(mcs, 60) + 2
    parts, sent, starts, offsets, at = [], [], [], [], 0
    for _ in range(5):
        pause = silence(int(rng.integers(200, 900)))
        sent.append(payloads(rng, int(rng.integers(1, 5)), 60))
        offsets.append(rng.uniform(-0.02, 0.02))
        burst = Transmitter().modulate(sent[-1], mcs)
        parts += [pause, turned(burst, offsets[-1], rng.random())]
        starts.append(at + len(pause))
        at = starts[-1] + len(burst)
    events = agree(noisy(rng, np.concatenate(parts), snr_db))
    assert heard(events) == [pdu for pdus in sent for pdu in pdus]
    assert endings(events) == ["whole"] * 5
    for quality, start, offset in zip(overs(events), starts, offsets, strict=True):
        assert quality.start == pytest.approx(start, abs=START)
        assert quality.snr_db == pytest.approx(snr_db, abs=2)
        assert quality.cfo == pytest.approx(offset, abs=1e-3)


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_every_grid_is_heard_by_both(grid):
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 150)
    burst = reference.Transmitter(grid=grid).modulate(pdus, 5)
    x = np.concatenate((silence(500), turned(burst, 0.011), silence(99), turned(burst, -0.009)))
    events = agree(noisy(rng, x, 25), grid=grid)
    assert heard(events) == 2 * pdus


@pytest.mark.parametrize(
    ("grid", "profile", "rate_hz", "doppler_hz"),
    [
        ("64/16", "tdl-c", 5e6, 300.0),
        ("64/8", "tdl-a", 10e6, 0.0),
        ("128/16", "tdl-c", 5e6, 0.0),
        ("256/32", "tdl-c", 5e6, 300.0),
    ],
)
def test_echoes_change_nothing_between_them(grid, profile, rate_hz, doppler_hz):
    """Eight bursts, each through another channel; a deep fade loses the burst for both."""
    grid, n_heard = GRIDS[grid], 0
    transmitter = reference.Transmitter(grid=grid)
    for seed in range(8):
        rng = np.random.default_rng(seed)
        pdus = payloads(rng, 2, 100)
        params = PathParams(
            rate_hz, 2.4e9, profile, clock_ppm=rng.uniform(-20, 20), doppler_hz=doppler_hz
        )
        _, x = Path(params, rng).carry(transmitter.modulate(pdus, 2))
        x = FrontEnd(FrontEndParams(noise_dbfs=-22), rng).receive(
            np.concatenate((silence(600), x, silence(300)))
        )
        n_heard += heard(agree(x, grid=grid)) == pdus
    assert n_heard >= 6


@pytest.mark.parametrize(("ppm", "centre_cycles"), [(-40, 100.0), (40, 0.0)])
def test_windows_slip_along_with_the_senders_clock(ppm, centre_cycles):
    """Over 74 000 samples, the clocks drift apart by 3 samples."""
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 4, 2047)
    burst = Transmitter().modulate(pdus, 1)
    assert len(burst) * 40e-6 > 2
    params = PathParams(1e6, 1e6 * centre_cycles, clock_ppm=ppm)
    _, x = Path(params, rng).carry(burst)
    x = noisy(rng, np.concatenate((silence(400), x, silence(400))), 15)
    assert heard(agree(x, centre_cycles=centre_cycles)) == pdus


def test_a_stronger_preamble_is_found_out_about_by_both():
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 100)
    burst = reference.Transmitter(preamble_boost_db=3.0).modulate(pdus, 6)
    events = agree(noisy(rng, np.concatenate((silence(500), burst)), 24))
    assert heard(events) == pdus
    assert overs(events)[0].snr_db == pytest.approx(24, abs=1.5)


@pytest.mark.parametrize("max_frequency", [0.0, 0.3])
def test_wide_searches_find_the_same(max_frequency):
    rng = np.random.default_rng(SEED)
    for _ in range(5):
        pdus = payloads(rng, 1, 40)
        offset = rng.uniform(-max_frequency, max_frequency)
        x = np.concatenate((silence(400), turned(Transmitter().modulate(pdus, 1), offset)))
        assert heard(agree(noisy(rng, x, 6), max_frequency=max_frequency)) == pdus


@pytest.mark.slow
def test_streams_with_every_kind_of_burst_are_told_alike():
    """Own and foreign bursts, false starts, truncated bursts, damaged samples, DC."""
    all_endings, n_odd = set(), 0
    for seed in range(25):
        x, *_ = make_stream(seed)
        events = agree(x)
        all_endings |= set(endings(events))
        n_odd += sum(ending != "whole" for ending in endings(events))
    assert all_endings >= {"whole", "faded", "foreign"}
    assert n_odd > 10


@pytest.mark.parametrize("name", ["aeroplanes", "wifi-n"])
def test_what_others_send_alarms_both_alike(name):
    x = FOREIGN[name](np.random.default_rng(SEED))[:30_000]
    assert agree(x) == []


def received(x, gap_at, gap, sizes, **settings):
    """(events, counters) of the reference for `x` in chunks, with a gap if given."""
    receiver = reference.Receiver(**settings)
    events = push_all(receiver, x[:gap_at], sizes)
    if gap_at is not None:
        events += receiver.gap(gap) + push_all(receiver, x[gap_at:], sizes)
    return events + receiver.flush(), receiver.counters


@law(20)
@given(st.integers(0, 2**32), chunk_sizes, st.booleans())
def test_any_chunking_yields_the_same_events_and_counts(seed, sizes, with_gap):
    x, gap_at, gap, _ = make_stream(seed)
    where = gap_at if with_gap else None
    whole, counted = received(x, where, gap, [len(x)])
    events, counters = received(x, where, gap, sizes)
    assert events == whole
    assert counters == counted


def test_sample_by_sample_yields_the_same():
    x, gap_at, gap, _ = make_stream(1)
    x, gap_at = x[:12_000], min(gap_at, 9000)
    whole, counted = received(x, gap_at, gap, [len(x)], max_frequency=0.1)
    events, counters = received(x, gap_at, gap, [1], max_frequency=0.1)
    assert events == whole
    assert counters == counted


def test_it_has_the_modems_face():
    for method in ("__init__", "push", "gap", "flush"):
        ours = inspect.signature(getattr(Receiver, method))
        assert inspect.signature(getattr(reference.Receiver, method)) == ours
    for kind in (Receiver, reference.Receiver):
        with pytest.raises(ValueError, match="network: got 8; allowed: 0 to 7"):
            kind(8)
        with pytest.raises(ValueError, match="gap: got -1 samples; allowed: 0 or more"):
            kind().gap(-1)


def test_indices_count_from_the_start_that_was_given():
    burst = Transmitter().modulate([b"x"], 0)
    ours, other = Receiver(start=10**12), reference.Receiver(start=10**12)
    assert other.next_index == 10**12
    assert other.push(burst)[0].at == ours.push(burst)[0].at
    assert (other.next_index, other.claim[:2]) == (ours.next_index, ours.claim[:2])
    assert other.gap(5) == ours.gap(5) == []
    assert other.next_index == 10**12 + len(burst) + 5 == ours.next_index


def test_points_are_shown_for_pictures():
    seen, rng = [], np.random.default_rng(SEED)
    parts = [silence(700)]
    for mcs in SOME_MCS:
        parts += [Transmitter().modulate(payloads(rng, 3, 50), mcs), silence(99)]
    x = noisy(rng, np.concatenate(parts), 35)
    listen(reference.Receiver, x, on_points=lambda *shown: seen.append(shown))
    n_symbols = [layout(OFDM_64_16, mcs, 3, 50).n_symbols for mcs in SOME_MCS]
    assert sum(len(each) for each, _ in seen) == sum(n_symbols)
    assert {modulation for _, modulation in seen} == set(Modulation)
    for each, modulation in seen:
        assert each.dtype == np.complex64
        assert np.abs(each[..., None] - points(modulation)).min(-1).max() < 0.2


def test_a_pushed_array_is_left_alone():
    mine = Transmitter().modulate([b"that is mine"], 0)
    mine[300] = np.nan
    before = mine.copy()
    events, counters = listen(reference.Receiver, mine)
    assert np.array_equal(mine, before, equal_nan=True)
    assert heard(events) == [b"that is mine"]
    assert counters["samples_bad"] == 1


def losses(mcs, snr_db, n):
    """Losses of (the modem, the reference) among `n` bursts of 100 bytes."""
    rng = np.random.default_rng(SEED)
    receivers = Receiver(), reference.Receiver()
    events = [], []
    for _ in range(n):
        burst = Transmitter().modulate(payloads(rng, 1, 100), mcs)
        x = turned(burst, rng.uniform(-0.02, 0.02), rng.random())
        x = noisy(rng, np.concatenate((silence(int(rng.integers(100, 600))), x)), snr_db)
        for receiver, into in zip(receivers, events, strict=True):
            into += receiver.push(x)
    rest = noise(rng, 5000, 10 ** (-snr_db / 10))
    return [
        n - len(heard(into + receiver.push(rest)))
        for receiver, into in zip(receivers, events, strict=True)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("mcs", "less_db"), [(0, 0.1), (9, 0.9)])
def test_near_threshold_as_many_are_lost(mcs, less_db):
    """About half are lost; the noise is the same for both, so that few bursts differ."""
    n = often(40)
    ours, other = losses(mcs, needed_snr_db(mcs, 100, per=0.5) - less_db, n)
    assert 0.15 * n < ours < 0.85 * n
    assert abs(other - ours) <= 0.2 * n
