"""Robots on two airs are one team over their gateways: each message once, and never back."""

import contextlib
import threading

import msgspec
import pytest

from benchmarks.fleet.pdu_air import PduAir
from sdrlinkd.client import NoDaemonError, Publisher, RefusedError, Subscriber
from sdrlinkd.fleet import GatewayReport, Passed, encode
from sdrlinkd.process import Process, module
from tests.fleet.conftest import Router
from tests.waiting import wait_for

pytestmark = pytest.mark.slow
NEAR, FAR = (1, 7), (4, 5, 8, 9)
"""The robots of two airs; from 7 on they have gateways."""
GATEWAYS = (7, 8, 9)
CDR = b"\0\1\0\0"


def numbered(number, size=60):
    return CDR + number.to_bytes(4, "little") + bytes(size)


class Islands:
    """Daemons of robots on two airs that do not hear each other, gateways and a Zenoh router."""

    def __init__(self, folder, start_daemon, stack):
        self.folder = folder
        self.airs = {robots: stack.enter_context(PduAir(robots)) for robots in (NEAR, FAR)}
        self.router = Router(folder)
        self.router.start()
        stack.callback(self.router.stop)
        self.stack = stack
        self.start_daemon = start_daemon
        self.daemons = {}
        self.gateways = {}

    def start(self, allowed, more="", at_4=""):
        for robots, air in self.airs.items():
            for robot in robots:
                self.daemons[robot] = self.start_daemon(
                    f'auto = true\nnamespace = "robot_{robot}"\nbackend = "gnuradio"\n'
                    f'{air.settings(robot)}[fleet]\nname = "mine"\n'
                    f'connect = ["{self.router.door}"]\nbridge = {allowed}\n'
                    f'zenoh = "{self.router.file}"\n{more}{at_4 if robot == 4 else ""}'
                )
        for gateway in GATEWAYS:
            self.gateways[gateway] = self.gateway(gateway)
        wait_for(lambda: all(self.sees_all(robots) for robots in (NEAR, FAR)))
        wait_for(lambda: [self.report(each).bridges for each in GATEWAYS] == [True, True, False])
        return self

    def gateway(self, gateway):
        command = module("sdrlinkd.cli.gateway", "--config", self.daemons[gateway].config)
        log = self.folder / f"log_{gateway}"
        return self.stack.enter_context(Process(command, name=f"gateway {gateway}", log=log))

    def report(self, gateway):
        """What a gateway says of itself; None while it does not answer."""
        for answer in self.router.ask(f"sdrlink/mine/@gw/{gateway}/gateway").values():
            return msgspec.json.decode(answer.payload.to_bytes(), type=GatewayReport)
        return None

    def sees_all(self, robots):
        """Whether the gateways of an air hear all other robots on it, and see the others."""
        for gateway in set(robots) & set(GATEWAYS):
            report = self.report(gateway)
            if report is None or {*report.others} != {*GATEWAYS} - {gateway}:
                return False
            heard = {each.robot for each in report.robots if each.leader and each.score}
            if heard != {*robots} - {gateway}:
                return False
        return True

    def publish(self, robot, topic, n, first=0, every_s=0.02, **more):
        with Publisher(runtime_dir=self.daemons[robot].directory) as out:
            pause = threading.Event()
            for number in range(first, first + n):
                out.send(f"/robot_{robot}/{topic}", numbered(number), **more)
                pause.wait(every_s)


@pytest.fixture
def islands(start_daemon, tmp_path):
    """Two airs; `start` starts all programs."""
    with contextlib.ExitStack() as stack:
        yield Islands(tmp_path, start_daemon, stack)


class Hearing:
    """All messages that come to a daemon's consumers."""

    def __init__(self, daemon, topic="/*"):
        self._daemon, self._topic = daemon, topic
        self.messages = []
        self._is_over = threading.Event()
        self._is_there = threading.Event()
        self._thread = threading.Thread(target=self._collect)

    def __enter__(self):
        self._thread.start()
        assert self._is_there.wait(10)
        return self

    def __exit__(self, *_):
        self._is_over.set()
        self._thread.join()

    def numbers(self, topic):
        """The numbers of the messages of a bus topic."""
        return [int.from_bytes(each.payload[4:8], "little") for each in self.messages
                if each.topic == topic]  # fmt: skip

    def _collect(self):
        with Subscriber(self._topic, runtime_dir=self._daemon.directory) as heard:
            self._is_there.set()
            while not self._is_over.is_set():
                with contextlib.suppress(TimeoutError, NoDaemonError):
                    message = heard.receive(0.2)
                    if message is not None:
                        self.messages.append(message)


def adds_up(report):
    return report.bridge_taken == sum(report.bridge.values()) and (
        report.up_taken == sum(report.up.values())
    )


