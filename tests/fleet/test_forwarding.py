"""Of several gateways that hear a message, one puts it; none is lost, and late ones are learnt."""

from math import inf
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.client import MessageName
from sdrlinkd.fleet import Duplicates, Forwarding, Turn
from tests.laws import law

STEP_S = 0.0005


class Gateways:
    """Gateways that hear messages of one robot by chance; puts arrive after `delay_s()`."""

    def __init__(self, heard_of, delay_s, leader=0):
        self.heard_of = heard_of
        self.delay_s = delay_s
        self.leader = leader
        self.now = 0.0
        self.each = [Forwarding() for _ in heard_of]
        for gateway, forwarding in enumerate(self.each):
            forwarding.rank = max(0, gateway - 1) if leader == 0 else gateway
        self.puts = []
        """(time, gateway, message)."""
        self.n_left = 0
        """Copies dropped because another gateway had put the message."""
        self._in_flight = []

    def run(self, until):
        while self.now < until:
            self.now += STEP_S
            arrived = [each for each in self._in_flight if each[0] <= self.now]
            self._in_flight = [each for each in self._in_flight if each[0] > self.now]
            for _, gateway, src, number in arrived:
                is_led = src == self.leader
                self.n_left += self.each[gateway].passed(
                    "odom", name_of(number), self.now, by_leader=is_led
                )
            for gateway, forwarding in enumerate(self.each):
                for number in forwarding.due(self.now):
                    self.put(gateway, number)

    def put(self, src, number):
        self.puts.append((self.now, src, number))
        for gateway in range(len(self.each)):
            if gateway != src:
                self._in_flight.append((self.now + self.delay_s(), gateway, src, number))

    def send(self, number, rng):
        heard = [gw for gw, p in enumerate(self.heard_of) if rng.random() < p]
        for gateway in heard:
            forwarding = self.each[gateway]
            leads = gateway == self.leader
            turn = forwarding.heard("odom", name_of(number), number, self.now, leads=leads)
            if turn is Turn.OURS:
                self.put(gateway, number)
        return heard


def name_of(number):
    return MessageName(7, number % 256, number, number % 3)


def run(gateways, n=600, every_s=0.01, seed=1):
    """Send `n` messages; returns the numbers of those that at least one gateway heard."""
    rng, heard = Random(seed), set()
    for number in range(0, 5 * n, 5):
        if gateways.send(number, rng):
            heard.add(number)
        gateways.run(gateways.now + every_s)
    gateways.run(gateways.now + 1.0)
    return heard


def test_two_that_hear_most_put_all_of_it_once():
    gateways = Gateways([0.94, 0.78], lambda: 0.0004)
    heard = run(gateways)
    assert sorted(number for *_, number in gateways.puts) == sorted(heard)
    assert len(heard) / 600 == pytest.approx(1 - 0.06 * 0.22, abs=0.01)
    second = gateways.each[1]
    assert second.put_for_others == sum(gateway == 1 for _, gateway, _ in gateways.puts)
    assert gateways.n_left > 400


def test_what_the_leader_missed_is_little_later():
    gateways = Gateways([0.5, 1.0], lambda: 0.0004)
    rng = Random(3)
    late = []
    for number in range(0, 3000, 5):
        sent_at = gateways.now
        gateways.send(number, rng)
        gateways.run(gateways.now + 0.03)
        if number > 500:
            late += [
                at - sent_at for at, gateway, n in gateways.puts if (gateway, n) == (1, number)
            ]
    assert max(late) < 0.004


def test_a_copy_is_held_for_longer_where_the_leader_is_far():
    rng = Random(5)
    gateways = Gateways([0.9, 0.9], lambda: rng.uniform(0.04, 0.06))
    run(gateways)
    assert 0.06 < gateways.each[1].hold_s < 0.1
    twice = len(gateways.puts) - len({number for *_, number in gateways.puts})
    assert twice <= 20
    assert twice == gateways.each[1].put_twice


def test_over_a_steady_network_it_is_held_for_little_longer_than_the_leader_needs():
    rng = Random(7)
    gateways = Gateways([0.9, 0.9], lambda: rng.uniform(0.08, 0.082))
    run(gateways)
    assert 0.08 < gateways.each[1].hold_s < 0.085
    # At first, nobody knows how slow it is.
    assert gateways.each[1].put_twice <= 20


