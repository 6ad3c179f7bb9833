"""What a gateway knows: robots, other gateways, last messages, counts; and what is due next."""

import asyncio
import threading
import time
from math import inf

import pytest

from sdrlinkd.client import MessageName
from sdrlinkd.fleet import Claim, Passed, score
from sdrlinkd.fleet.testing import (
    BRIDGE,
    OVERHEAD,
    UP,
    Alarm,
    Counts,
    HeardRobots,
    Lane,
    LastValues,
    NamedRecently,
    OtherGateways,
    Token,
)
from tests.fleet.beside import OWN, ROBOT, until
from tests.reported import neighbor


class Robots:
    """The robots that gateway 7 hears, and what it declares for them."""

    def __init__(self):
        self.opened = []
        self.all = HeardRobots(OWN, 1.0, self._open)

    def _open(self, robot):
        self.opened.append(robot)
        return [lambda: self.opened.remove(robot), lambda: self.opened.append(-robot)]


def test_a_robot_is_near_as_long_as_the_daemon_hears_it():
    robots = Robots()
    assert robots.all.is_near(OWN)
    assert not robots.all.is_near(ROBOT)
    robots.all.heard(ROBOT, 0.0)
    assert not robots.all.is_near(ROBOT), "how well is not known yet"
    robots.all.note([neighbor(ROBOT), neighbor(3, last_heard_s_ago=2.99)], 0.1)
    robots.all.note([neighbor(4, last_heard_s_ago=3.0), neighbor(ROBOT)], 0.1)
    assert robots.all.is_near(ROBOT)
    assert not robots.all.is_near(3)
    assert robots.all.get(4) is None
    assert robots.all.get(None) is None
    assert robots.opened == [ROBOT, 3]
    assert [each.id for each in robots.all] == [ROBOT, 3]


@pytest.mark.parametrize(("lately", "per"), [(None, 0.25), (0.5, 0.5), (0.0, 0.0)])
def test_what_was_lost_lately_counts_if_anything_was_sent(lately, per):
    robots = Robots()
    robots.all.note([neighbor(ROBOT, per=0.25, per_lately=lately, snr_db=20.0)], 0.0)
    report = robots.all.get(ROBOT).report()
    assert report.score == score(per, 20.0)
    assert (report.robot, report.leader, report.hold_ms) == (ROBOT, None, 20.0)
    assert (report.put_for_others, report.put_twice) == (0, 0)


def test_a_robot_that_is_silent_for_long_is_forgotten_with_what_was_declared_for_it():
    robots = Robots()
    robots.all.heard(ROBOT, 0.0)
    robots.all.note([neighbor(3)], 20.0)
    robots.all.note([], 30.0)
    assert robots.opened == [ROBOT, 3]
    robots.all.heard(3, 30.1)
    robots.all.note([], 30.2)
    assert robots.all.get(ROBOT) is None
    assert robots.all.get(3).heard_at == 30.1
    assert robots.opened == [3, -ROBOT]
    robots.all.heard(ROBOT, 31.0)
    assert robots.opened == [3, -ROBOT, ROBOT]


def test_the_first_message_that_is_due_sets_the_alarm():
    robots = Robots()
    assert robots.all.due_at == inf
    for robot, at in ((3, 5.0), (ROBOT, 4.0)):
        known = robots.all.heard(robot, at)
        known.forwarding.heard("odom", MessageName(1, 2, 3), "item", at, leads=False)
    assert robots.all.due_at == pytest.approx(4.02)
    robots.all.get(ROBOT).election.claimed(Claim(9, 1, 0.5), 4.0)
    assert robots.all.get(ROBOT).report().leader == 9


def test_other_gateways_are_known_by_their_tokens():
    others = OtherGateways(OWN)
    for gateway in (9, 3, 5):
        others.note(Token(gateway), is_there=True)
        others.note(Token(gateway, ROBOT), is_there=True)
        others.note(Token(gateway, bridges=True), is_there=True)
    others.note(Token(5, 4), is_there=True)
    assert others.ids == [3, 5, 9]
    assert [others.rank(ROBOT, leader) for leader in (None, 9, 3)] == [2, 2, 1]
    assert (others.rank(4, None), others.rank(1, None)) == (1, 0)
    assert others.has_bridge_before(lambda robot: robot == 5)
    assert not others.has_bridge_before(lambda robot: robot == 9), "a higher id"
    assert not others.has_bridge_before(lambda robot: robot in (OWN, 1))
    for gone in (Token(5), Token(3, ROBOT), Token(5, bridges=True)):
        others.note(gone, is_there=False)
    assert others.ids == [3, 9]
    assert others.rank(ROBOT, None) == 1
    assert not others.has_bridge_before(lambda robot: robot == 5)
    assert others.has_bridge_before(lambda robot: robot == 3)


def test_it_does_not_go_before_itself():
    others = OtherGateways(OWN)
    others.note(Token(OWN, ROBOT), is_there=True)
    others.note(Token(OWN, bridges=True), is_there=True)
    assert others.rank(ROBOT, None) == 0
    assert not others.has_bridge_before(lambda _: True)


