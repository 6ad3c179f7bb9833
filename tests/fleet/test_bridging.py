"""Messages of robots elsewhere on their way to a real bus: under which name, and how old."""

import asyncio
import time

import pytest

from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.fleet import Keys, Passed, encode
from sdrlinkd.fleet.testing import BRIDGE, MOST_REMEMBERED, MOST_TOPICS, Bridge, Counts, Sample
from sdrlinkd.link import Overrides
from tests.fleet.beside import CDR, OWN, Daemon, Notes, until

KEYS = Keys("mine")
KIND, TEXT = "nav_msgs/msg/Odometry", "std_msgs/msg/String"
FAR, NEAR = 12, 4


class Bridged:
    """The bridge of gateway 7, whose daemon has heard for long who is on its air."""

    def __init__(self, daemon, patterns=("*",)):
        self.session, self.counts = Notes(), Counts()
        self.near, self.others = {NEAR, OWN}, []
        self.side = DaemonSide(str(daemon.folder))
        self.bridge = Bridge(
            OWN, KEYS, list(patterns), self.session, self.counts, lambda: bool(self.others),
            lambda robot: robot in self.near, daemon.setup.republished, self.side,
        )  # fmt: skip
        self.bridge.see(True, time.monotonic() - 10.0)

    def take(self, number=1, topic="odom", robot=FAR, now=None, **more):
        now = time.monotonic() if now is None else now
        self.bridge.take(Sample(*self.sample(number, topic, robot, **more)), now)

    def sample(self, number=1, topic="odom", robot=FAR, **more):
        told = {"gw": 8, "ty": KIND, "b": 1, "e": number % 256, "pn": number, "age": 1000, **more}
        key = f"sdrlink/mine/robot_{robot}/{topic}"
        return key, CDR + number.to_bytes(4, "little"), encode(Passed(**told))

    @property
    def ends(self):
        ends = self.counts.of(BRIDGE)
        assert sum(ends.values()) == self.counts["bridge_taken"]
        return {name: n for name, n in ends.items() if n}


@pytest.fixture
async def daemon(tmp_path):
    daemon = Daemon(tmp_path, '[fleet]\nname = "mine"\nbridge = ["*"]\nzenoh = "zenoh.json5"\n')
    yield daemon
    daemon.stop()


@pytest.fixture
async def bridged(daemon):
    made = Bridged(daemon)
    yield made
    made.side.close()


@pytest.fixture
async def running(bridged):
    """A bridge that runs."""
    async with bridged.side.publisher() as out:
        task = asyncio.ensure_future(bridged.bridge.run(out))
        yield bridged
        task.cancel()


async def test_each_message_is_sent_as_its_robots_with_its_series_and_age(daemon, running):
    now = time.monotonic()
    running.take(1, age=250_000, now=now - 0.5)
    running.take(2, sr=3, ty="")
    running.take(3, "text", robot=13, ty=TEXT, age=None)
    await until(lambda: len(daemon.taken) == 3)
    assert running.ends == {"bridge_sent": 3}
    assert daemon.declared == [("/rx_robot_12/odom", KIND), ("/rx_robot_13/text", TEXT)]
    told = [(name, payload[8], wishes) for name, payload, wishes, _ in daemon.taken]
    assert told == [
        ("/rx_robot_12/odom", 1, Overrides()), ("/rx_robot_12/odom", 2, Overrides(key="3")),
        ("/rx_robot_13/text", 3, Overrides()),
    ]  # fmt: skip
    ages_s = [(time.time_ns() - published_ns) / 1e9 for *_, published_ns in daemon.taken]
    for age_s, least_s in zip(ages_s, (0.75, 0.001, 0.0), strict=True):
        assert least_s <= age_s < least_s + 20
    running.take(4)
    await until(lambda: len(daemon.taken) == 4)


async def test_what_has_changed_while_a_message_waited_counts(daemon, bridged):
    bridged.take(1)
    bridged.take(2, robot=13)
    bridged.near.add(FAR)
    async with bridged.side.publisher() as out:
        task = asyncio.ensure_future(bridged.bridge.run(out))
        await until(lambda: len(daemon.taken) == 1)
        assert bridged.ends == {"bridge_sent": 1, "bridge_near": 1}
        bridged.take(3, robot=13)
        bridged.others.append(3)
        await until(lambda: bridged.ends.get("bridge_left") == 1)
        bridged.take(4, robot=13)
        assert bridged.ends["bridge_left"] == 2
        bridged.others.clear()
        bridged.take(5, robot=13)
        bridged.bridge.see(False, time.monotonic())
        await until(lambda: bridged.ends.get("bridge_no_daemon") == 1)
        task.cancel()
    assert len(daemon.taken) == 1


