"""What the receiver knows of the air: busy or idle, since when, and whose burst it was."""

from itertools import pairwise

import numpy as np
import pytest

import phy
from backends import RxBlock
from sdrlinkd.link import Sensed
from sdrlinkd.modem.testing import TAIL, VANISHED, SensingReceiver

RATE = 1e6
WINDOW = phy.SENSE_WINDOW
QUIET = 20 * WINDOW
# Samples from a burst's start until its header is read: preamble, header, and a search hop.
HEADER_WITHIN = 2000
# Energy is reported in whole windows.
COARSE = WINDOW + 1


def make_receiving(network=0):
    return SensingReceiver(phy.Receiver(network), phy.EnergyDetector(), RATE)


def a_burst(seed, n_pdus=4, mcs=1, network=0):
    rng = np.random.default_rng(seed)
    return phy.Transmitter(network).modulate([rng.bytes(200) for _ in range(n_pdus)], mcs)


def no_burst(seed, n):
    """Energy as strong as a burst, without a preamble."""
    rng = np.random.default_rng(seed)
    return ((rng.normal(size=n) + 1j * rng.normal(size=n)) / np.sqrt(2)).astype(np.complex64)


def on_air(*parts, seed=1, snr_db=20):
    """Parts in sequence, with noise; a number is a silence of that many samples."""
    parts = [np.zeros(each, np.complex64) if isinstance(each, int) else each for each in parts]
    x = np.concatenate(parts)
    return (x + 10 ** (-snr_db / 20) * no_burst(seed + 1000, len(x))).astype(np.complex64)


def gap(index, n, reason):
    return RxBlock(index, n, None, reason, 0)


def listen(receiving, samples, size, index=0):
    """[(index after a block, channel state then, PDUs that it brought)]"""
    story = []
    for first in range(0, len(samples), size):
        piece = samples[first : first + size]
        events = receiving.hear(RxBlock(index + first, len(piece), piece, "", 0))
        pdus = [event for event in events if isinstance(event, phy.PduHeard)]
        story.append((index + first + len(piece), receiving.sensed, pdus))
    return story


def is_busy(sensed):
    return sensed.idle_since > sensed.until


def test_it_has_listened_up_to_the_last_sample():
    receiving = make_receiving()
    for end, sensed, _ in listen(receiving, on_air(5000), 77):
        assert sensed.until == end / RATE
        assert not is_busy(sensed)
        assert sensed.idle_since == 0


def test_before_the_first_block_it_has_not_listened_at_all():
    """Otherwise a burst could be decided for an air that nobody has heard."""
    assert make_receiving().sensed.until == 0


def test_without_a_sense_it_knows_nothing_and_holds_nobody_back():
    receiving = SensingReceiver(phy.Receiver(), None, RATE)
    story = listen(receiving, on_air(QUIET, a_burst(1), QUIET), 500)
    assert {sensed for _, sensed, _ in story} == {Sensed()}
    assert sum(len(pdus) for _, _, pdus in story) == 4


@pytest.mark.parametrize("seed", range(4))
def test_a_burst_is_busy_from_its_first_windows_to_its_end(seed):
    burst = a_burst(seed, mcs=seed)
    begin, end = QUIET, QUIET + len(burst)
    for now, sensed, _ in listen(make_receiving(), on_air(QUIET, burst, QUIET, seed=seed), 50):
        if begin + TAIL <= now < end - 2:
            assert is_busy(sensed), (seed, now)
        elif now < begin or now > end + TAIL:
            assert not is_busy(sensed), (seed, now)


@pytest.mark.parametrize("seed", range(4))
def test_the_header_tells_the_end_ahead(seed):
    burst = a_burst(seed)
    begin, end = QUIET, QUIET + len(burst)
    story = listen(make_receiving(), on_air(QUIET, burst, QUIET, seed=seed), 50)
    told = [sensed for now, sensed, _ in story if begin + HEADER_WITHIN <= now]
    assert len(told) > 100
    assert len({each[1:] for each in told}) == 1, "it does not change any more"
    assert told[0].idle_since * RATE == pytest.approx(end, abs=4)
    assert told[0].burst_at * RATE == pytest.approx(begin, abs=4)