def test_last_messages_have_a_bound_and_the_key_silent_for_longest_goes_first():
    last, passed = LastValues(2 * (OVERHEAD + 10)), Passed(9)
    assert LastValues().get("a/1") is None
    last.keep("a/1", bytes(10), passed, 1.0)
    last.keep("b/1", bytes(10), passed, 2.0)
    assert last.n_bytes == 2 * (OVERHEAD + 10)
    last.keep("a/1", bytes(9), passed, 3.0)
    assert last.n_bytes == 2 * OVERHEAD + 19
    assert last.get("a/1") == (bytes(9), passed, 3.0)
    last.keep("a/2", bytes(3), passed, 4.0)
    assert last.get("b/1") is None
    assert last.keys_at("a/") == ["a/1", "a/2"]
    assert last.keys_at("a/2") == ["a/2"]
    assert last.n_bytes == 2 * OVERHEAD + 12
    for number in range(1000):
        last.keep(f"c/{number}", bytes(5), passed, 5.0)
    assert last.keys_at("") == ["c/998", "c/999"]


def test_last_messages_take_no_more_than_64_mib():
    last, large = LastValues(), bytes((1 << 20) - OVERHEAD)
    for number in range(65):
        last.keep(f"{number}", large, Passed(9), 0.0)
    assert last.n_bytes == 64 << 20
    assert last.keys_at("")[0] == "1"


def test_counters_add_up_and_move():
    counts = Counts()
    counts.add("up_put")
    counts.add("up_put", 3)
    counts.add("up_held", 2)
    counts.move("up_held", "up_left")
    assert (counts["up_put"], counts["up_held"], counts["up_left"]) == (4, 1, 1)
    assert counts.of(UP) == {**dict.fromkeys(UP, 0), "up_put": 4, "up_held": 1, "up_left": 1}
    assert counts.of(BRIDGE) == dict.fromkeys(BRIDGE, 0)
    assert counts["up_taken"] == 0


def test_names_are_remembered_for_two_seconds_each_with_its_value():
    names = NamedRecently()
    for number, at in ((1, 0.0), (2, 1.0)):
        names.add(("odom",), MessageName(5, 7, number), f"n{number}", at)
    names.add(("odom",), MessageName(5, 8, 1), "other entry", 1.0)

    def found(number, now, entry=7, key="odom"):
        return names.find((key,), MessageName(5, entry, number), now)

    assert [found(number, 2.0) for number in (1, 2, 3)] == ["n1", "n2", None]
    assert found(1, 2.0, entry=8) == "other entry"
    assert found(1, 2.0, key="scan") is None
    assert [found(number, 2.01) for number in (1, 2)] == [None, "n2"]
    assert [found(1, at, entry=8) for at in (3.0, 3.01)] == ["other entry", None]
    names.add(("odom",), MessageName(5, 7, 1), "again", 4.0)
    assert found(1, 6.0) == "again"


async def test_an_alarm_rings_once_and_by_the_earliest_time():
    rang, now = [], time.monotonic()
    alarm = Alarm(lambda: rang.append(time.monotonic() - now))
    alarm.ring_by(inf)
    alarm.ring_by(now + 40.0)
    alarm.ring_by(now + 0.1)
    alarm.ring_by(now + 0.1)
    alarm.ring_by(now + 30.0)
    await until(lambda: bool(rang))
    assert rang[0] > 0.09
    await asyncio.sleep(0.12)
    assert len(rang) == 1
    alarm.ring_by(now - 1.0)
    await until(lambda: len(rang) == 2)
    alarm.ring_by(time.monotonic() + 0.02)
    await until(lambda: len(rang) == 3)


async def test_an_alarm_that_is_set_earlier_rings_no_second_time():
    rang = []
    alarm = Alarm(lambda: rang.append(1))
    now = time.monotonic()
    for delay_s in (0.06, 0.04, 0.02):
        alarm.ring_by(now + delay_s)
    await until(lambda: bool(rang))
    await asyncio.sleep(0.1)
    assert rang == [1]


def test_a_lane_carries_out_in_order_refuses_when_full_and_counts_what_failed():
    done, may_go, has_begun = [], threading.Event(), threading.Event()
    lane = Lane("lane", 3)

    def wait():
        has_begun.set()
        may_go.wait()
        done.append(threading.current_thread())

    def fail():
        raise ValueError

    assert lane.offer(wait)
    assert has_begun.wait(20)
    assert [lane.offer(each) for each in (fail, fail, lambda: done.append(3), fail)] == [
        True, True, True, False,
    ]  # fmt: skip
    may_go.set()
    lane.close()
    assert done[1:] == [3]
    assert (done[0].name, done[0].daemon, done[0].is_alive()) == ("lane", True, False)
    assert lane.failed == 2


def test_a_lane_that_is_stuck_is_left_behind():
    may_go, has_begun = threading.Event(), threading.Event()
    lane = Lane("stuck", 1)
    lane.offer(lambda: has_begun.set() or may_go.wait())
    assert has_begun.wait(20)
    assert lane.offer(lambda: None)
    lane.close()
    may_go.set()
