"""Bursts through all effects of a path and a front end, and the reports about them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import (
    MCS_TABLE,
    OFDM_64_8,
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
    points,
)
from tests.laws import law
from tests.phy.signals import endings, hear, heard, noisy, payloads, silence, turned

SEED = 29
LEAD = 700

every_mcs = pytest.mark.parametrize("mcs", range(len(MCS_TABLE)))


def framed(burst, lead=LEAD):
    """A burst after `lead` samples of silence and before some more."""
    return np.concatenate((silence(lead), burst, silence(300)))


def carried(burst, seed=SEED, front_end=None, **path):
    """A framed burst as it reaches a receiver."""
    rng = np.random.default_rng(seed)
    offset, samples = Path(PathParams(**path), rng).carry(burst)
    x = framed(samples, LEAD + offset)
    return FrontEnd(front_end or FrontEndParams(noise_dbfs=-30), rng).receive(x)


@law(60)
@given(st.integers(0, 6), st.integers(1, 63), st.integers(1, 2047), st.integers(0, 99))
def test_pdus_come_back(mcs, n_pdus, size, seed):
    rng = np.random.default_rng(seed)
    pdus = payloads(rng, min(n_pdus, max(1, 20_000 // size)), size)
    events, counters = hear(noisy(rng, framed(Transmitter().modulate(pdus, mcs)), 30))
    assert heard(events) == pdus
    assert [event.number for event in events[:-1]] == list(range(len(pdus)))
    over = events[-1]
    assert (over.n_good, over.ending) == (len(pdus), "whole")
    told = over.burst
    assert (told.mcs, told.n_pdus, told.pdu_bytes) == (mcs, len(pdus), size)
    assert (counters["pdus_good"], counters["pdus_bad"]) == (len(pdus), 0)


@every_mcs
@pytest.mark.parametrize(("n_pdus", "size"), [(1, 1), (63, 1), (2, 2047), (63, 220)])
@pytest.mark.parametrize("grid", [OFDM_64_16, OFDM_64_8])
def test_corners_come_back(mcs, n_pdus, size, grid):
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, n_pdus, size)
    # The shortest codewords are the weakest.
    samples = noisy(rng, framed(Transmitter(grid=grid).modulate(pdus, mcs)), 34)
    assert heard(hear(samples, grid=grid)[0]) == pdus


def test_the_fullest_burst_comes_back():
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 63, 2047)
    assert heard(hear(noisy(rng, framed(Transmitter().modulate(pdus, 6)), 30))[0]) == pdus


@every_mcs
@pytest.mark.parametrize("ppm", [-40, -13, 40])
@pytest.mark.parametrize(("rate_hz", "settings"), [(1e6, {"max_frequency": 0.1}), (5e6, {})])
def test_crystals_20_ppm_off_on_both_sides_at_2_4_ghz(mcs, ppm, rate_hz, settings):
    pdus = payloads(np.random.default_rng(SEED), 4, 220)
    burst = Transmitter().modulate(pdus, mcs)
    samples = carried(burst, rate_hz=rate_hz, centre_hz=2.4e9, clock_ppm=ppm)
    events, _ = hear(samples, **settings)
    assert heard(events) == pdus
    assert events[0].burst.cfo == pytest.approx(2.4e9 * ppm * 1e-6 / rate_hz, abs=4e-5)


@pytest.mark.parametrize("ppm", [-40, 40])
@pytest.mark.parametrize(("mcs", "n_pdus", "size"), [(0, 12, 220), (3, 40, 220), (6, 12, 2047)])
def test_clocks_apart_by_40_ppm_in_long_bursts(mcs, n_pdus, size, ppm):
    """Over 70 000 samples, the clocks drift apart by 3 samples."""
    pdus = payloads(np.random.default_rng(SEED), n_pdus, size)
    burst = Transmitter().modulate(pdus, mcs)
    assert 55_000 < len(burst) < 75_000
    samples = carried(burst, rate_hz=1e6, clock_ppm=ppm)
    assert heard(hear(samples)[0]) == pdus


@pytest.mark.parametrize("delay", [0, 0.25, 0.5, 0.9, 17, 300.4])
def test_any_delay_is_found(delay):
    pdus = payloads(np.random.default_rng(SEED), 2, 220)
    burst = Transmitter().modulate(pdus, 6)
    samples = carried(burst, rate_hz=1e6, delay_s=delay * 1e-6)
    events, _ = hear(samples)
    assert heard(events) == pdus
    assert events[0].burst.start == pytest.approx(LEAD + delay, abs=1.01)


@pytest.mark.parametrize(("profile", "rate_hz"), [("tdl-a", 1e6), ("tdl-a", 10e6), ("tdl-c", 5e6)])
def test_echoes_at_25_db(profile, rate_hz):
    """The grid's prefix is longer than the echoes; some bursts fade as a whole."""
    transmitter, rng = Transmitter(), np.random.default_rng(SEED)
    n_heard = 0
    for seed in range(100):
        pdus = payloads(rng, 1, 100)
        samples = carried(
            transmitter.modulate(pdus, 1),
            seed,
            FrontEndParams(noise_dbfs=-25),
            rate_hz=rate_hz,
            profile=profile,
        )
        events, _ = hear(samples)
        n_heard += heard(events) == pdus
    assert n_heard >= 98


