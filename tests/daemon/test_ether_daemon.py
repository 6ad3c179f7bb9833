"""Real daemons on a simulated air: which ones the hub accepts, and replay in the air's time."""

import time

import pytest

from backends import RadioParams
from backends.testing import protocol
from sdrlinkd.adapters import BuiltInRobot, due_messages
from sdrlinkd.client import Publisher, Subscriber
from tests.adapters.recordings import STORAGES, noisy_messages, ros2_bag
from tests.backends.hubs import RawRadio, ask, serving
from tests.daemon.ether import AIR
from tests.programs import sdrlinkd
from tests.waiting import wait_for

BLOCK_S = 0.001
HASTY = "import backends.ether.radio as radio; radio.ANSWER_MS = 100; "


def on_ether(hub, robot=1, more=""):
    """The configuration of a robot on the air of `hub`."""
    return (
        f'namespace = "robot_{robot}"\nbackend = "ether"\n{more}'
        f'[ether]\ndir = "{hub}"\n[modem]\nrate_hz = 1e6\n[link]\nbeacon_s = 0\n'
        "[clock]\nperiod_s = 0\n"
    )


def verdict(daemon):
    """The daemon's health level, and the first reason for it."""
    told = daemon.snapshot().verdict
    return told.level, (told.reasons or [""])[0]


def test_without_a_hub_a_daemon_stays_and_joins_when_there_is_one(
    start_daemon, tmp_path, tmp_path_factory
):
    """Messages from the meantime are sent then, with their true age; those too old are dropped."""
    hub = tmp_path / "hub"
    daemon = start_daemon(on_ether(hub), HASTY)
    wait_for(lambda: daemon.snapshot().carrier.state == "waiting")
    wait_for(lambda: "no hub, still trying" in daemon.log())
    level, reason = verdict(daemon)
    assert level == "DOWN"
    assert f"{hub}: no hub answers there; start one: sdrlink-ether --dir {hub}" in reason
    with Publisher(daemon.directory) as out:
        out.send("/robot_1/odom", b"\0\1\0\0odom")
        out.send("/robot_1/scan", b"\0\1\0\0scan", lifespan_ms=1)
    wait_for(lambda: daemon.snapshot().link.tx.dropped.get("tx_expired") == 1)
    with serving(hub, **AIR):
        other = start_daemon(on_ether(hub, robot=2))
        with Subscriber("/rx_robot_1/odom", directory=other.directory) as heard:
            for each in (daemon, other):
                wait_for(lambda each=each: each.snapshot().carrier.state == "up", 60)
            # Its first PDU may have been too early for the other robot.
            wait_for(lambda: daemon.snapshot().link.tx.sent == 1)
            with Publisher(daemon.directory) as out:
                out.send("/robot_1/odom", b"\0\1\0\0more")
            while heard.receive(10).payload != b"\0\1\0\0more":
                continue
        with daemon.control() as control:
            assert control.ask("check")["problems"] == []
        wait_for(lambda: "the hub is up after" in daemon.log())


@pytest.mark.long
def test_a_second_robot_of_one_id_is_refused_and_the_first_is_told(start_daemon, tmp_path_factory):
    hub = tmp_path_factory.mktemp("hub")
    with serving(hub, **AIR):
        first = start_daemon(on_ether(hub))
        wait_for(lambda: first.snapshot().carrier.state == "up", 60)
        second = start_daemon(on_ether(hub))
        wait_for(lambda: second.snapshot().carrier.state == "refused", 60)
        level, reason = verdict(second)
        assert level == "DOWN"
        assert f"robot 1 is already on this channel: process {first.pid} on " in reason
        assert "another robot_id" in reason
        wait_for(lambda: "the hub refuses the settings: " in second.log())
        told = f"requested our id 1 on this channel and was refused: process {second.pid} on "
        wait_for(lambda: told in first.snapshot().carrier.detail)
        assert first.snapshot().carrier.state == "up"
        assert list(ask(hub).nodes) == [1]
        assert first.stop(within_s=20) == 0
        # The air is free for the other robot.
        wait_for(lambda: second.snapshot().carrier.state == "up", 20)


