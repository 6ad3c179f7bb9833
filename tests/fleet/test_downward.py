"""Commands on their way to a real bus: what is taken, what the daemon makes of it, what is said."""

import asyncio
import time
from math import inf

import pytest

from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.fleet import Command, Fate, Keys, Passed, TopicKey, encode, read_fate
from sdrlinkd.fleet.testing import DOWN, Counts, DownwardCommands, Sample
from sdrlinkd.link import Overrides, Qos
from tests.fleet.beside import CDR, OWN, ROBOT, Daemon, Notes, until

KEYS = Keys("mine")
TWIST, TEXT = "geometry_msgs/msg/Twist", "std_msgs/msg/String"
CMD_VEL = 3
AT = "sdrlink/mine/@sent/robot_2"


class Downwards:
    """What gateway 7 sends to robot 2, and says of it."""

    def __init__(self, daemon=None, patterns=("cmd_vel", "odom", "arm", "leg")):
        self.session, self.counts = Notes(), Counts()
        folder = None if daemon is None else str(daemon.folder)
        self.side = DaemonSide(folder or "/nowhere")
        self.down = DownwardCommands(
            OWN, KEYS, list(patterns), self.session, self.counts, lambda topic: f"/robot_7/{topic}",
            self.side,
        )  # fmt: skip

    def take(self, n=1, topic="cmd_vel", score=1.0, now=10.0, leads=True, **more):
        told = encode(Command("desk", n, **more))
        sample = Sample(f"sdrlink/mine/robot_2/{topic}", CDR, told)
        return self.down.take(sample, score, now, leads=leads)

    def told(self, fate, now, n=1, key=AT, gw=8):
        self.down.told(Sample(key, encode(Fate(gw, "cmd_vel", "desk", n, fate)), None), now)

    @property
    def ends(self):
        ends = self.counts.of(DOWN)
        assert sum(ends.values()) == self.counts["down_taken"]
        return {name: n for name, n in ends.items() if n}

    @property
    def said(self):
        """(number, fate, reason) of what it has said."""
        assert {key for key, *_ in self.session.puts} <= {AT}
        assert {put[2:] for put in self.session.puts} <= {(None, "urgent")}
        fates = [read_fate(payload) for _, payload, *_ in self.session.puts]
        assert {(fate.gw, fate.op) for fate in fates} <= {(OWN, "desk")}
        return [(fate.n, fate.fate, fate.reason) for fate in fates]


def test_each_command_is_counted_under_one_name():
    downs = Downwards()
    order = downs.take()
    assert (order.id, order.cdr) == ((ROBOT, "cmd_vel", "desk", 1), CDR)
    assert order.command == Command("desk", 1)
    assert downs.counts["down_taken"] == 1
    assert downs.take() is downs.take(0) is downs.take(2, "map") is downs.take(3, "%2F%2F") is None
    assert downs.take(3, score=None) is downs.take(4, leads=False) is None
    unreadable = Sample("sdrlink/mine/robot_2/odom", CDR, b"junk")
    assert downs.down.take(unreadable, 1.0, 10.0, leads=True) is None
    # Neither a message of a gateway nor another key is a command.
    passed = Sample("sdrlink/mine/robot_2/odom", CDR, encode(Passed(8)))
    for other in (passed, Sample("sdrlink/mine/robot_2", CDR, None)):
        assert downs.down.take(other, 1.0, 10.0, leads=True) is None
    # The one that was taken is not counted until the daemon has it.
    downs.counts.add("down_sent")
    assert downs.ends == {
        "down_sent": 1, "down_again": 1, "down_outdated": 1, "down_not_allowed": 2, "down_left": 2,
        "down_unreadable": 1,
    }  # fmt: skip


@pytest.mark.parametrize(("score", "hold_s"), [(1.0, 0.05), (1.1, 0.05), (0.4, 0.08), (-0.0, 0.1)])
def test_who_hears_the_robot_less_well_waits_longer(score, hold_s):
    downs = Downwards()
    assert downs.down.due_at == inf
    assert downs.take(leads=False, score=score) is None
    assert downs.ends == {"down_left": 1}
    assert downs.down.due_at == pytest.approx(10.0 + hold_s)
    assert downs.down.take_due(10.0 + hold_s - 0.001) == []
    assert [order.id[3] for order in downs.down.take_due(10.0 + hold_s + 0.001)] == [1]
    assert downs.counts["down_left"] == 0


def test_what_others_say_of_a_command_counts_and_what_strangers_say_does_not():
    downs = Downwards()
    for n in (1, 2, 3):
        downs.take(n, leads=False)
    downs.told("taken", 10.01)
    downs.told("taken", 10.01, 2, key="sdrlink/mine/@sent/robot_x")
    downs.told("taken", 10.01, 3, gw=OWN)
    downs.down.told(Sample(AT, b"junk", None), 10.01)
    assert [order.id[3] for order in downs.down.take_due(10.1)] == [2, 3]