@pytest.mark.parametrize(("delay_s", "most_s"), [(0.1, 1.0), (0.3, 0.5)])
def test_after_a_message_was_put_twice_copies_are_held_for_twice_as_long(delay_s, most_s):
    """What the leader's put took is learnt as ever; `most_s` bounds what comes of it."""
    early, patient = Forwarding(), Forwarding()
    for each in (early, patient):
        each.heard("odom", name_of(0), "a", 0.0, leads=False)
    assert early.due(early.due_at) == ["a"]
    assert not early.passed("odom", name_of(0), delay_s, by_leader=True)
    assert patient.passed("odom", name_of(0), delay_s, by_leader=True), "dropped in time"
    assert (early.put_twice, patient.put_twice) == (1, 0)
    assert early.hold_s == pytest.approx(min(most_s, 2 * patient.hold_s))


def test_a_second_put_of_another_that_waits_says_nothing_of_the_leader():
    forwarding = Forwarding()
    before_s = forwarding.hold_s
    forwarding.heard("odom", name_of(0), "a", 0.0, leads=False)
    forwarding.due(1.0)
    forwarding.passed("odom", name_of(0), 1.1, by_leader=False)
    assert (forwarding.put_twice, forwarding.hold_s) == (1, before_s)


def test_those_that_wait_for_the_leader_do_not_learn_from_each_other():
    rng = Random(6)
    gateways = Gateways([0.7, 0.8, 0.8, 0.8], lambda: rng.uniform(0.0002, 0.001))
    heard = run(gateways, 1500)
    assert all(each.hold_s <= 0.003 for each in gateways.each[1:])
    assert len(gateways.puts) == len(heard), "in order, so each sees the put before"


def test_without_a_leader_nothing_is_lost():
    gateways = Gateways([0.9, 0.8, 0.3], lambda: 0.001, leader=None)
    heard = run(gateways)
    assert {number for *_, number in gateways.puts} == heard


def test_who_leads_from_now_on_puts_what_it_held():
    forwarding = Forwarding()
    assert forwarding.heard("odom", name_of(0), "a", 0.0, leads=False) is Turn.LATER
    assert forwarding.lead() == ["a"]
    assert forwarding.due(1.0) == []


def test_who_leads_from_now_on_may_hold_only_what_others_have_put():
    forwarding = Forwarding()
    for number in range(3):
        forwarding.heard("odom", name_of(number), "a", 0.0, leads=False)
        forwarding.passed("odom", name_of(number), 0.001, by_leader=True)
    assert forwarding.lead() == []
    assert forwarding.due_at == float("inf")


@pytest.mark.parametrize("leads", [True, False])
def test_what_comes_once_more_is_not_put_again(leads):
    forwarding = Forwarding()
    forwarding.heard("odom", name_of(0), "a", 0.0, leads=leads)
    assert forwarding.heard("odom", name_of(0), "a", 0.1, leads=leads) is Turn.PAST
    assert forwarding.lead() == ([] if leads else ["a"])


def test_stop_messages_have_no_name_and_only_the_leader_puts_them():
    forwarding = Forwarding()
    assert forwarding.heard("cmd_vel", None, "stop", 0.0, leads=False) is Turn.OTHERS
    assert forwarding.heard("cmd_vel", None, "stop", 0.0, leads=True) is Turn.OURS
    assert forwarding.due(9.0) == []


def test_each_one_before_it_makes_a_gateway_wait_as_long_again_as_a_put_takes():
    forwarding = Forwarding()
    assert (forwarding.hold_s, forwarding.due_at) == (0.02, inf)
    for rank, due_at in ((0, 1.02), (1, 1.03), (3, 1.05)):
        forwarding.rank = rank
        name = name_of(5 * rank)
        assert forwarding.heard("odom", name, rank, 1.0, leads=False) is Turn.LATER
        assert forwarding.due(due_at - 0.001) == []
        assert forwarding.due_at == pytest.approx(due_at)
        assert forwarding.due(due_at + 0.001) == [rank]
    assert forwarding.put_for_others == 3


def delays(*delays_s):
    """What a gateway has learnt of a leader whose puts took so long."""
    forwarding = Forwarding()
    for number, delay_s in enumerate(delays_s):
        name, at = name_of(5 * number), 10.0 * number
        forwarding.heard("odom", name, number, at, leads=False)
        forwarding.passed("odom", name, at + delay_s, by_leader=True)
    return forwarding


@pytest.mark.parametrize(
    ("delays_s", "hold_s"),
    [
        ([0.01], 0.011),  # and a margin of 1 ms
        ([0.0001], 0.002),  # never less
        ([0.0012], 0.002),
        ([0.0015], 0.00225),  # a margin is at most half of it
        ([0.6], 0.5),  # nor more
        ([0.01] * 39 + [0.04] * 61, 0.041),
        ([0.01] * 40 + [0.016] * 5, 0.022),  # 6 ms from the middle to the slow ones
        ([0.01] * 40 + [0.1] * 5, 0.15),
        ([0.01] * 40 + [0.1], 0.011),  # one of many says nothing
        ([0.2] * 10 + [0.01] * 60, 0.011),  # what was long ago is forgotten
        ([0.2] * 10 + [0.01] * 59, 0.3),
    ],
)
def test_how_long_to_wait_is_learnt_from_the_leaders_last_puts(delays_s, hold_s):
    assert delays(*delays_s).hold_s == pytest.approx(hold_s)


