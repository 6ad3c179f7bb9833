"""How bursts get from node to node: power, delay, carrier, clocks, and superposition."""

import numpy as np
import pytest

from backends import LinkOverride, Outage, RadioParams, Track, TxBurst
from backends.testing import NOISE_DBFS
from phy import PROFILES, PduHeard, Receiver, Transmitter
from tests.backends.airs import (
    CENTRE_HZ,
    PLAIN,
    RATE,
    burst,
    delay_of,
    frequency_of,
    heard,
    line,
    loud,
    medium,
    power_db,
    smooth,
)
from tests.backends.radios import noise

SPEED_OF_LIGHT = 299_792_458.0


def test_a_burst_arrives_as_it_was_sent_turned_and_weakened_and_nothing_else_does():
    made, sent = medium(2), burst(1000, 500)
    assert made.send(0, sent) == 1000
    got = heard(made, 1, 0.002)
    assert len(got) == 2000
    gain = np.vdot(sent.samples, got[1000:1500]) / np.vdot(sent.samples, sent.samples)
    assert np.abs(got[1000:1500] - gain * sent.samples).max() < 1e-6 * np.abs(gain)
    assert not got[:1000].any()
    assert not got[1500:].any()


@pytest.mark.parametrize("snr_db", [-10.0, 0.0, 33.3])
@pytest.mark.parametrize("scale", [0.001, 0.7])
def test_a_burst_arrives_with_the_snr_of_its_way_whatever_its_own_power(snr_db, scale):
    """The SNR is relative to the noise of every receiver."""
    links = [LinkOverride(sender=0, receiver=2, snr_db=7.0)]
    made = medium(3, snr_db=snr_db, links=links)
    made.send(0, TxBurst(100, noise(3000, scale=scale)))
    arrived = heard(made, 1, 0.004)[100:3100], heard(made, 2, 0.004)[100:3100]
    assert power_db(arrived[0]) - NOISE_DBFS == pytest.approx(snr_db, abs=1e-3)
    assert power_db(arrived[1]) - NOISE_DBFS == pytest.approx(7.0, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["rayleigh", "tdl-a", "tdl-c"])
def test_bursts_that_fade_have_the_snr_of_their_way_on_average(profile):
    made = medium(2, profile=profile, snr_db=12.0, delay_spread_s=1e-6)
    n_bursts, step = 600, 300
    for i in range(n_bursts):
        made.send(0, burst(100 + i * step, 200, seed=i))
    got = heard(made, 1, (100 + n_bursts * step) / RATE)
    powers = np.sum(np.abs(got[80 : 80 + n_bursts * step].reshape(n_bursts, step)) ** 2, axis=1)
    mean_db = 10 * np.log10(np.mean(powers) / 200)
    assert mean_db - NOISE_DBFS == pytest.approx(12.0, abs=0.5)
    assert np.std(powers) > 0.4 * np.mean(powers), "each fades by itself"


@pytest.mark.parametrize(("spread_s", "lasts"), [(0.0, 0), (1e-5, 97)])
def test_echoes_last_as_long_as_they_are_spread(spread_s, lasts):
    """The last echo of this profile comes 9.66 delay spreads after the first."""
    made = medium(2, profile="tdl-a", delay_spread_s=spread_s, snr_db=100.0)
    made.send(0, burst(1000, 300))
    where = loud(heard(made, 1, 0.002))
    # Plus the skirts of filters.
    assert where[0] >= 1000 - 16
    assert 1300 + lasts - 16 <= where[-1] <= 1300 + lasts + 32


def test_nothing_gets_through_where_there_is_no_way():
    links = [LinkOverride(sender=0, receiver=1, snr_db=-300.0, one_way=True)]
    made = medium(2, links=links)
    for sender in (0, 1):
        made.send(sender, burst(100, 50))
    assert not heard(made, 1, 0.001).any()
    assert np.count_nonzero(heard(made, 0, 0.001)) == 50


@pytest.mark.parametrize(
    ("start", "is_heard"), [(9_999, True), (10_000, False), (19_999, False), (20_000, True)]
)
def test_in_an_outage_bursts_that_begin_do_not_get_through(start, is_heard):
    """A burst gets through as a whole or not at all: its start decides."""
    made = medium(2, outages=[Outage(0.010, 0.020)])
    made.send(0, burst(start, 50))
    assert np.count_nonzero(heard(made, 1, 0.03)) == (50 if is_heard else 0)


