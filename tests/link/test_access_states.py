"""Access policies as tables: each transition is allowed or refused, and allowed ones occur."""

import itertools
from random import Random

import pytest

from sdrlinkd.errors import IllegalStepError
from sdrlinkd.link import AccessParams, Qos, Sensed
from sdrlinkd.link.access import (
    CSMA_STEPS,
    TDMA_STEPS,
    Wish,
    after,
    make_access,
)
from sdrlinkd.link.access.testing import AFTER
from sdrlinkd.wire import Frame
from tests.link.radios import LOCKSTEP, params

TABLES = {"csma": CSMA_STEPS, "tdma": TDMA_STEPS}


def steps_of(table):
    """Every pair of a state and an event."""
    states, happenings = ({key[i] for key in table} for i in (0, 1))
    states |= set(table.values())
    return [*itertools.product(*(sorted(each, key=str) for each in (states, happenings)))]


@pytest.mark.parametrize(
    ("policy", "state", "happens"),
    [(policy, *step) for policy, table in TABLES.items() for step in steps_of(table)],
)
def test_every_step_is_allowed_or_refused(policy, state, happens):
    table = TABLES[policy]
    if (state, happens) in table:
        assert after(table, state, happens) is table[state, happens]
        return
    with pytest.raises(IllegalStepError, match=f"{happens.name} in {state.name}"):
        after(table, state, happens)


@pytest.fixture
def taken(monkeypatch):
    """The transitions that policies take."""
    found = {policy: set() for policy in TABLES}
    for policy in TABLES:

        def spy(table, state, happens, policy=policy):
            found[policy].add((state, happens))
            return after(table, state, happens)

        monkeypatch.setattr(*AFTER[policy], spy)
    return found


def wish(at):
    return Wish(at, Qos.DEFAULT, 0.001, Sensed(at - 0.001, 0.0))


def test_robots_take_every_step_of_csma(taken):
    access = make_access(AccessParams(policy="csma", persist=0.3), 1, LOCKSTEP, 0.01, Random(1))
    for i in range(400):
        access.slot(wish(1.0 + 1e-3 * i))
        if i % 50 == 0:
            access.sent(1.0 + 1e-3 * i + 5e-3, None)
    assert taken["csma"] == set(CSMA_STEPS)


def test_robots_take_every_step_of_tdma(taken):
    """Alone, with a later robot, below an earlier one, and after that one has fallen silent."""

    def robot():
        return make_access(params("tdma", [1, 2, 3]), 2, LOCKSTEP, 0.01, Random(1))

    def frame_of(access, root, level):
        schedule = next(f for i in range(9999) if (f := begun(access, i)) is not None).schedule
        return Frame(root, level, schedule, 1000)

    def begun(access, i):
        access.slot(wish(1e-2 * i))
        return access.frame(1e-2 * i)

    above, below = frame_of(robot(), 1, 0), frame_of(robot(), 3, 0)
    follower = robot()
    follower.take_frame(1, above, 1.0)
    later = 1.0 + 16 * follower.round_s
    follower.take_frame(1, above, later)
    told = follower.frame(later)
    assert (told.root, told.level) == (1, 1)
    follower.slot(wish(60.0))
    assert follower.frame(60.0).root == 2
    root = robot()
    root.take_frame(3, below, 1.0)
    root.slot(wish(30.0))
    root.take_frame(3, below, 30.0)
    assert root.frame(30.0).root == 2
    root.take_frame(1, above, 31.0)
    root.take_frame(1, above, 31.0 + 10 * root.round_s)
    assert "1 hops away" in root.state
    assert taken["tdma"] == set(TDMA_STEPS)


AT = 5.0
MINISLOT_S = 0.004


@pytest.mark.parametrize(
    ("ended", "place"),
    [("own", 5), ("forwarded 3", 5), ("read 1", 3), ("relayed 1", 4), ("unread", 7), ("read 9", 7)],
)
def test_what_kept_the_channel_busy_tells_a_robots_mini_slot(ended, place):
    """For robot 2 of three with a message of class default: FIRST and the theory above it."""
    kind, _, src = ended.partition(" ")
    access = make_access(
        params("minislot", [1, 2, 3], minislot_s=MINISLOT_S), 2, LOCKSTEP, 0.01, Random(1)
    )
    burst_at = None
    if kind == "own":
        access.sent(AT, None)
    elif kind == "forwarded":
        access.sent(AT, int(src))
    elif kind != "unread":
        burst_at = AT - 0.01
        access.heard(int(src), burst_at, kind == "relayed")
    starts = (
        access.slot(Wish(at, Qos.DEFAULT, 0.001, Sensed(at, AT, burst_at)))
        for at in (AT + 1e-3 * i for i in range(99))
    )
    begun = next(slot.start for slot in starts if slot is not None)
    assert begun == pytest.approx(AT + (1 + place) * MINISLOT_S, abs=MINISLOT_S / 10)