@pytest.mark.parametrize("size", [50, 1000, 4096])
def test_the_preamble_time_is_the_same_number_that_its_pdus_bear(size):
    """Access policies compare whether the last carrier was that of the last PDU."""
    x = on_air(QUIET + 13, a_burst(1), 3 * WINDOW, a_burst(2), QUIET)
    n_pdus = n_same = 0
    for _, sensed, pdus in listen(make_receiving(), x, size):
        n_pdus += len(pdus)
        if pdus and sensed.burst_at is not None:
            assert sensed.burst_at in {event.burst.start / RATE for event in pdus}
            n_same += 1
    assert n_pdus == 8
    assert n_same


@pytest.mark.parametrize("seed", range(4))
def test_energy_without_a_header_is_nobodys_burst(seed):
    n = 5000 + 17 * seed
    x = on_air(QUIET, no_burst(seed, n), QUIET, seed=seed)
    begin, end = QUIET, QUIET + n
    for now, sensed, pdus in listen(make_receiving(), x, 50):
        assert not pdus
        if begin + TAIL <= now < end:
            assert is_busy(sensed), (seed, now)
        if now > end + TAIL + WINDOW:
            assert not is_busy(sensed), (seed, now)
            assert abs(sensed.idle_since * RATE - end) < COARSE
        if now >= begin + TAIL:
            assert sensed.burst_at is None


