"""Sealed PDUs that were lost are sent again, octet by octet, and open with their true age."""

from collections import Counter
from random import Random

import pytest

from sdrlinkd.wire import is_sealed, parse_sealed
from tests.laws import one_in
from tests.sealing.attacks import Commands, chain, judge, pair


@pytest.mark.slow
@pytest.mark.parametrize(("make", "victim"), one_in(2, [(chain, 3), (pair, 2)]))
def test_what_the_air_loses_is_repeated_and_opens(make, victim):
    chance = Random(3)
    team = make()
    heard: dict[tuple[int, int, int], set[bytes]] = {}
    again = Counter()

    def passes(receiver, data):
        if is_sealed(data):
            pdu = parse_sealed(data, len(data))
            number = (pdu.src, pdu.ticks, pdu.seq)
            # All but hops, time held, and CRC.
            heard.setdefault(number, set()).add(data[:4] + data[5:9] + data[11:-2])
            again[number, receiver] += 1
        return chance.random() >= 0.05

    team.tamper = passes
    commands = Commands(team, chance, False)
    team.run(60, commands)
    found = judge(team.robots[victim])
    assert found["delivered"] >= 0.995 * (len(commands.sent_at) - 60)
    for fault in ("twice", "past its lifespan", "too young"):
        assert found[fault] == 0
    assert all(len(octets) == 1 for octets in heard.values()), "no octet inside changes"
    assert sum(robot.link.report(0.0).repeats.pdus for robot in team.robots.values()) > 10
    for robot in team.robots.values():
        assert robot.link.audit() == []