def test_nobody_hears_itself():
    made = medium(3)
    made.send(0, burst(100, 300))
    pieces = made.take(0, 0.001)
    assert [(piece.n, piece.samples, piece.is_deaf) for piece in pieces] == [(1000, None, False)]
    assert heard(made, 1, 0.001).any()
    assert heard(made, 2, 0.001).any()


@pytest.mark.parametrize("delay", [0, 1, 129])
def test_a_delay_of_whole_samples_moves_the_burst_and_leaves_it_as_it_is(delay):
    """The delay may also come from the propagation time."""
    tracks = {0: Track([(0.0, 0.0, 0.0)]), 1: Track([(0.0, 0.0, SPEED_OF_LIGHT / RATE)])}
    links = [LinkOverride(sender=0, receiver=1, snr_db=20.0, delay_s=delay / RATE)]
    sent = burst(500, 400)
    for far in (0, 1):
        made = medium(2, links=links, tracks=tracks if far else {})
        made.send(0, sent)
        got = heard(made, 1, 0.002)
        first = 500 + delay + far
        gain = got[first] / sent.samples[0]
        wanted = np.zeros(2000, np.complex64)
        wanted[first : first + 400] = gain * sent.samples
        assert np.abs(got - wanted).max() < 1e-5 * np.abs(gain)


def test_counts_that_began_whole_samples_apart_are_in_step():
    """However the quotients are rounded, a burst arrives in exactly its samples."""
    made = medium(1)
    for i in range(1, 30):
        now = i * 0.0007
        made.take(0, now)
        made.join(1, PLAIN, now)
        start = made.send(0, burst(made.next_index(0) + 100, 50))
        got = heard(made, 1, now + 0.0005)
        first = start - round(now * RATE)
        assert np.flatnonzero(got).tolist() == list(range(first, first + 50)), i


@pytest.mark.parametrize("delay", [0.25, 0.5, 3.0, 77.9])
@pytest.mark.parametrize("profile", ["awgn", "rayleigh"])
def test_a_delay_is_one_to_a_part_of_a_sample(delay, profile):
    made = medium(
        2, profile=profile, links=[LinkOverride(sender=0, receiver=1, delay_s=delay / RATE)]
    )
    sent = smooth(600)
    made.send(0, TxBurst(200, sent))
    got = heard(made, 1, 0.002)
    assert delay_of(got, sent) == pytest.approx(200 + delay, abs=0.02)


@pytest.mark.parametrize(("sends_ppm", "hears_ppm"), [(20, 0), (0, 20), (20, -20), (7, 7)])
def test_crystals_move_the_carrier_by_their_difference(sends_ppm, hears_ppm):
    radios = {0: RadioParams(clock_ppm=sends_ppm), 1: RadioParams(clock_ppm=hears_ppm)}
    made = medium(radios)
    made.send(0, TxBurst(1000, np.full(4000, 0.3, np.complex64)))
    got = heard(made, 1, 0.006)[1100:4900]
    wanted = CENTRE_HZ * (sends_ppm - hears_ppm) * 1e-6 / RATE
    assert frequency_of(got) == pytest.approx(wanted, abs=2e-6)


@pytest.mark.parametrize("towards", [1, -1])
def test_movement_moves_the_carrier(towards):
    speed = 3000.0
    tracks = {
        0: Track([(0.0, 0.0, 0.0)]),
        1: Track([(0.0, 50e3, 0.0), (1.0, 50e3 - towards * speed, 0.0)]),
    }
    made = medium(2, tracks=tracks, snr_db_at_1m=120.0)
    made.send(0, TxBurst(1000, np.full(4000, 0.3, np.complex64)))
    got = heard(made, 1, 0.006)[1300:5000]
    wanted = towards * speed / SPEED_OF_LIGHT * CENTRE_HZ / RATE
    assert frequency_of(got) == pytest.approx(wanted, abs=2e-6)


@pytest.mark.parametrize(("sends_ppm", "hears_ppm"), [(100, 0), (0, 100), (-100, 50), (80, 80)])
def test_crystals_move_the_samples_as_they_move_the_carrier(sends_ppm, hears_ppm):
    """What is n samples apart at the sender is n (1 − difference) apart here."""
    radios = {0: RadioParams(clock_ppm=sends_ppm), 1: RadioParams(clock_ppm=hears_ppm)}
    # Without a carrier, the phase does not change.
    made = medium(radios, frequency_hz=0.0)
    sent = np.zeros(61_000, np.complex64)
    sent[:1000], sent[-1000:] = smooth(1000), smooth(1000)
    made.send(0, TxBurst(1000, sent))
    got = heard(made, 1, 0.07)
    apart = 60_000 + delay_of(got[60_000:63_000], sent[-1000:]) - delay_of(got[:3000], sent[:1000])
    wanted = 60_000 * (1 + hears_ppm * 1e-6) / (1 + sends_ppm * 1e-6)
    assert apart == pytest.approx(wanted, abs=0.04)


