"""The medium in bursts: who receives what, and what a receiver knows of the air."""

import gc
import math
from random import Random

import numpy as np
import pytest

import phy
from backends import AirParams, LinkOverride, Outage, RadioParams, World
from benchmarks.worlds.burst_channel import KEEP_S, BurstChannel
from benchmarks.worlds.flight import Flight
from tests.backends.airs import PLAIN, air, half_duplex

MCS, SIZE = 3, 264
SENSE_S = phy.SENSE_WINDOW / 1e6
A_SAMPLE = 1e-6


def medium(radios, links=(), outages=(), seed=1, snr_db=25.0, **more):
    """Nodes on one air; `radios`: number, or each one's own; `links`: (from, to, SNR in dB)."""
    if isinstance(radios, int):
        radios = dict.fromkeys(range(radios), PLAIN)
    shared = air(snr_db=snr_db)
    overrides = [LinkOverride(sender=a, receiver=b, snr_db=db, one_way=True) for a, b, db in links]
    made = BurstChannel(shared, World(shared, {}, overrides, outages), seed, **more)
    for node, radio in radios.items():
        made.join(node, radio)
    return made


def send(made, node, start_s, n_pdus=1, mcs=MCS):
    return made.send(node, start_s, mcs, n_pdus, SIZE)


def got(made, flight, node):
    """Numbers of the PDUs that `node` reads."""
    numbers = range(len(flight.shape.pdus))
    return [i for i in numbers if made.readers(flight, i, [node])]


@pytest.mark.parametrize(("mcs", "size"), [(0, 64), (1, 1024), (3, 64), (6, 1024)])
@pytest.mark.parametrize("per", [0.1, 0.5, 0.9])
def test_a_link_near_its_threshold_loses_as_much_as_the_table_says(mcs, size, per):
    n = 2000
    made = medium(2, snr_db=phy.needed_snr_db(mcs, size, per))
    lost = 0
    for number in range(n):
        flight = made.send(0, 2.0 * number, mcs, 1, size)
        lost += not got(made, flight, 1)
        made.settle(flight)
    assert lost / n == pytest.approx(per, abs=4 * math.sqrt(per * (1 - per) / n))


def test_the_times_of_a_burst_are_those_of_the_modem():
    shape = send(medium(2), 0, 0.0, n_pdus=3).shape
    assert shape.airtime_s * 1e6 == phy.layout(phy.OFDM_64_16, MCS, 3, SIZE).n_samples
    assert shape.pdus[-1][1] == shape.airtime_s
    assert shape.pdus[0][0] == shape.head_s
    assert all(begin < end for begin, end in shape.pdus)


@pytest.mark.parametrize(("off_s", "hears"), [(-A_SAMPLE, False), (A_SAMPLE, True)])
def test_who_sends_is_deaf_and_a_turnaround_before_and_after(off_s, hears):
    """To the sample, for bursts that end before that or begin after it."""
    turn_s, begin_s = 5e-4, 0.05
    length_s = send(medium(1), 0, 0.0).shape.airtime_s
    for start_s in (begin_s - turn_s - length_s - off_s, begin_s + length_s + turn_s + off_s):
        made = medium({0: PLAIN, 1: half_duplex(turn_s)})
        send(made, 1, begin_s)
        assert bool(got(made, send(made, 0, start_s), 1)) is hears


def test_full_duplex_hears_while_it_sends():
    made = medium({0: PLAIN, 1: RadioParams(full_duplex=True, turnaround_s=5e-4)})
    send(made, 1, 0.05)
    assert got(made, send(made, 0, 0.0501), 1) == [0]


def test_our_own_burst_cuts_what_comes_and_keeps_what_came():
    made = medium({0: PLAIN, 1: half_duplex()})
    flight = send(made, 0, 0.0, n_pdus=5)
    send(made, 1, flight.shape.pdus[2][1] - A_SAMPLE)
    assert got(made, flight, 1) == [0, 1]


@pytest.mark.parametrize(
    ("first_db", "second_db", "reads"),
    [(25, 25, []), (30, 10, [0]), (10, 30, []), (-9, 25, [1])],
)
def test_two_at_the_same_time(first_db, second_db, reads):
    """Equal bursts destroy each other, a weak one does little harm.

    A receiver keeps to the first burst that it finds, however strong the next one is.
    """
    made = medium(3, [(0, 2, first_db), (1, 2, second_db)])
    flights = [send(made, 0, 0.0), send(made, 1, 0.001)]
    assert [i for i, flight in enumerate(flights) if got(made, flight, 2)] == reads


def test_those_who_do_not_hear_each_other_collide_in_the_middle():
    hidden = [(0, 2, -300), (2, 0, -300)]
    made = medium(3, hidden)
    flights = [send(made, 0, 0.0), send(made, 2, 0.001)]
    assert [got(made, flight, 1) for flight in flights] == [[], []]
    assert 0 not in flights[1].arrives
    made = medium(3, hidden)
    flights = [send(made, 0, 0.0), send(made, 2, 0.1)]
    assert [got(made, flight, 1) for flight in flights] == [[0], [0]]