@pytest.mark.long
def test_two_airs_are_one_team(islands):
    islands.start(["odom", "sc*"])
    with Hearing(islands.daemons[4]) as far, Hearing(islands.daemons[1]) as near:
        islands.publish(1, "odom", 50)
        islands.publish(4, "odom", 50)
        islands.publish(1, "imu", 20)
        wait_for(lambda: len(far.numbers("/rx_robot_1/odom")) == 50)
        wait_for(lambda: len(near.numbers("/rx_robot_4/odom")) == 50)
        wait_for(lambda: islands.report(8).bridge["bridge_not_allowed"] >= 20)
    assert far.numbers("/rx_robot_1/odom") == near.numbers("/rx_robot_4/odom") == [*range(50)]
    assert {each.topic for each in far.messages} == {"/rx_robot_1/odom"}
    message = far.messages[-1]
    assert (message.source, message.via, message.type) == (1, 8, "nav_msgs/msg/Odometry")
    assert 0 < message.age_us < 2e6
    reports = {gateway: islands.report(gateway) for gateway in GATEWAYS}
    assert all(adds_up(each) for each in reports.values())
    # Two gateways bridge on the far air: the lower id sends, and neither puts what it hears so.
    assert reports[8].bridge["bridge_sent"] == 50
    # The other one may have found out a moment later who is on its air.
    left = reports[9].bridge["bridge_left"] + reports[9].bridge["bridge_no_daemon"]
    assert left >= 50
    assert reports[9].up["up_bridged"] == 50
    assert reports[9].bridge["bridge_sent"] == 0
    # What has come over the bridge did not go up again.
    assert (reports[7].up_taken, reports[7].up["up_put"]) == (70, 70)
    assert reports[8].up_taken == 50
    assert reports[9].up_taken == 50 + reports[9].up["up_bridged"]


@pytest.mark.long
def test_another_gateway_takes_over_and_the_last_map_comes_late(islands):
    islands.start(["odom", "map"], '[topic.map]\ndurability = "transient_local"\n')
    islands.publish(1, "map", 3)
    wait_for(lambda: islands.report(8).bridge["bridge_sent"] >= 3)
    islands.gateways[8].kill()
    with Hearing(islands.daemons[5]) as far:
        wait_for(lambda: far.numbers("/rx_robot_1/map")[-1:] == [2])
        wait_for(lambda: islands.report(9).bridges)
        islands.publish(1, "odom", 30)
        wait_for(lambda: len(far.numbers("/rx_robot_1/odom")) == 30)
    assert {each.via for each in far.messages if each.topic.endswith("odom")} == {9}
    assert adds_up(islands.report(9))


@pytest.mark.long
def test_a_daemon_that_starts_again_learns_the_topics_again(islands):
    islands.start(["odom"])
    daemon = islands.daemons[8]
    with Hearing(islands.daemons[4]) as far:
        islands.publish(1, "odom", 10)
        wait_for(lambda: len(far.numbers("/rx_robot_1/odom")) == 10)
        assert daemon.stop() == 0
        wait_for(lambda: islands.report(9).bridges)
        islands.publish(1, "odom", 10, first=10)
        wait_for(lambda: len(far.numbers("/rx_robot_1/odom")) == 20)
        daemon.at_work()
        wait_for(lambda: islands.report(8).bridges and not islands.report(9).bridges)
        islands.publish(1, "odom", 10, first=20)
        wait_for(lambda: len(far.numbers("/rx_robot_1/odom")) == 30)
    assert far.numbers("/rx_robot_1/odom") == [*range(30)]
    ways = [each.via for each in far.messages]
    assert (set(ways[:10]), set(ways[10:20]), set(ways[20:])) == ({8}, {9}, {8})
    assert all(adds_up(islands.report(gateway)) for gateway in GATEWAYS)


@pytest.mark.long
def test_a_robot_that_comes_over_is_not_sent_any_more(islands):
    islands.start(["*"])
    with Hearing(islands.daemons[4]) as far:
        islands.publish(1, "odom", 10)
        wait_for(lambda: len(far.numbers("/rx_robot_1/odom")) == 10)
        stolen = encode(Passed(gw=33, ty="nav_msgs/msg/Odometry", e=3, sq=4))
        for robot in (4, 8, 9):
            key = f"sdrlink/mine/robot_{robot}/odom"
            islands.router.session.put(key, numbered(99), attachment=stolen)
        wait_for(lambda: islands.report(8).bridge["bridge_near"] >= 3)
    assert 99 not in [n for each in {m.topic for m in far.messages} for n in far.numbers(each)]


@pytest.mark.long
def test_a_robot_takes_commands_over_a_bridge_only_from_both(islands):
    trusted = (("cmd_vel", [8]), ("imu", [1]), ("scan", [1, 8]))
    islands.start(["*"], at_4="".join(f"[topic.{name}]\nfrom = {ids}\n" for name, ids in trusted))
    with Hearing(islands.daemons[4]) as far, Hearing(islands.daemons[5]) as beside:
        for name, _ in trusted:
            islands.publish(1, name, 10)
        wait_for(lambda: len(far.numbers("/rx_robot_1/scan")) == 10)
        wait_for(lambda: len(beside.messages) == 30)
    assert {each.topic for each in far.messages} == {"/rx_robot_1/scan"}


def test_nobody_sends_for_another_robot_without_a_bridge(start_daemon):
    daemon = start_daemon('auto = true\n[fleet]\nbridge = ["scan"]\n')
    wanted = {"name": "/rx_robot_2/odom", "type": "nav_msgs/msg/Odometry"}
    with daemon.control() as control, pytest.raises(RefusedError, match="of robot 2 appear under"):
        control.ask("declare", wanted)