@pytest.mark.parametrize("profile", PROFILES)
def test_what_two_send_at_once_adds_up(profile):
    """Neither changes how the other arrives, sample by sample and burst after burst."""
    radios = {0: RadioParams(clock_ppm=3), 1: RadioParams(clock_ppm=-8), 2: RadioParams()}
    lines = []
    for senders in [(0, 1), (0,), (1,)]:
        made = medium(radios, profile=profile, delay_spread_s=1e-6)
        for i in range(5):
            for sender in senders:
                made.send(sender, burst(100 + 300 * sender + 1000 * i, 600, seed=sender))
        lines.append(heard(made, 2, 0.006))
    both, one, other = lines
    assert np.count_nonzero((one != 0) & (other != 0)) > 1000, "they overlap"
    assert np.array_equal(both, one + other)


@pytest.mark.parametrize("profile", PROFILES)
def test_one_seed_is_one_air_and_another_seed_another(profile):
    lines = []
    for seed in (1, 1, 2):
        made = medium(3, seed=seed, profile=profile)
        for sender in (0, 1):
            made.send(sender, burst(100 + 400 * sender, 300))
        lines.append((heard(made, 1, 0.002), heard(made, 2, 0.002)))
    one, same, other = lines
    assert np.array_equal(one, same)
    assert not np.allclose(one[0], other[0])
    assert not np.allclose(one[0][100:400], one[1][100:400]), "each pair has chance of its own"


@pytest.mark.parametrize(
    ("sends_ppm", "hears_ppm", "joined_at"), [(20, -20, 0.0), (-20, 20, 0.0123456), (0, 0, 0.5)]
)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_receiver_finds_a_burst_where_the_clocks_say(sends_ppm, hears_ppm, joined_at, seed):
    rng = np.random.default_rng(seed)
    radios = {0: RadioParams(clock_ppm=sends_ppm)}
    delay_s = 41.5e-6
    links = [LinkOverride(sender=0, receiver=1, delay_s=delay_s)]
    made = medium(radios, seed=seed, links=links)
    made.take(0, joined_at)
    made.join(1, RadioParams(clock_ppm=hears_ppm), joined_at)
    began_s = joined_at + 10.0
    made.take(0, began_s)
    made.take(1, began_s)
    pdus = [rng.bytes(100), rng.bytes(100)]
    start = made.send(0, TxBurst(made.next_index(0) + 3000, Transmitter().modulate(pdus, 2)))
    first = made.next_index(1)
    got = line(made.take(1, began_s + 0.02))
    receiver = Receiver(start=first, max_frequency=0.12)
    events = receiver.push(got + noise(len(got), seed, scale=10 ** (NOISE_DBFS / 20) / np.sqrt(2)))
    told = [event for event in events if isinstance(event, PduHeard)]
    assert [event.data for event in told] == pdus
    sent_at = start / (RATE * (1 + 1e-6 * sends_ppm))
    arrives = (sent_at + delay_s - joined_at) * RATE * (1 + 1e-6 * hears_ppm)
    assert told[0].burst.start == pytest.approx(arrives, abs=1)
    assert told[0].burst.snr_db == pytest.approx(20, abs=1)


@pytest.mark.parametrize(
    ("speed_m_s", "least", "most"), [(0.0, 0, 1e-3), (2.0, 0.005, 0.1), (20.0, 0.2, 0.8)]
)
def test_echoes_change_within_a_burst_as_fast_as_nodes_move(speed_m_s, least, most):
    """The share of a carrier's power by which its magnitude changes in 4 ms: 0, 16, 160 Hz."""
    tracks = {
        0: Track([(0.0, 0.0, 0.0)]),
        1: Track([(0.0, 0.0, 10.0), (100.0, 100 * speed_m_s, 10.0)]),
    }
    made = medium(2, tracks=tracks.items(), profile="rayleigh", snr_db_at_1m=80.0)
    changes, powers = [], []
    for i in range(200):
        made.send(0, TxBurst(6000 * i + 500, np.ones(5000, np.complex64)))
        x = np.abs(heard(made, 1, 6e-3 * (i + 1))[600:5400])
        changes.append(np.mean((x[:-4000] - x[4000:]) ** 2))
        powers.append(np.mean(x**2))
    assert least <= np.mean(changes) / np.mean(powers) <= most