def test_only_the_pdus_that_are_hit_are_lost():
    for number in range(5):
        made = medium(3)
        flight = send(made, 0, 0.0, n_pdus=6)
        begin_s, end_s = flight.shape.pdus[number]
        hit = send(made, 1, (begin_s + end_s) / 2)
        lost = [i for i, (_, end) in enumerate(flight.shape.pdus) if end > hit.start_s]
        kept = [i for i in range(6) if i not in lost or flight.shape.pdus[i][0] >= hit.end_s]
        assert got(made, flight, 2) == kept


def shares_lost(mcs, size, share, n):
    """Shares lost if the last `share` of a PDU meets an equal burst: in samples, in bursts."""
    rng = np.random.default_rng(5)
    transmitter, receiver = phy.Transmitter(), phy.Receiver()
    front_end = phy.FrontEnd(phy.FrontEndParams(noise_dbfs=-25), rng)
    plan = phy.layout(phy.OFDM_64_16, mcs, 1, size)
    n_met = 80 * round(share * plan.n_symbols)
    n_read = 0
    for _ in range(n):
        pdu = rng.bytes(size)
        x = np.concatenate((np.zeros(500, np.complex64), transmitter.modulate([pdu], mcs)))
        other = transmitter.modulate([rng.bytes(2047)], mcs)[512 : 512 + n_met]
        x[len(x) - n_met :] += other * np.exp(2j * np.pi * rng.random())
        events = receiver.push(front_end.receive(x)) + receiver.flush()
        n_read += any(isinstance(each, phy.PduHeard) and each.data == pdu for each in events)
    n_got = 0
    for seed in range(n):
        made = medium(3, seed=seed)
        flight = made.send(0, 0.0, mcs, 1, size)
        made.send(1, flight.end_s - n_met * A_SAMPLE, mcs, 3, size)
        n_got += got(made, flight, 2) == [0]
    return 1 - n_read / n, 1 - n_got / n


@pytest.mark.parametrize(
    ("mcs", "size", "bears", "fails"),
    [(1, 220, 0.15, 0.55), (3, 1024, 0.025, 0.09), (2, 220, 0.08, 0.3), (6, 1024, 0.025, 0.12)],
)
def test_what_another_burst_meets_is_lost_as_in_the_modem(mcs, size, bears, fails):
    """A code tolerates a share of drowned symbols; consecutive short codewords tolerate less."""
    assert max(shares_lost(mcs, size, bears, 30)) < 0.2
    assert min(shares_lost(mcs, size, fails, 30)) > 0.8


def test_many_weak_ones_add_up():
    """Ten at 12 dB below leave 2 dB, which is not enough."""
    for n, reads in ((1, [0]), (10, [])):
        made = medium(12, [(other, 11, 13.0) for other in range(1, 11)])
        flight = send(made, 0, 0.0)
        for other in range(1, 1 + n):
            send(made, other, 0.0015)
        assert got(made, flight, 11) == reads


def test_what_is_near_comes_first_and_stands_with_its_own_delay():
    shared = air(snr_db=25.0)
    links = [LinkOverride(sender=0, receiver=1, delay_s=0.25)]
    made = BurstChannel(shared, World(shared, {}, links), 1)
    for node in range(3):
        made.join(node, PLAIN)
    flight = send(made, 0, 1.0)
    assert flight.arrives == {1: 1.25, 2: 1.0}
    assert flight.over_s == 1.25 + flight.shape.airtime_s
    # The same burst does not interfere at every receiver.
    other = send(made, 2, 1.25)
    assert got(made, flight, 1) == []
    assert got(made, other, 0) == [0]


def test_nothing_gets_through_in_an_outage_and_all_does_after():
    made = medium(2, outages=[Outage(1.0, 2.0)], keep_s=math.inf)
    heard = []
    for start_s in (0.5, 1.5, 2.5):
        flight = send(made, 0, start_s)
        heard.append([got(made, flight, node) for node in flight.arrives])
    assert heard == [[[0]], [], [[0]]]


def test_a_read_header_tells_when_the_air_is_free():
    made = medium(2)
    flight = send(made, 0, 1.0)
    head_s, end_s = flight.shape.head_s, flight.end_s
    assert made.sensed(1, 0.9)[:3] == (0.9, 0.0, -1.0)
    at = 1.0 + head_s / 2
    until, idle_since, burst_at, *_ = made.sensed(1, at)
    assert (until, burst_at) == (at, None)
    assert idle_since > at
    assert made.sensed(1, 1.0 + head_s)[1:3] == (end_s, 1.0)
    made.settle(flight)
    assert made.sensed(1, 77.0)[:3] == (77.0, end_s, 1.0)
    assert made.sensed(0, 77.0)[:3] == (77.0, 0.0, -1.0), "nobody senses itself"