def test_a_burst_whose_preamble_was_missed_is_nobodys():
    burst = a_burst(3)
    story = listen(make_receiving(), on_air(QUIET, burst[600:], QUIET), 50)
    end = QUIET + len(burst) - 600
    assert is_busy(story[(end - 200) // 50][1])
    _, sensed, _ = story[-1]
    assert sensed.burst_at is None
    assert abs(sensed.idle_since * RATE - end) < COARSE


def test_another_networks_burst_has_an_end_too():
    burst = a_burst(4, network=3)
    story = listen(make_receiving(network=0), on_air(QUIET, burst, QUIET), 50)
    _, sensed, _ = story[-1]
    assert not any(pdus for _, _, pdus in story)
    assert sensed.idle_since * RATE == pytest.approx(QUIET + len(burst), abs=4)


@pytest.mark.parametrize("tail", [1, WINDOW // 2, WINDOW])
def test_echoes_behind_a_burst_do_not_make_another_carrier_of_it(tail):
    burst = a_burst(5)
    end = QUIET + len(burst)
    story = listen(make_receiving(), on_air(QUIET, burst, no_burst(5, tail), QUIET), 50)
    for now, sensed, _ in story:
        if now >= QUIET + HEADER_WITHIN:
            assert sensed.idle_since * RATE == pytest.approx(end, abs=4)
            assert sensed.burst_at * RATE == pytest.approx(QUIET, abs=4)


def test_energy_that_goes_on_behind_a_burst_is_another_carrier():
    burst, more = a_burst(6), 4000
    end = QUIET + len(burst)
    story = listen(make_receiving(), on_air(QUIET, burst, no_burst(6, more), QUIET), 50)
    for now, sensed, _ in story:
        if end + TAIL + WINDOW < now < end + more:
            assert is_busy(sensed), now
            assert sensed.burst_at is None
    sensed = story[-1][1]
    assert abs(sensed.idle_since * RATE - end - more) < COARSE


def test_bursts_without_a_pause_stay_busy_and_a_jammer_does_not():
    """Headers explain the energy of the bursts, for longer than the patience; nothing else does."""
    bursts = [part for seed in range(9) for part in (a_burst(seed), 32)]
    n = sum(each if isinstance(each, int) else len(each) for each in bursts)
    assert n > 1.5 * 40_000
    receiving = make_receiving()
    story = listen(receiving, on_air(QUIET, *bursts), 500)
    told = [is_busy(sensed) for now, sensed, _ in story if QUIET + TAIL < now < QUIET + n - TAIL]
    # The tail of a burst counts as its echo.
    assert np.mean(told) > 0.9
    story = listen(receiving, on_air(no_burst(1, 60_000)), 500, QUIET + n)
    quiet_at = max(now for now, sensed, _ in story if is_busy(sensed)) - QUIET - n
    assert 0.9 * 40_000 < quiet_at < 1.1 * 40_000


def test_a_burst_behind_another_is_the_last_one():
    first, second = a_burst(7), a_burst(8, n_pdus=2)
    pause = 3 * WINDOW
    begin = QUIET + len(first) + pause
    story = listen(make_receiving(), on_air(QUIET, first, pause, second, QUIET), 50)
    assert all(is_busy(s) for now, s, _ in story if begin + TAIL <= now < begin + len(second) - 2)
    sensed = story[-1][1]
    assert sensed.burst_at * RATE == pytest.approx(begin, abs=4)
    assert sensed.idle_since * RATE == pytest.approx(begin + len(second), abs=4)


@pytest.mark.parametrize("seed", range(6))
def test_it_senses_the_same_however_samples_come(seed):
    rng = np.random.default_rng(seed)
    x = on_air(QUIET, a_burst(seed), 500, no_burst(seed, 3000), QUIET, a_burst(9), seed=seed)
    marks = sorted(int(each) for each in rng.integers(0, len(x), 12))
    told = []
    for _ in range(2):
        receiving, sensed = make_receiving(), []
        cuts = sorted({0, *marks, len(x), *(int(c) for c in rng.integers(0, len(x), 40))})
        for first, last in pairwise(cuts):
            receiving.hear(RxBlock(first, last - first, x[first:last], "", 0))
            if last in marks:
                sensed.append(receiving.sensed)
        told.append(sensed)
    assert told[0] == told[1], f"seed {seed}"


def test_while_we_send_we_hear_nothing_and_that_is_no_carrier():
    receiving = make_receiving()
    burst = a_burst(1)
    listen(receiving, on_air(QUIET, burst, QUIET), 100)
    before, index = receiving.sensed, 2 * QUIET + len(burst)
    assert receiving.hear(gap(index, 5000, "sending")) == []
    assert receiving.sensed == before._replace(until=(index + 5000) / RATE)


def test_what_was_lost_is_not_taken_for_silence():
    """The receiver did not hear that time: others may have started, and may still be on the air."""
    receiving = make_receiving()
    listen(receiving, on_air(QUIET), 100)
    receiving.hear(gap(QUIET, 5000, "the reader was too slow"))
    assert is_busy(receiving.sensed) or receiving.sensed.until <= QUIET / RATE
    listen(receiving, on_air(QUIET), 100, index=QUIET + 5000)
    assert not is_busy(receiving.sensed)
    assert receiving.sensed.idle_since >= (QUIET + 5000) / RATE - 1e-9
    assert receiving.sensed.burst_at is None


LONGEST = 5000


def of_link(network=0):
    """The receiver of a link with PDUs of 200 B and bursts of at most 5 ms."""
    expected = phy.Expected(200, LONGEST, every=1000)
    return SensingReceiver(phy.Receiver(network, expected=expected), phy.EnergyDetector(), RATE)


def silent_for(story, since):
    """Samples after `since` in which the channel counts as busy."""
    return max((now for now, sensed, _ in story if is_busy(sensed)), default=since) - since


@pytest.mark.parametrize("network", [0, 3])
@pytest.mark.parametrize("size", [200, 2047])
def test_a_header_without_a_burst_holds_the_air_as_long_as_its_energy(network, size):
    """Of our network or another, of our PDU length or not: 0.5 ms of air, and no more."""
    rng = np.random.default_rng(size)
    header = phy.Transmitter(network).modulate([rng.bytes(size)] * 3, 1)[:700]
    story = listen(of_link(), on_air(QUIET, header, 3 * LONGEST), 50)
    assert silent_for(story, QUIET + 700) <= VANISHED + TAIL + 50


@pytest.mark.parametrize(("network", "size"), [(0, 200), (3, 2047)])
def test_a_false_header_too_weak_to_be_sensed_holds_the_air_for_one_burst(network, size):
    rng = np.random.default_rng(size)
    header = phy.Transmitter(network).modulate([rng.bytes(size)] * 3, 0)[:700]
    story = listen(of_link(), on_air(QUIET, header, 3 * LONGEST, snr_db=5), 50)
    assert silent_for(story, QUIET) <= LONGEST + 50


@pytest.mark.parametrize("snr_db", [3, 6, 9, 12, 25])
def test_a_true_burst_is_never_given_up_for_its_energy(snr_db):
    burst = a_burst(9, n_pdus=1)
    end = QUIET + len(burst)
    for seed in range(5):
        story = listen(of_link(), on_air(QUIET, burst, QUIET, snr_db=snr_db, seed=seed), 50)
        for now, sensed, _ in story:
            if QUIET + HEADER_WITHIN <= now < end - 2:
                assert is_busy(sensed), (snr_db, seed, now)


@pytest.mark.parametrize("size", [100, 500, 5000])
def test_pulses_after_a_burst_are_told_apart_from_it(size):
    burst, pulse = a_burst(3), phy.pulse()
    begins, parts = [], [QUIET, burst]
    for _ in range(3):
        begins.append(sum(each if isinstance(each, int) else len(each) for each in parts) + QUIET)
        parts += [QUIET, pulse]
    samples = on_air(*parts, QUIET)
    *_, (_, sensed, _) = listen(make_receiving(), samples, size)
    burst_end = (QUIET + len(burst)) / RATE
    assert sensed.carrier_end == pytest.approx(burst_end, abs=2 / RATE)
    assert sensed.carrier_at == pytest.approx(QUIET / RATE, abs=2 / RATE)
    found = [round(each * RATE) for each in sensed.pulses]
    assert len(found) == 3
    assert all(abs(a - b) < COARSE for a, b in zip(found, begins, strict=True))
    assert sensed.idle_since * RATE == pytest.approx(begins[-1] + phy.N_PULSE, abs=COARSE)
    assert sensed.burst_at is None, "the last energy was nobody's burst"


def test_a_burst_after_pulses_ends_them():
    samples = on_air(QUIET, phy.pulse(), QUIET, a_burst(4), QUIET)
    *_, (_, sensed, _) = listen(make_receiving(), samples, 500)
    assert sensed.pulses == ()
    assert sensed.carrier_at == sensed.burst_at
    assert sensed.carrier_end == sensed.idle_since


def test_it_tells_which_lines_it_cuts_and_how_strong_they_are():
    receiving = make_receiving()
    x = 1e-2 * no_burst(47, 200_000)
    x = phy.Jammer("tone", -22, RATE, 1, offset_hz=312e3, times=[(0, 0.1)]).add(x, 0)
    x = phy.Jammer("sweep", -25, RATE, 1, times=[(0.06, 0.1)]).add(x, 0)
    told = []
    for first in range(0, len(x), 1000):
        piece = x[first : first + 1000]
        receiving.hear(RxBlock(first, 1000, piece, "", 0))
        told.append(receiving.lines)
    line, *others = told[50]
    assert not others
    assert (line.offset_hz, line.power_dbfs, line.moves) == (
        pytest.approx(312e3, abs=200),
        pytest.approx(-22, abs=0.2),
        False,
    )
    # The noise has -40 dBFS.
    assert line.over_noise_db == pytest.approx(18, abs=0.5)
    assert 3 / 512 <= line.width <= 9 / 512
    assert any(each.moves for lines in told[62:98] for each in lines)
    assert told[-1] == []
