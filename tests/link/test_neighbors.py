"""How long a robot's usual pauses are, what is an outage, and of whom robots report."""

import pytest

from sdrlinkd.link import Overrides
from sdrlinkd.link.receive import LONGEST_GAP_S, Neighbor
from sdrlinkd.wire import LinkReport
from tests.link.meshes import mesh
from tests.link.world import compose, make_link, records_in


def heard(neighbor, times):
    for at in times:
        neighbor.heard_at(at)
    return neighbor.usual_gap_s


def test_the_usual_pause_is_the_longest_of_the_latest():
    neighbor = Neighbor(2)
    assert heard(neighbor, [1.0]) == 0.0
    assert heard(neighbor, [2.0, 5.0, 5.5]) > 2.9
    assert heard(neighbor, [5.5 + 0.1 * i for i in range(1, 300)]) < 0.2


def test_an_outage_is_no_usual_pause():
    """Otherwise the next outage would be noticed far too late."""
    neighbor = Neighbor(2)
    heard(neighbor, [float(second) for second in range(1, 60)])
    assert heard(neighbor, [400.0]) == LONGEST_GAP_S
    assert heard(neighbor, [400.0 + second for second in range(1, 120)]) < 3.0


@pytest.mark.slow
def test_a_robot_that_is_heard_through_relays_only_is_not_reported():
    """Who plans the air takes it for a link, and would send plans over it."""
    air = mesh((1, 2), (2, 3), (1, 3))
    air.run(3.0)
    air.hears -= {(1, 3), (3, 1)}
    air.run(5.0)
    left_at = air.now
    air.flow(3, 200, every_s=0.02, overrides=Overrides(dst=1))
    reports = [(at, each) for at, each in air.records(1) if isinstance(each, LinkReport)]
    assert any(each.node == 3 and at < 3 for at, each in reports)
    assert {each.node for at, each in reports if at > left_at} == {2}
    assert len(set(air.numbers(1))) == 200


def test_a_robot_that_could_not_send_does_not_report_who_was_here_before():
    """Otherwise one that has left would seem to be back."""
    link, other = make_link(1, beacon_s=1.0), make_link(2, beacon_s=1.0)

    def reported(at):
        burst = compose(link, at)
        records = [each for pdu in burst.pdus for each in records_in(pdu, link.params.pdu_size)]
        return [each.node for each in records if isinstance(each, LinkReport)]

    def hear(at):
        for pdu in compose(other, at).pdus:
            link.hear(pdu, at, 20.0)

    hear(0.0)
    assert reported(0.5) == [2]
    hear(1.5)
    assert reported(20.0) == []
    hear(20.5)
    assert reported(21.5) == [2]
