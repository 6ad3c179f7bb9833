"""An operator's command is sent by one gateway, in order, and by another one if the first fails."""

from math import inf

import pytest

from sdrlinkd.fleet import Command, Commands, Fate, Order, Refusal

TWIST = b"\0\1\0\0" + bytes(48)


def take(commands, n=1, now=0.0, leads=False, op="desk", patience_s=0.0, robot=2, **more):
    command = Command(op, n, **more)
    return commands.take(robot, "cmd_vel", command, TWIST, now, patience_s, leads=leads)


def fate(name, n=1, gw=8, op="desk"):
    return Fate(gw, "cmd_vel", op, n, name)


def test_the_leader_sends_at_once_and_only_once():
    commands = Commands(7)
    order = take(commands, leads=True)
    assert isinstance(order, Order)
    assert order.id == (2, "cmd_vel", "desk", 1)
    assert take(commands, leads=True) is Refusal.AGAIN
    assert commands.due(1.0) == []


def test_an_older_one_of_the_same_operator_is_outdated():
    commands = Commands(7)
    take(commands, n=5, leads=True)
    assert take(commands, n=4, leads=True) is Refusal.OUTDATED
    assert isinstance(take(commands, n=4, leads=True, op="tablet"), Order)


def test_another_gateway_sends_what_the_leader_does_not_take():
    commands = Commands(7)
    assert take(commands, patience_s=0.02) is None
    assert commands.due_at == pytest.approx(0.07)
    assert commands.due(0.069) == []
    assert [order.id[3] for order in commands.due(0.071)] == [1]
    assert commands.due(0.2) == []


@pytest.mark.parametrize("early", [True, False])
def test_what_the_leader_takes_is_left_to_it(early):
    commands = Commands(7)
    if early:
        commands.told(2, fate("taken"), 0.0)
    assert take(commands, leads=early) is None, "it had just been the leader of another view"
    if not early:
        commands.told(2, fate("taken"), 0.01)
    assert commands.due(1.0) == []
    commands.told(2, fate("delivered"), 0.03)
    assert commands.due(1.0) == []


def test_what_the_leader_cannot_deliver_is_sent_by_the_next_while_it_is_of_use():
    commands = Commands(7)
    take(commands, ls=500.0)
    commands.told(2, fate("taken"), 0.01)
    commands.told(2, fate("unknown"), 0.2)
    assert [order.id[3] for order in commands.due(0.2)] == [1]
    take(commands, n=2, now=1.0, ls=500.0)
    commands.told(2, fate("dropped", n=2), 1.6)
    assert commands.due(2.0) == []


def test_a_command_without_a_number_is_the_leaders_alone():
    commands = Commands(7)
    assert take(commands, n=None) is None
    assert commands.due(1.0) == []
    assert isinstance(take(commands, n=None, leads=True), Order)
    assert isinstance(take(commands, n=None, leads=True), Order), "a joystick repeats itself"


def test_its_own_words_change_nothing():
    commands = Commands(7)
    take(commands)
    commands.told(2, fate("taken", gw=7), 0.01)
    assert len(commands.due(0.9)) == 1


def test_memory_is_bounded_whatever_operators_and_gateways_say():
    commands = Commands(7)
    for n in range(10_000):
        take(commands, n=n, now=n / 1e4, op=f"op{n}")
        commands.told(3, fate("taken", n=n, op="other"), n / 1e4)

    def taken(n, op, robot=2):
        return take(commands, n=n, now=1.0, op=op, leads=True, robot=robot)

    # The last 4096 commands are known, and the newest numbers of the last 256 operators.
    assert taken(5904, "op5904") is Refusal.AGAIN
    assert isinstance(taken(5903, "op5903"), Order)
    assert taken(9744, "op9745") is Refusal.OUTDATED
    assert isinstance(taken(9742, "op9743"), Order)
    # So is what was said of the last 4096 that have not come.
    assert isinstance(taken(5903, "other", robot=3), Order)
    assert taken(5904, "other", robot=3) is None


def test_a_command_is_known_for_five_seconds_and_its_number_for_longer():
    commands = Commands(7)
    take(commands, now=10.0, leads=True)
    assert take(commands, now=14.9, leads=True) is Refusal.AGAIN
    take(commands, n=2, now=14.95, leads=True)
    assert isinstance(take(commands, now=15.0, leads=True, op="tablet"), Order)
    assert take(commands, now=15.0, leads=True) is Refusal.OUTDATED
    assert take(commands, n=2, now=15.0, leads=True) is Refusal.AGAIN
    assert take(commands, n=2, now=99.0, leads=True) is Refusal.AGAIN, "however late"
    # What another one says of a forgotten command makes nobody send it.
    commands.told(2, fate("dropped"), 15.0)
    assert commands.due(99.0) == []


@pytest.mark.parametrize(("lifespan_ms", "until"), [(None, 1.0), (250.0, 0.25), (4000.0, 4.0)])
def test_a_command_that_is_held_is_sent_while_its_lifespan_lasts(lifespan_ms, until):
    more = {} if lifespan_ms is None else {"ls": lifespan_ms}
    for at, is_sent in ((until - 0.001, True), (until, False)):
        commands = Commands(7)
        take(commands, now=0.0, **more)
        assert len(commands.due(at)) == is_sent
        assert commands.due_at == inf, "nor later"


def test_the_first_that_is_due_sets_the_time_and_each_is_due_once():
    commands = Commands(7)
    assert commands.due_at == inf
    take(commands, n=1, now=0.01)
    take(commands, n=2, now=0.0)
    assert commands.due_at == pytest.approx(0.05)
    assert [order.id[3] for order in commands.due(0.05)] == [2]
    assert [order.id[3] for order in commands.due(0.061)] == [1]


@pytest.mark.parametrize(
    ("name", "due_at"), [("taken", inf), ("delivered", inf), ("unknown", 1.13), ("dropped", 1.13)]
)
def test_what_came_early_of_a_command_counts_when_it_comes(name, due_at):
    commands = Commands(7)
    commands.told(2, fate(name), 0.9)
    commands.told(3, fate(name, n=5), 0.9)
    assert take(commands, now=1.1, leads=True, patience_s=0.03) is None
    assert commands.due_at == pytest.approx(due_at)
    assert isinstance(take(commands, n=5, leads=True, now=1.1), Order), "of another robot"
    take(commands, n=6, now=1.1)
    assert commands.due_at == pytest.approx(min(due_at, 1.15))


def test_what_failed_waits_for_others_with_more_patience():
    commands = Commands(7)
    take(commands, patience_s=0.04)
    commands.told(2, fate("unknown", n=None), 0.01)
    commands.told(2, fate("dropped"), 0.2)
    assert commands.due_at == pytest.approx(0.24)
    order = commands.due(0.241)[0]
    assert (order.came_at, order.patience_s, order.cdr) == (0.0, 0.04, TWIST)


def test_a_command_that_is_forgotten_is_not_sent_any_more():
    commands = Commands(7)
    take(commands, ls=60_000.0, patience_s=9.0)
    take(commands, n=2, now=5.0)
    assert commands.due_at == pytest.approx(5.05)
