"""Calls over links that lose, repeat and delay: at most once, and answered if anything is."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.calls import (
    KEPT_S,
    MOST_KEPT,
    MOST_TRIES,
    RESULT_KEPT_S,
    Answerer,
    Asker,
    Key,
    Kind,
    Packet,
    Status,
)
from tests.laws import law

STEP_S = 0.02
DELAY_S = 0.05


class World:
    """Robot 2 calls robot 1, which answers each call with its body reversed after `works_s`."""

    def __init__(self, seed, loss=0.0, works_s=0.0, twice=0.0):
        self.rng = Random(seed)
        self.asker, self.answerer = Asker(7, Random(seed)), Answerer(-1e6, Random(seed))
        self.loss, self.works_s, self.twice = loss, works_s, twice
        self.now, self.on_air, self.works = 0.0, [], []
        self.executed, self.ended, self.n_sent = [], {}, 0
        self.is_out = lambda now: False

    def send(self, sent, to):
        self.n_sent += len(sent)
        for _, packet in sent:
            for _ in range(2 if self.rng.random() < self.twice else 1):
                if self.rng.random() >= self.loss and not self.is_out(self.now):
                    arrives = self.now + DELAY_S * self.rng.uniform(0.5, 3)
                    self.on_air.append((arrives, to, packet.build()))

    def run(self, seconds):
        for _ in range(round(seconds / STEP_S)):
            self.now += STEP_S
            arrived = [each for each in self.on_air if each[0] <= self.now]
            self.on_air = [each for each in self.on_air if each[0] > self.now]
            for at, to, octets in arrived:
                packet = Packet.parse(octets)
                if to == 1:
                    key = self.answerer.hear(2, packet, self.now - at, self.now)
                    if key is not None:
                        self.executed.append(key.number)
                        self.works.append((self.now + self.works_s, key, packet.body[::-1]))
                elif (ended := self.asker.hear(1, packet, self.now)) is not None:
                    self.ended[ended.number] = ended
            for work in [each for each in self.works if each[0] <= self.now]:
                self.works.remove(work)
                self.answerer.answer(work[1], Status.OK, work[2], self.now)
            for ended in self.asker.expired(self.now):
                self.ended[ended.number] = ended
            self.send(self.asker.due(self.now), 1)
            self.send(self.answerer.due(self.now), 2)


@pytest.mark.slow
@law(60)
@given(st.integers(0, 1 << 30), st.floats(0, 0.6), st.floats(0, 0.5), st.floats(0, 2))
def test_no_call_is_executed_twice_and_each_ends_once(seed, loss, twice, works_s):
    world = World(seed, loss, works_s, twice)
    numbers = []
    for i in range(20):
        numbers.append(world.asker.ask(1, "/set", bytes([i, 1, 2]), world.now))
        world.run(0.3)
    world.run(12.0)
    assert len(set(world.executed)) == len(world.executed)
    assert sorted(world.ended) == numbers
    for number, ended in world.ended.items():
        if ended.status == Status.OK:
            assert ended.body == bytes([2, 1, number - 1])
        else:
            assert ended.status == Status.TIMED_OUT


@pytest.mark.slow
def test_at_a_loss_of_a_fifth_all_of_200_calls_are_answered():
    world = World(1, loss=0.2)
    for i in range(200):
        world.asker.ask(1, "/set", bytes([i, 0]), world.now)
        world.run(0.5)
    world.run(20.0)
    assert sorted(world.executed) == sorted(world.ended) == list(range(1, 201))
    assert {ended.status for ended in world.ended.values()} == {Status.OK}
    # Nothing is sent for ever: what was acknowledged is quiet.
    before = world.n_sent
    world.run(60.0)
    assert world.n_sent == before


def test_an_outage_ends_no_result_and_no_call_that_has_the_time():
    world = World(2, works_s=10.0)
    world.is_out = lambda now: 5.0 < now < 13.0
    result = world.asker.ask(1, "/fibonacci/_action/get_result", b"ab", 0.0)
    world.run(20.0)
    assert world.ended[result].body == b"ba"
    world.is_out = lambda now: world.now < 25.0
    call = world.asker.ask(1, "/set", b"cd", world.now, timeout_s=20.0)
    slow = world.asker.ask(1, "/set", b"ef", world.now, timeout_s=2.0)
    world.run(40.0)
    assert world.ended[call].body == b"dc"
    assert world.ended[slow].status == Status.TIMED_OUT
    assert world.executed.count(call) == 1


def test_a_result_that_nobody_takes_is_kept_and_a_call_is_not():
    world = World(3)
    result = world.asker.ask(1, "/x/_action/get_result", b"", 0.0)
    call = world.asker.ask(1, "/set", b"", 0.0)

    def is_kept(number, name):
        """Whether a repeat of that request is answered and not executed."""
        return world.answerer.hear(2, Packet(Kind.REQUEST, 7, number, name), 0.1, world.now) is None

    world.run(1.0)
    world.is_out = lambda now: True
    assert len(world.answerer) == 0
    world.run(KEPT_S + 5)
    assert is_kept(result, "/x/_action/get_result")
    assert not is_kept(call, "/set")
    world.answerer.due(RESULT_KEPT_S + 10)
    assert not is_kept(result, "/x/_action/get_result")


@pytest.mark.slow
def test_a_result_comes_though_its_goal_is_long_and_the_servers_bridge_restarts():
    world = World(4, works_s=1200.0)
    result = world.asker.ask(1, "/x/_action/get_result", b"ab", 0.0)
    world.run(1000.0)
    assert world.executed == [result]
    world.answerer, world.works = Answerer(world.now, Random(5)), []
    world.run(1300.0)
    assert world.executed == [result, result], "it is asked for again"
    assert world.ended[result].body == b"ba"


def test_a_call_whose_bridge_restarts_is_not_executed_again():
    world = World(4, works_s=3.0)
    call = world.asker.ask(1, "/set", b"ab", 0.0, timeout_s=20.0)
    world.run(1.0)
    assert world.executed == [call]
    world.answerer, world.works = Answerer(world.now, Random(5)), []
    world.run(20.0)
    assert world.executed == [call]
    assert world.ended[call].status == Status.RESTARTED


def test_what_may_have_been_forgotten_is_not_executed_again():
    """An hour later, somebody plays a call that was executed, with the age that it has then."""
    answerer, asked = Answerer(0.0, Random(1)), Packet(Kind.REQUEST, 7, 1, "/set")
    key = answerer.hear(2, asked, 0.1, 1000.0)
    answerer.answer(key, Status.OK, b"", 1000.0)
    for now in range(1000, 1200):
        answerer.due(float(now))
    for age_s in (121.0, 3600.0):
        assert answerer.hear(2, asked, age_s, 1000.0 + age_s) is None
        assert answerer.due(1000.0 + age_s)[-1].packet.status == Status.RESTARTED


def test_an_answer_that_is_too_large_is_told():
    answerer = Answerer(0.0, Random(1))
    key = answerer.hear(2, Packet(Kind.REQUEST, 7, 1, "/set"), 0.0, 10.0)
    answerer.answer(key, Status.OK, bytes(100), 10.0)
    (sent,) = answerer.due(10.0)
    answerer.too_large(sent.packet, 2)
    (sent,) = answerer.due(20.0)
    assert (sent.packet.status, sent.packet.body) == (Status.TOO_LARGE, b"")


def test_a_bridge_that_has_just_started_executes_nothing_older_than_itself():
    answerer = Answerer(100.0, Random(1))
    old = Packet(Kind.REQUEST, 7, 1, "/set", age_s=4.0)
    assert answerer.hear(2, old, 0.1, 103.0) is None
    (sent,) = answerer.due(103.0)
    assert (sent.packet.kind, sent.packet.status) == (Kind.ANSWER, Status.RESTARTED)
    assert answerer.hear(2, old._replace(number=2, age_s=2.0), 0.1, 103.0) is not None
    result = old._replace(number=3, name="/x/_action/get_result")
    assert answerer.hear(2, result, 0.1, 103.0) is not None
    # A request of unknown age may be older than the bridge.
    assert answerer.hear(2, old._replace(number=4, age_s=0.0), None, 103.0) is None
    assert answerer.hear(2, old._replace(number=4, age_s=0.0), None, 170.0) is None, "refused once"
    assert answerer.hear(2, old._replace(number=5, age_s=0.0), None, 170.0) is not None


def test_calls_of_one_robot_are_bounded():
    answerer = Answerer(0.0, Random(1))
    for number in range(MOST_KEPT + 5):
        answerer.hear(2, Packet(Kind.REQUEST, 7, number, "/set"), 0.0, 10.0)
    statuses = [sent.packet.status for sent in answerer.due(10.0)]
    assert statuses == [Status.BUSY] * 5
    # A second copy of what was turned away is not executed, though there is room by now.
    answerer.answer(Key(2, 7, 0), Status.OK, b"", 10.0)
    answerer.hear(2, Packet(Kind.ACK, 7, 0), 0.0, 10.0)
    assert answerer.hear(2, Packet(Kind.REQUEST, 7, MOST_KEPT, "/set"), 0.0, 11.0) is None
    assert answerer.hear(2, Packet(Kind.REQUEST, 7, 999, "/set"), 0.0, 11.0) is not None
    assert answerer.hear(3, Packet(Kind.REQUEST, 7, 1, "/set"), 0.0, 10.0) is not None


def test_a_request_without_answer_is_sent_twelve_times_at_most():
    world = World(1, loss=1.0)
    world.asker.ask(1, "/set", b"", 0.0, timeout_s=600.0)
    world.run(300.0)
    assert world.n_sent == MOST_TRIES


@given(st.binary(max_size=60))
def test_any_octets_are_a_packet_or_none(octets):
    for each in (octets, b"\0\1\0\0" + octets):
        packet = Packet.parse(each)
        assert packet is None or Packet.parse(packet.build()) == packet


@pytest.mark.parametrize("kind", Kind)
def test_a_packet_is_read_as_it_was_built(kind):
    packet = Packet(kind, 0xFFFFFFFF, 1, "/a/b", Status.BUSY, 0.5, b"body")
    assert Packet.parse(packet.build()) == packet


def test_who_cancels_one_goal_waits_as_long_as_for_its_result_and_who_cancels_all_does_not():
    """After an outage, goals of then are not those that were meant."""
    for goal, is_long in ((b"\1" * 16, True), (bytes(16), False)):
        body = b"\0\1\0\0" + goal + bytes(8)
        packet = Packet(Kind.REQUEST, 1, 2, "/arm/go/_action/cancel_goal", body=body)
        assert (packet.is_cancel, packet.is_long) == (True, is_long)


def test_an_answer_that_comes_after_a_restart_is_acknowledged_and_no_more():
    asker = Asker(7, Random(1))
    assert asker.hear(1, Packet(Kind.ANSWER, 6, 5, body=b"late"), 0.0) is None
    (sent,) = asker.due(0.1)
    assert (sent.packet.kind, sent.packet.boot, sent.packet.number) == (Kind.ACK, 6, 5)
