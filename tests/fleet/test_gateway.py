"""Gateways, daemons and Zenoh for real: each message once, commands to robots, faults."""

import asyncio
import contextlib
import threading

import pytest

from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.fleet import FleetClient, read_passed
from sdrlinkd.process import Process, module
from tests.fleet.conftest import FIRST, ROBOT, SECOND
from tests.waiting import wait_for

pytestmark = pytest.mark.slow
CDR = b"\0\1\0\0"


def odom(number, size=60):
    return CDR + number.to_bytes(4, "little") + bytes(size)


def number_of(payload):
    return int.from_bytes(payload[4:8], "little")


@contextlib.contextmanager
def numbers_at(daemon, topic):
    """Collects the numbers of the messages that come to a daemon's consumers."""
    found, is_over = [], threading.Event()

    def collect():
        with Subscriber(topic, runtime_dir=daemon.directory) as heard:
            while not is_over.is_set():
                with contextlib.suppress(TimeoutError):
                    message = heard.receive(0.2)
                    if message is not None and not message.is_stop:
                        found.append(number_of(message.payload))

    thread = threading.Thread(target=collect)
    thread.start()
    try:
        yield found
    finally:
        is_over.set()
        thread.join()


async def waiting(operator):
    """The messages that have come to an operator's program."""
    with contextlib.suppress(TimeoutError):
        while True:
            yield await asyncio.wait_for(operator.receive(), 0.5)


async def published(fleet, n, first=0, every_s=0.02):
    with Publisher(runtime_dir=fleet.daemons[ROBOT].directory) as out:
        for number in range(first, first + n):
            out.send(f"/robot_{ROBOT}/odom", odom(number))
            await asyncio.sleep(every_s)


async def test_what_any_gateway_hears_comes_to_the_operator_once(start_fleet):
    # Without repeats, each of both misses what the other hears.
    fleet = start_fleet("[repeat]\nshare = 0.0\n")
    fleet.air.loss[ROBOT, FIRST], fleet.air.loss[ROBOT, SECOND] = 0.1, 0.25
    topic, plain = f"/rx_robot_{ROBOT}/odom", []
    watched = fleet.router.session.declare_subscriber(
        "sdrlink/mine/**", lambda sample: plain.append(number_of(sample.payload.to_bytes()))
    )
    first, second = fleet.daemons[FIRST], fleet.daemons[SECOND]
    with numbers_at(first, topic) as at_first, numbers_at(second, topic) as at_second:
        async with FleetClient(fleet.params) as operator:
            await published(fleet, 200)
            await asyncio.sleep(1.0)
            messages = [each async for each in waiting(operator)]
    watched.undeclare()
    heard = {*at_first, *at_second}
    numbers = [number_of(each.payload) for each in messages]
    assert sorted(numbers) == sorted(heard)
    assert len(heard) > max(len(at_first), len(at_second))
    reports = [fleet.report(gateway) for gateway in (FIRST, SECOND)]
    twice = sum(each.put_twice for report in reports for each in report.robots)
    assert len(plain) - len(set(plain)) == operator.duplicates <= twice
    assert set(plain) == heard
    for report, n in zip(reports, (len(at_first), len(at_second)), strict=True):
        assert report.up_taken == sum(report.up.values()) == n
        assert report.up["up_held"] == 0
    passed = messages[0].passed
    assert (messages[0].robot, messages[0].topic) == (ROBOT, "odom")
    assert passed.ty == "nav_msgs/msg/Odometry"
    assert passed.gw in (FIRST, SECOND)
    assert 0 <= passed.age < 1e6


@pytest.mark.long
async def test_a_router_that_comes_back_gets_the_last_values(start_fleet):
    fleet = start_fleet()
    await published(fleet, 5)
    fleet.router.stop()
    await asyncio.sleep(0.3)
    await published(fleet, 5, first=5)
    came = []
    fleet.router.start()
    watched = fleet.router.session.declare_subscriber(
        "sdrlink/mine/**", lambda sample: came.append(sample)
    )
    await asyncio.to_thread(wait_for, lambda: bool(came))
    await asyncio.sleep(0.5)
    watched.undeclare()
    assert [number_of(each.payload.to_bytes()) for each in came] == [9]
    assert read_passed(came[0].attachment.to_bytes()).again
    await asyncio.to_thread(wait_for, lambda: fleet.hears(FIRST) and fleet.hears(SECOND))
    for gateway in (FIRST, SECOND):
        report = fleet.report(gateway)
        assert report.up["up_away"] == 5
        assert report.up_taken == sum(report.up.values()) == 10


ALLOWED = 'down = ["cmd_vel"]\n'


async def test_a_command_reaches_the_robot_once_and_its_fate_comes_back(start_fleet):
    fleet = start_fleet(ALLOWED)
    await asyncio.to_thread(wait_for, lambda: fleet.leader is not None)
    leader, fates = fleet.leader, []
    topic = f"/rx_robot_{leader}/cmd_vel"
    with numbers_at(fleet.daemons[ROBOT], "/*") as got:
        async with FleetClient(fleet.params) as operator:
            operator.on_fate = lambda robot, fate: fates.append((robot, fate))
            await asyncio.sleep(0.3)
            for number in range(20):
                operator.command(ROBOT, "cmd_vel", odom(number), lifespan_ms=1000)
                await asyncio.sleep(0.02)
            operator.command(ROBOT, "odom", odom(99))
            await asyncio.to_thread(
                wait_for, lambda: sum(f.fate == "delivered" for _, f in fates) == 20
            )
            await asyncio.sleep(0.2)
    assert got == list(range(20)), topic
    assert {robot for robot, _ in fates} == {ROBOT}
    assert {fate.gw for _, fate in fates} == {leader}
    report, other = fleet.report(leader), fleet.report(FIRST + SECOND - leader)
    assert report.down == {**dict.fromkeys(report.down, 0), "down_sent": 20, "down_not_allowed": 1}
    assert other.down == {**dict.fromkeys(other.down, 0), "down_left": 20, "down_not_allowed": 1}


@pytest.mark.long
async def test_commands_go_on_when_the_leader_is_killed(start_fleet):
    fleet = start_fleet(ALLOWED)
    await asyncio.to_thread(wait_for, lambda: fleet.leader is not None)
    leader = fleet.leader
    with numbers_at(fleet.daemons[ROBOT], "/*") as got:
        async with FleetClient(fleet.params) as operator:
            await asyncio.sleep(0.3)
            for number in range(100):
                if number == 40:
                    fleet.gateways[leader].kill()
                operator.command(ROBOT, "cmd_vel", odom(number), lifespan_ms=1000)
                await asyncio.sleep(0.02)
            await asyncio.sleep(0.5)
    # What the leader sent as it was killed, without a word, the next one sends again.
    assert {number for number in got if got.count(number) > 1} <= set(range(38, 42))
    missing = sorted(set(range(100)) - set(got))
    assert set(missing) <= set(range(38, 90)), "again within a second"


def test_nothing_goes_down_over_an_open_network(start_daemon, tmp_path):
    daemon = start_daemon('[fleet]\ndown = ["cmd_vel"]\nconnect = ["tcp/10.0.0.1:7447"]\n')
    with Process(module("sdrlinkd.cli.gateway", "--config", daemon.config)) as process:
        assert process.wait() == 2
        assert "is open to everybody on the network; use tls/ or quic/ endpoints" in process.err()
