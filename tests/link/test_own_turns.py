"""Turns of one PDU where more waits than that, and what is asked for never comes."""

from math import inf

import pytest

from sdrlinkd.link import Overrides, Qos
from sdrlinkd.wire import BROADCAST, LAST_PLAN, Frame, Grant, Want
from tests.link.standing_turns import ROUND_S, StandingTurns, in_turns


class UnheardRequests(StandingTurns):
    """As the robot that plans does not hear any request, it has to be told again and again."""

    def request(self, start, left):
        return None if left is None else Want(1, left.qos, left.priority, 0, 1, 0)


@pytest.mark.parametrize(("dst", "turns"), [(2, 2), (BROADCAST, 1)])
def test_urgent_messages_and_requests_take_turns_where_a_turn_holds_one_pdu(dst, turns):
    """A request fits beside a message to everyone, but not beside one that only one robot reads."""
    air = in_turns(UnheardRequests)
    air.run(1.0)
    n = 6
    for number in range(n):
        air.submit(1, number, overrides=Overrides(qos=Qos.URGENT, lifespan_s=inf, dst=dst))
    air.run(air.now + (turns * n + 1) * ROUND_S)
    assert sorted(air.numbers(2)) == list(range(n))
    asked = sum(isinstance(each, Want) for at, each in air.records(1) if at > 1)
    assert asked >= n - 2


class PlansToPassOn(StandingTurns):
    """In each turn there is a plan to pass on, on which the root does not count."""

    must_tell = True

    def told(self, start, length_s, room):
        return [Frame(1, 1, 0, 0), Grant(0, 1, 0, LAST_PLAN)]


def test_urgent_messages_and_plans_take_turns_where_a_turn_holds_one_pdu():
    """The turns of robots on which the root counts have room for both."""
    air = in_turns(PlansToPassOn)
    air.run(1.0)
    for number in range(6):
        overrides = Overrides(qos=Qos.URGENT, lifespan_s=inf, dst=BROADCAST)
        air.submit(1, number, overrides=overrides)
        air.run(air.now + 2 * ROUND_S)
        assert number in air.numbers(2)
    assert sum(isinstance(each, Grant) for at, each in air.records(1) if at > 1) >= 5