class Conductor(RawRadio):
    """A third robot, without which time does not advance; it records when the air is in use."""

    def __init__(self, folder):
        super().__init__(folder)
        self.ask(
            protocol.Hello(
                version=protocol.VERSION, node=3, who="the conductor",
                rate_hz=AIR["rate_hz"], frequency_hz=AIR["frequency_hz"],
            )
        )  # fmt: skip
        self._token = self.hear(protocol.Welcome).token
        self.busy = []
        """Steps at which a robot began to send."""

    def play(self, until_s, pause):
        """Let time advance; calls `pause` whenever a robot has begun to send."""
        step, was_busy = 0, False
        self.push(protocol.Done(token=self._token, step=0))
        while step * BLOCK_S < until_s:
            assert self._down.poll(60_000)
            data, *samples = self._down.recv_multipart()
            message = protocol.from_hub(data)
            if not isinstance(message, protocol.Stretch):
                continue
            if samples and not was_busy:
                self.busy.append(message.step)
                pause()
            step, was_busy = message.step, bool(samples)
            self.push(protocol.Done(token=self._token, step=step))


@pytest.mark.realtime
def test_what_is_planned_leaves_at_its_time_by_the_airs_clock(start_daemon, tmp_path_factory):
    hub = tmp_path_factory.mktemp("hub")
    plan = list(due_messages(BuiltInRobot("robot_1", 0.5, 1), 0.5, 0.3, {"/robot_1/cmd_vel": 3}))
    radios = dict.fromkeys((1, 2, 3), RadioParams())
    play = "[play]\nduration_s = 0.5\nbegin_s = 0.3\nwait_for_consumer = true\n"
    air = AIR | {"block_s": BLOCK_S}
    with serving(hub, radios, paced=False, until_s=1.0, **air), Conductor(hub) as conductor:
        sender = start_daemon(on_ether(hub, 1, 'topics = ["cmd_vel"]\n') + play)
        receiver = start_daemon(on_ether(hub, 2))
        wait_for(lambda: set(ask(hub).nodes) == {1, 2, 3}, 60)
        with Subscriber("/rx_robot_1/*", directory=receiver.directory) as heard:
            # Replay waits for its first consumer, and the air waits for the replaying daemon.
            with Subscriber(directory=sender.directory):
                # A pause of the air, longer than a burst, must not age messages.
                conductor.play(0.9, lambda: time.sleep(0.05))
                got = [heard.receive(20) for _ in plan]
            tx = sender.snapshot().link.tx
            assert heard.receive(0) is None
    assert [message.payload for message in got] == [due.payload for due in plan]
    assert [message.topic for message in got] == ["/rx_robot_1/cmd_vel"] * 5
    assert (tx.accepted, tx.sent, tx.dropped) == (5, 5, {})
    began = [step * BLOCK_S for step in conductor.busy]
    assert [due.at for due in plan] == [pytest.approx(0.3 + i / 10) for i in range(5)]
    for due, at in zip(plan, began, strict=True):
        assert 0 < at - due.at < 0.005
    ages_ms = [message.age_us * 1e-3 for message in got]
    # A burst takes 12 ms; events are noticed at the end of their block.
    assert all(10 < age_ms < 20 for age_ms in ages_ms), ages_ms
    assert max(ages_ms) - min(ages_ms) <= 1.01, ages_ms


@pytest.mark.parametrize("storage", STORAGES)
def test_a_daemon_plays_the_topics_of_a_bag_that_it_knows(start_daemon, tmp_path, storage):
    written = noisy_messages(5, 30)
    bag = ros2_bag(tmp_path / "bag", STORAGES[storage], written)
    registry = tmp_path / "odom.csv"
    registry.write_text("odom,nav_msgs/Odometry\n")
    node = start_daemon(
        f'namespace = ""\nrobot_id = 1\nregistry = "{registry}"\n'
        f'[play]\nbag = "{bag}"\nduration_s = 10.0\nwait_for_consumer = true\n'
        "[topic.odom]\ndepth = 0\n"
    )
    expected = [cdr for topic, _, _, cdr in written if topic == "/odom"]
    with Subscriber(directory=node.directory) as heard:
        got = [heard.receive(20) for _ in expected]
        assert [message.payload for message in got] == expected
    assert node.snapshot().link.tx.accepted == len(expected) == 20


@pytest.mark.slow
def test_a_bag_that_cannot_be_played_is_refused_in_one_line(write_config, tmp_path):
    config = write_config(tmp_path, '[play]\nbag = "none.mcap"\nduration_s = 1.0\n')
    with sdrlinkd("--config", config) as daemon:
        assert daemon.wait() == 2
    assert "none.mcap: no such file" in daemon.err()
    assert daemon.err().count("\n") == 1