def test_a_message_of_a_node_is_a_command_like_any_other():
    downs = Downwards()
    told = TopicKey(ROBOT, "arm")
    order = downs.down.take_command(told, Command("ab", 3, TEXT), CDR, 1.0, 10.0, leads=True)
    assert order.id == (ROBOT, "arm", "ab", 3)
    assert downs.down.take_command(told, None, CDR, 1.0, 10.0, leads=True) is None
    assert downs.counts["down_unreadable"] == 1


async def test_without_a_daemon_the_fate_says_so():
    downs = Downwards()
    await downs.down.send(downs.take(), 10.0)
    downs.side.close()
    assert downs.said == [(1, "dropped", "daemon_gone")]
    assert downs.ends == {"down_no_daemon": 1}


@pytest.fixture
async def daemon(tmp_path):
    daemon = Daemon(tmp_path)
    yield daemon
    daemon.stop()


@pytest.fixture
def downs(daemon):
    made = Downwards(daemon)
    yield made
    made.side.close()


async def test_the_daemon_gets_each_command_and_its_receipts_become_fates(daemon, downs):
    async with downs.side.publisher() as out, asyncio.TaskGroup() as group:
        following = group.create_task(downs.down.follow(out))
        await asyncio.sleep(0)
        for n, more in ((1, {}), (2, {"q": "bulk", "ls": 2000.0, "ty": TWIST})):
            order = downs.take(n, now=time.monotonic() - 0.5, **more)
            await downs.down.send(order, time.monotonic())
        await until(lambda: len(daemon.taken) == 2)
        (first, second) = daemon.taken
        assert first[:2] == ("/robot_7/cmd_vel", CDR)
        assert first[2] == Overrides(dst=ROBOT, receipt=first[2].receipt)
        wishes = second[2]
        assert wishes == Overrides(Qos.BULK, dst=ROBOT, lifespan_s=2.0, receipt=wishes.receipt)
        # A command's age counts from when it came to the gateway.
        for published_ns in (first[3], second[3]):
            assert 0.5 <= (time.time_ns() - published_ns) / 1e9 < 30
        assert downs.said == [(1, "taken", ""), (2, "taken", "")]
        assert downs.ends == {"down_sent": 2}
        daemon.tell("stranger.1", CMD_VEL, "delivered")
        daemon.tell(second[2].receipt, CMD_VEL, "dropped", "tx_expired")
        daemon.tell(first[2].receipt, CMD_VEL, "delivered", "", 0.5)
        await until(lambda: len(downs.said) == 4)
        assert downs.said[2:] == [(2, "dropped", "tx_expired"), (1, "delivered", "")]
        # The next one wakes it up again.
        await asyncio.sleep(0.6)
        await downs.down.send(downs.take(3, now=time.monotonic()), time.monotonic())
        await until(lambda: len(daemon.taken) == 3)
        daemon.tell(daemon.taken[2][2].receipt, CMD_VEL, "delivered")
        await until(lambda: (3, "delivered", "") in downs.said)
        following.cancel()


async def test_a_topic_that_the_daemon_does_not_know_is_declared_by_its_type(daemon, downs):
    async with downs.side.publisher() as out, asyncio.TaskGroup() as group:
        following = group.create_task(downs.down.follow(out))
        await asyncio.sleep(0)
        for n, more in ((1, {}), (2, {"ty": TEXT})):
            now = time.monotonic()
            await downs.down.send(downs.take(n, "arm", now=now, **more), now)
        await until(lambda: len(daemon.taken) == 1)
        assert daemon.declared == [("/robot_7/arm", TEXT)]
        daemon.refused.add("/robot_7/leg")
        now = time.monotonic()
        await downs.down.send(downs.take(3, "leg", now=now, ty=TEXT), now)
        assert [(n, fate) for n, fate, _ in downs.said] == [
            (1, "taken"), (1, "dropped"), (2, "taken"), (3, "taken"), (3, "dropped"),
        ]  # fmt: skip
        assert "not this one" in downs.said[4][2]
        reason = downs.said[1][2]
        assert "/robot_7/arm" in reason
        assert len(reason) <= 120
        assert downs.ends == {"down_sent": 1, "down_refused": 2}
        following.cancel()


@pytest.mark.parametrize("lifespan_ms", [0.001, 200.0])
async def test_a_command_waits_for_a_daemon_that_is_away_no_longer_than_it_lasts(
    daemon, downs, lifespan_ms
):
    async with downs.side.publisher() as out, asyncio.TaskGroup() as group:
        following = group.create_task(downs.down.follow(out))
        await asyncio.sleep(0)
        daemon.stop()
        now = time.monotonic()
        await downs.down.send(downs.take(now=now, ls=lifespan_ms), now)
        assert downs.said == [(1, "taken", ""), (1, "dropped", "daemon_gone")]
        assert downs.ends == {"down_no_daemon": 1}
        following.cancel()
    daemon.start()
