"""Reports travel in beacons, and the MCS follows: whole links on an air without samples."""

from random import Random

import pytest

from sdrlinkd.link import (
    AccessParams,
    Opportunity,
    Overrides,
    PduLinkTraits,
    RateParams,
)
from sdrlinkd.wire import BROADCAST, LinkReport, parse
from tests.link.steps import Steps
from tests.link.world import make_link, neighbors, records_in

SIZE = 220
NEEDED = (1.0, 4.0, 7.0, 10.0, 13.0, 17.0, 19.0)
RATES = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 9.0)
TRAITS = PduLinkTraits(longest_burst_s=(0.01,) * 7, needed_snr_db=NEEDED, mcs=1)
STEP_S = 0.04
INFINITE = float("inf")


def airtime_s(mcs, n_pdus):
    return 0.0005 * n_pdus / RATES[mcs]


def most_pdus(mcs, longest_s):
    return min(4, int(longest_s / airtime_s(mcs, 1))) if longest_s != INFINITE else 4


def next_burst(link, now):
    return link.next_burst(Opportunity(now, airtime_s, most_pdus))


class World(Steps):
    """Links that hear each other by `snr_db(to, src, now)`; weaker bursts are lost."""

    def __init__(self, ids, snr_db, most_bursts=10, **rate):
        self.snr_db = snr_db
        links = {each: make_link(each, seed=each, pdu_size=SIZE, beacon_s=1.0) for each in ids}
        for link in links.values():
            link.attach(TRAITS, AccessParams(), RateParams(adapt=True, **rate))
        super().__init__(links, STEP_S, next_burst, most_bursts)

    def arrivals(self, to, src, burst):
        snr_db = self.snr_db(to, src, self.now)
        if snr_db >= NEEDED[burst.mcs]:
            yield from ((0.0, snr_db, pdu) for pdu in burst.pdus)

    def mcs(self, src, since, until=INFINITE):
        """The MCS values of `src`'s bursts with messages in that time."""
        return [
            burst.mcs
            for at, sender, burst in self.bursts
            if since <= at < until and sender == src and any(burst.carried)
        ]


def chatter(to=BROADCAST, src=1, size=100):
    def submit(world):
        world.links[src].submit(0, bytes(size), world.now, Overrides(dst=to))

    return submit


def there(world, node, src):
    """(SNR in dB, PER) with which `src` reports to hear `node`."""
    report = neighbors(world.links[node])[src]
    return report.snr_there_db, report.per_there


def test_a_link_report_says_how_well_the_other_is_heard():
    world = World([1, 2], lambda to, src, now: 12.0 if src == 1 else 8.0)
    world.run(6.0, chatter())
    told = {
        src: record
        for _, src, burst in world.bursts
        for pdu in burst.pdus
        for record in records_in(pdu, SIZE)
        if isinstance(record, LinkReport)
    }
    assert told[2] == LinkReport(1, 48, 0, 3)
    assert told[1] == LinkReport(2, 32, 0, 1)
    assert there(world, 1, 2) == (12.0, 0.0)
    assert there(world, 2, 1) == (8.0, 0.0)


def test_nobody_knows_anybody_so_the_first_burst_is_the_slowest():
    world = World([1, 2], lambda *_: 30.0)
    world.run(0.01, chatter())
    assert {burst.mcs for _, _, burst in world.bursts} == {0}


@pytest.mark.slow
@pytest.mark.parametrize("to", [BROADCAST, 2])
def test_the_mcs_follows_a_falling_and_a_rising_snr(to):
    def snr_db(_to, _src, now):
        return min(25.0, abs(now - 40.0))

    world = World([1, 2], snr_db)
    world.run(80.0, chatter(to))
    at_best, at_worst, again = (world.mcs(1, at)[0] for at in (10.0, 40.0, 75.0))
    assert (at_best, at_worst, again) == (6, 0, 6)
    falling, rising = world.mcs(1, 15.0, 40.0), world.mcs(1, 41.0, 65.0)
    assert set(falling) == set(rising) == set(range(7))
    assert falling == sorted(falling, reverse=True)
    assert rising == sorted(rising)
    steps = [change.mcs for change in world.links[1].report(world.now).mcs_changes]
    assert steps == [6, 5, 4, 3, 2, 1, 0, 1, 2, 3, 4, 5, 6]


def test_losses_that_snr_does_not_tell_make_it_cautious():
    """Fading, interference: the mean SNR is fine, but PDUs are lost."""
    rng = Random(5)

    def snr_db(_to, src, _now):
        return -50.0 if src == 1 and rng.random() < 0.3 else 16.0

    world = World([1, 2], snr_db)
    world.run(15.0, chatter())
    assert max(world.mcs(1, 13.0)) < 4
    assert there(world, 1, 2)[1] > 0.1


@pytest.mark.slow
def test_a_robot_that_falls_silent_is_spoken_to_slowly():
    def snr_db(_to, src, now):
        return -50.0 if src == 2 and now > 10 else 25.0

    world = World([1, 2], snr_db, stale_s=3.0, forget_s=20.0)
    world.run(40.0, chatter())
    assert set(world.mcs(1, 9.0)[:20]) == {6}
    assert set(world.mcs(1, 15.0)) == {0}


@pytest.mark.slow
def test_a_third_that_is_far_slows_broadcasts_only():
    def snr_db(to, src, _now):
        return 6.0 if 3 in (to, src) else 25.0

    world = World([1, 2, 3], snr_db)
    world.run(8.0, chatter(BROADCAST))
    assert set(world.mcs(1, 6.0)) <= {0, 1}
    world.run(16.0, chatter(2))
    assert set(world.mcs(1, 12.0)) == {6}


@pytest.mark.slow
@pytest.mark.parametrize("size", [100, 2000], ids=["some", "more than the air carries"])
def test_beacons_are_for_all_also_beside_messages_for_one(size):
    """Unicast at full rate must not hide us from robots farther away."""

    def snr_db(to, src, _now):
        return 6.0 if 3 in (to, src) else 25.0

    world = World([1, 2, 3], snr_db, most_bursts=1)
    world.run(20.0, chatter(2, size=size))
    assert set(world.mcs(1, 10.0)) == {6}
    for at, src, burst in world.bursts:
        if src == 1 and at > 5 and any(parse(pdu, SIZE).dst == BROADCAST for pdu in burst.pdus):
            assert burst.mcs <= 1, at
    (heard,) = (n for n in world.links[3].report(world.now).neighbors if n.src == 1)
    assert heard.last_heard_s_ago < 3


def test_all_of_it_is_in_the_report():
    world = World([1, 2], lambda *_: 25.0)
    world.run(5.0, chatter())
    report = world.links[1].report(world.now)
    assert sum(report.bursts_by_mcs.values()) == sum(src == 1 for _, src, _ in world.bursts)
    assert set(report.bursts_by_mcs) == {0, 6}
    assert [change.mcs for change in report.mcs_changes] == [6]