async def test_a_daemon_has_numbers_for_so_many_topics_and_again_after_its_restart(daemon, bridged):
    daemon.accept(*(f"/rx_robot_{FAR}/t{number}" for number in range(MOST_TOPICS + 2)))
    async with bridged.side.publisher() as out:
        task = asyncio.ensure_future(bridged.bridge.run(out))
        for number in range(MOST_TOPICS + 2):
            bridged.take(number, f"t{number}")
            await until(lambda: "bridge_waiting" not in bridged.ends)
        assert bridged.ends == {"bridge_sent": MOST_TOPICS, "bridge_refused": 2}
        bridged.take(200, "t0")
        await until(lambda: bridged.ends["bridge_sent"] == MOST_TOPICS + 1)
        bridged.bridge.see(True, time.monotonic())
        bridged.take(201, f"t{MOST_TOPICS}")
        await until(lambda: bridged.ends["bridge_refused"] == 3)
        bridged.bridge.see(False, time.monotonic())
        bridged.bridge.see(True, time.monotonic() - 3.0)
        bridged.take(202, f"t{MOST_TOPICS}")
        await until(lambda: bridged.ends["bridge_sent"] == MOST_TOPICS + 2)
        task.cancel()


async def test_what_the_daemon_refuses_or_cannot_take_is_counted(daemon, running):
    daemon.refused.add("/rx_robot_12/arm")
    running.take(1, "arm")
    running.take(2, "leg", ty="")
    await until(lambda: running.ends.get("bridge_refused") == 2)
    daemon.stop()
    running.take(3)
    await until(lambda: running.ends.get("bridge_no_daemon") == 1)
    daemon.start()


async def test_it_sends_only_once_the_daemon_has_heard_who_is_there(daemon, bridged):
    bridge, now = bridged.bridge, time.monotonic()
    assert bridge.sends
    bridged.others.append(3)
    assert not bridge.sends
    bridged.others.clear()
    bridge.see(True, now)
    assert bridge.sends, "a later report changes nothing"
    bridge.see(False, now)
    assert not bridge.sends
    bridge.see(True, now)
    assert not bridge.sends
    bridged.take(1, now=now + 2.99)
    assert bridged.ends == {"bridge_no_daemon": 1}
    bridged.take(1, now=now + 3.0)
    assert bridged.ends == {"bridge_no_daemon": 1, "bridge_waiting": 1}
    nothing = Bridged(daemon, patterns=())
    assert not nothing.bridge.sends
    nothing.take(1)
    assert nothing.ends == {"bridge_not_allowed": 1}


async def test_what_is_no_message_is_not_taken(bridged):
    for key, attachment in (
        ("sdrlink/mine/robot_12", encode(Passed(8))), ("sdrlink/mine/robot_12/odom", None),
        ("sdrlink/mine/robot_12/odom", b"junk"),
    ):  # fmt: skip
        bridged.bridge.take(Sample(key, CDR, attachment), 1.0)
    assert bridged.counts["bridge_taken"] == 0


async def test_the_last_message_of_a_topic_is_sent_once_however_long_ago(bridged):
    now = time.monotonic()
    # (seconds later, number, whether again, series)
    for later_s, number, again, series in (
        (0, 1, False, 0), (5, 1, True, 0), (6, 1, True, 1), (7, 2, True, 0), (20, 2, True, 0),
        (21, 2, False, 0), (21.5, 2, True, 0),
    ):  # fmt: skip
        bridged.take(number, again=again, sr=series, now=now + later_s)
    bridged.take(2, "scan", again=True, now=now + 22)
    assert bridged.ends == {"bridge_waiting": 5, "bridge_repeated": 3}
    nameless = encode(Passed(8, KIND, age=1, again=True))
    bridged.bridge.take(Sample("sdrlink/mine/robot_12/odom", CDR, nameless), now + 30)
    assert bridged.ends == {"bridge_waiting": 6, "bridge_repeated": 3}


async def test_the_names_of_so_many_last_messages_are_remembered(bridged):
    now = time.monotonic()
    for number in range(MOST_REMEMBERED):
        bridged.take(number, f"t{number}", now=now)
    bridged.take(9000, "t0", now=now)
    bridged.take(9001, "new", now=now)
    counts = bridged.counts
    assert counts["bridge_repeated"] == 0
    for number, topic in ((9000, "t0"), (2, "t2"), (9001, "new")):
        bridged.take(number, topic, again=True, now=now + 5)
    assert counts["bridge_repeated"] == 3
    bridged.take(1, "t1", again=True, now=now + 5)
    assert counts["bridge_repeated"] == 3


async def test_last_messages_are_asked_for_whenever_the_network_has_come(daemon, running):
    session = running.session
    session.answers = [running.sample(1, again=True), running.sample(2, "scan", again=True)]
    # Not before it is known who is on this air.
    running.bridge.see(False, 0.0)
    running.bridge.reach()
    await asyncio.sleep(0.05)
    assert session.asked == []
    running.bridge.see(True, time.monotonic() - 3.0)
    await until(lambda: len(daemon.taken) == 2)
    assert session.asked == [("sdrlink/mine/**", 2.0)]
    assert running.ends == {"bridge_sent": 2}
    running.bridge.reach()
    await until(lambda: running.ends.get("bridge_repeated") == 2)
    assert len(session.asked) == 2
    await asyncio.sleep(0.05)
    assert len(session.asked) == 2