def test_the_time_between_two_in_line_is_learnt_too():
    forwarding = delays(0.01, 0.01)
    forwarding.rank = 2
    forwarding.heard("odom", name_of(90), "a", 50.0, leads=False)
    assert forwarding.due_at == pytest.approx(50.0 + 0.011 + 0.02)


def test_what_came_from_zenoh_first_is_left_and_the_leaders_teaches():
    forwarding = Forwarding()
    assert not forwarding.passed("odom", name_of(0), 1.0, by_leader=False)
    assert forwarding.heard("odom", name_of(0), "a", 1.1, leads=True) is Turn.OTHERS
    assert forwarding.hold_s == 0.02
    assert not forwarding.passed("odom", name_of(5), 1.0, by_leader=True)
    assert forwarding.heard("odom", name_of(5), "a", 1.1, leads=False) is Turn.OTHERS
    assert forwarding.hold_s == 0.002, "the put took no time"
    assert forwarding.heard("odom", name_of(5), "a", 1.2, leads=False) is Turn.PAST
    assert (forwarding.due_at, forwarding.put_twice) == (inf, 0)


def test_a_second_put_of_the_same_message_changes_nothing():
    forwarding = Forwarding()
    forwarding.heard("odom", name_of(0), "a", 1.0, leads=False)
    forwarding.heard("odom", name_of(5), "b", 1.005, leads=False)
    assert forwarding.passed("odom", name_of(0), 1.01, by_leader=True)
    assert not forwarding.passed("odom", name_of(0), 1.2, by_leader=True)
    assert not forwarding.passed("odom", None, 1.2, by_leader=True)
    assert forwarding.hold_s == pytest.approx(0.011)
    assert forwarding.due_at == pytest.approx(1.025), "that of the one still held"
    assert forwarding.due(1.025) == ["b"]
    assert forwarding.due_at == inf


def test_the_leader_notices_that_another_put_its_message_too():
    forwarding = Forwarding()
    assert forwarding.heard("odom", name_of(0), "a", 1.0, leads=True) is Turn.OURS
    for now in (1.01, 1.02):
        assert not forwarding.passed("odom", name_of(0), now, by_leader=False)
        assert (forwarding.put_twice, forwarding.put_for_others) == (1, 0)
    assert (forwarding.hold_s, forwarding.due_at) == (0.02, inf)


def test_a_message_is_known_for_two_seconds_whoever_told_of_it():
    forwarding = Forwarding()
    assert not forwarding.is_known("odom", name_of(0), 1.0)
    forwarding.heard("odom", name_of(0), "a", 1.0, leads=True)
    forwarding.passed("odom", name_of(5), 1.0, by_leader=True)
    known = [
        [forwarding.is_known(topic, name_of(number), now) for number in (0, 5)]
        for topic, now in (("odom", 3.0), ("scan", 3.0), ("odom", 3.1))
    ]
    assert known == [[True, True], [False, False], [False, False]]


@law(60)
@given(
    st.lists(st.floats(0.1, 1.0), min_size=1, max_size=4), st.integers(0, 2**32),
    st.floats(0.0, 0.3), st.sampled_from((None, 0)),
)  # fmt: skip
def test_any_delays_lose_nothing_and_no_gateway_puts_twice(heard_of, seed, most_s, leader):
    rng = Random(seed)
    gateways = Gateways(heard_of, lambda: rng.uniform(0, most_s), leader)
    heard = run(gateways, 40, seed=seed)
    assert {number for *_, number in gateways.puts} == heard
    by = [(gateway, number) for _, gateway, number in gateways.puts]
    assert len(by) == len(set(by))
    consumer = Duplicates()
    taken = [n for at, _, n in sorted(gateways.puts) if consumer.is_new(("odom",), name_of(n), at)]
    assert sorted(taken) == sorted(heard)
    assert consumer.dropped == len(gateways.puts) - len(heard)


def test_names_are_forgotten_after_their_time():
    consumer = Duplicates()
    assert consumer.is_new(("odom",), name_of(3), 0.0)
    assert not consumer.is_new(("odom",), name_of(3), 1.9)
    assert consumer.is_new(("scan",), name_of(3), 1.9)
    assert consumer.is_new(("odom",), name_of(3), 4.0)
    assert consumer.is_new(("odom",), None, 4.0)
    assert consumer.is_new(("odom",), None, 4.0)