@every_mcs
@pytest.mark.parametrize(
    "front_end",
    [
        FrontEndParams(noise_dbfs=-45, dc_dbfs=-18),
        FrontEndParams(noise_dbfs=-45, image_db=30),
        FrontEndParams(noise_dbfs=-45, bits=8),
        FrontEndParams(noise_dbfs=-45, dc_dbfs=-30, image_db=30, bits=8),
    ],
    ids=["dc", "image", "8 bits", "all"],
)
def test_a_front_end_that_is_not_perfect(mcs, front_end):
    """A burst at -15 dBFS after a period of noise, at 4 ppm."""
    pdus = payloads(np.random.default_rng(SEED), 4, 220)
    rng = np.random.default_rng(SEED)
    params = PathParams(rate_hz=1e6, centre_hz=2.4e9, clock_ppm=4, loss_db=15)
    _, samples = Path(params, rng).carry(Transmitter().modulate(pdus, mcs))
    events, _ = hear(FrontEnd(front_end, rng).receive(framed(samples, 40_000)))
    assert heard(events) == pdus
    assert events[0].burst.rssi_dbfs == pytest.approx(-15, abs=0.5)


@every_mcs
def test_a_transmitter_that_is_not_perfect(mcs):
    pdus = payloads(np.random.default_rng(SEED), 4, 220)
    burst = Transmitter().modulate(pdus, mcs)
    samples = carried(burst, rate_hz=1e6, centre_hz=2.4e9, clock_ppm=3, image_db=30, leak_db=25)
    assert heard(hear(samples)[0]) == pdus


@pytest.mark.parametrize("snr_db", [0, 5, 10, 20, 30])
@pytest.mark.parametrize("gain_db", [0, -40])
def test_estimates_are_close(snr_db, gain_db):
    rng = np.random.default_rng(SEED)
    gain = 10 ** (gain_db / 20)
    start, snr, rssi, evm, cfo = [], [], [], [], []
    for _ in range(40):
        frequency = rng.uniform(-0.02, 0.02)
        x = turned(framed(Transmitter().modulate([bytes(20)], 0)), frequency, rng.random())
        x = gain * noisy(rng, x, snr_db)
        events, _ = hear(x)
        told = events[-1].burst
        start.append(told.start)
        snr.append(told.snr_db)
        rssi.append(told.rssi_dbfs)
        evm.append(told.evm_db)
        cfo.append(told.cfo - frequency)
    assert abs(np.median(start) - LEAD) <= 1
    assert np.ptp(start) <= (12 if snr_db < 10 else 2)
    assert np.mean(snr) == pytest.approx(snr_db, abs=0.5)
    assert np.std(snr) < 1
    assert np.mean(rssi) == pytest.approx(
        gain_db + 10 * np.log10(1 + 10 ** (-snr_db / 10)), abs=0.2
    )
    # The subcarriers in use hold 52 of the noise's 64 parts; estimating them costs up to 3 dB.
    assert 0 < np.mean(evm) + snr_db + 10 * np.log10(64 / 52) < 3
    assert np.sqrt(np.mean(np.square(cfo))) < 1.5e-4 * 10 ** (-snr_db / 20) + 1e-6


@every_mcs
def test_each_pdu_is_delivered_when_its_last_symbol_is_in(mcs):
    """Not only at the burst's end."""
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 9, 100)
    samples = noisy(rng, framed(Transmitter().modulate(pdus, mcs)), 30)
    plan = layout(OFDM_64_16, mcs, 9, 100)
    receiver, pushed = Receiver(), 0
    for number, pdu in enumerate(pdus):
        end = LEAD + 352 + 80 * (2 + plan.symbols_through(number + 1))
        events = receiver.push(samples[pushed:end])
        pushed = end
        assert heard(events) == [pdu]
        assert (events[0].number, len(events)) == (number, 2 if number == 8 else 1)
        assert end - 4 <= events[0].at <= end
        assert receiver.next_index == end
    assert isinstance(events[1], BurstOver)


def test_pdus_that_share_a_symbol_come_together_when_it_is_in():
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 11, 1)
    samples = noisy(rng, framed(Transmitter().modulate(pdus, 6)), 30)
    plan = layout(OFDM_64_16, 6, 11, 1)
    last_symbol = [plan.symbols_through(number + 1) for number in range(11)]
    assert last_symbol == [1] * 3 + [2] * 4 + [3] * 4
    receiver, events, pushed = Receiver(), [], 0
    for symbols in (1, 2, 3):
        end = LEAD + 352 + 80 * (2 + symbols)
        events += receiver.push(samples[pushed:end])
        assert heard(events) == pdus[: sum(symbol <= symbols for symbol in last_symbol)]
        pushed = end
    # Nothing is missing if nothing follows.
    assert receiver.gap(1) == []
    assert [event.at for event in events[:-1]] == [LEAD + 512 + 80 * n for n in last_symbol]


def test_positions_count_from_the_start_that_was_given():
    samples = framed(Transmitter().modulate([b"x"], 0))
    at_0 = Receiver().push(samples)
    later = Receiver(start=10**12).push(samples)
    assert later[0].burst.start - at_0[0].burst.start == later[0].at - at_0[0].at == 10**12


@every_mcs
def test_points_are_shown_for_pictures(mcs):
    seen = []
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 50)
    samples = noisy(rng, framed(Transmitter().modulate(pdus, mcs)), 35)
    events, _ = hear(samples, on_points=lambda *shown: seen.append(shown))
    assert heard(events) == pdus
    assert endings(events) == ["whole"]
    assert sum(len(each) for each, _ in seen) == layout(OFDM_64_16, mcs, 3, 50).n_symbols
    for each, modulation in seen:
        assert isinstance(modulation, Modulation)
        assert modulation is MCS_TABLE[mcs].modulation
        assert np.abs(each[..., None] - points(modulation)).min(-1).max() < 0.2


def test_events_say_what_they_are():
    events, _ = hear(framed(Transmitter().modulate([b"a", b"b"], 2)))
    assert [type(event) for event in events] == [PduHeard, PduHeard, BurstOver]