def test_a_burst_that_cannot_be_read_is_still_a_carrier():
    """Its receiver was busy with an earlier burst: only energy is left to detect it."""
    made = medium(3)
    first = send(made, 0, 1.0)
    second = send(made, 1, first.end_s - 0.001, n_pdus=2)
    assert made.sensed(2, second.start_s + 1e-4)[1:3] == (first.end_s, 1.0)
    at = second.end_s - 1e-4
    assert made.sensed(2, at).idle_since > at
    assert made.sensed(2, at).burst_at is None
    for flight in (first, second):
        assert not got(made, flight, 2)
        made.settle(flight)
    assert made.sensed(2, 2.0)[:3] == (2.0, second.end_s, None)


@pytest.mark.parametrize(("snr_db", "is_noticed"), [(4.5, False), (5.0, True)])
def test_a_carrier_is_noticed_from_carrier_db_on(snr_db, is_noticed):
    """6 dB more than noise alone is 4.74 dB of SNR. Both are too weak to be found half-deaf."""
    made = medium({0: PLAIN, 1: half_duplex()}, [(0, 1, snr_db)])
    own = send(made, 1, 1.0 - send(medium(1), 0, 0.0).shape.airtime_s / 2)
    flight = send(made, 0, 1.0)
    assert not got(made, flight, 1)
    made.settle(flight)
    made.settle(own)
    told = (2.0, flight.end_s, None) if is_noticed else (2.0, 0.0, -1.0)
    assert made.sensed(1, 2.0)[:3] == told


def test_who_is_deaf_notices_nothing():
    made = medium({0: PLAIN, 1: half_duplex(1e-3)})
    own = send(made, 1, 1.0, n_pdus=4)
    flight = send(made, 0, own.start_s)
    assert flight.end_s < own.end_s
    assert made.sensed(1, own.end_s).idle_since == 0.0


def test_the_last_carrier_is_never_forgotten():
    """Even nodes that the bursts sent since did not concern remember it."""
    made = medium(4, [(2, 1, -300.0)])
    flight = send(made, 0, 0.0)
    for number in range(1, 50):
        other = send(made, 2, 2 * KEEP_S * number)
        assert other.near == []
    made.settle(flight)
    assert made.sensed(1, 120.0)[:3] == (120.0, flight.end_s, 0.0)


def test_a_burst_begins_when_the_one_before_is_over():
    made = medium(2)
    flight = send(made, 0, 0.0)
    with pytest.raises(ValueError, match=r"start: got 0\.001000 s; allowed: from"):
        send(made, 0, 0.001)
    send(made, 0, flight.end_s + 32e-6)


def test_an_air_that_fades_is_refused():
    fading = AirParams(profile="rayleigh")
    with pytest.raises(ValueError, match='got "rayleigh"; allowed in bursts: "awgn"'):
        BurstChannel(fading, World(fading, {}), 1)


def crowded(seed, n=300):
    """Bursts at random times near the threshold: what every node reads, and what all sense."""
    rng = Random(seed)
    made = medium(6, snr_db=9.0, seed=seed)
    free, live, told = [0.0] * 6, [], []
    t = 0.0
    for _ in range(n):
        t += rng.expovariate(100.0)
        node = rng.randrange(6)
        while live and live[0].over_s < t:
            flight = live.pop(0)
            told.append([got(made, flight, other) for other in flight.arrives])
            made.settle(flight)
        told.append([made.sensed(other, t) for other in range(6)])
        flight = send(made, node, max(t + 1e-3, free[node]), n_pdus=rng.randint(1, 4))
        free[node] = flight.end_s + 1e-4
        live.append(flight)
        live.sort(key=lambda each: each.over_s)
    return told


def test_the_same_seed_gives_the_same_and_another_does_not():
    assert crowded(5) == crowded(5)
    assert crowded(5) != crowded(6)


@pytest.mark.slow
def test_what_is_sensed_follows_what_was_before():
    """Time does not run backwards, and a carrier that has ended stays ended, whatever collides."""
    for seed in range(5):
        before = None
        for senses in crowded(seed):
            if not hasattr(senses[0], "until"):
                continue
            if before is not None:
                for was, now in zip(before, senses, strict=True):
                    assert now.idle_since >= was.idle_since - 1e-5 or was.idle_since > was.until, (
                        f"seed {seed}: {was} {now}"
                    )
            before = senses


@pytest.mark.slow
def test_memory_is_bounded_even_when_every_burst_meets_the_next():
    made = medium(3)
    most = 0
    for number in range(2000):
        flight = send(made, number % 2, 0.0015 * number)
        most = max(most, len(flight.near))
        if number % 3:
            made.settle(flight)
    gc.collect()
    kept = [each for each in gc.get_objects() if isinstance(each, Flight)]
    assert len(kept) < 2 * KEEP_S / 0.0015
    assert most < 5
