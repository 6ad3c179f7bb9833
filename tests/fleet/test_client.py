"""An operator's program: each message once, its commands and their fates, and what gateways say."""

import asyncio

import pytest

from sdrlinkd.config import FleetParams
from sdrlinkd.fleet import Command, Fate, FleetClient, Passed, encode, read_command
from sdrlinkd.fleet.testing import MOST_MESSAGES
from tests.fleet.beside import CDR, ROBOT, Network, until

ODOM = "sdrlink/mine/robot_2/odom"
KIND = "nav_msgs/msg/Odometry"


class Operator:
    """A program of the product that routes, and a plain node in place of the gateways."""

    def __init__(self, folder):
        self.network = Network()
        params = FleetParams(name="mine", listen=[self.network.endpoint])
        self.client = FleetClient(params, folder)
        self.fates = []
        self.client.on_fate = lambda robot, fate: self.fates.append((robot, fate))

    def put(self, number, key=ODOM, **told):
        passed = Passed(**{"gw": 8, "ty": KIND, "b": 1, "e": number % 256, "pn": number, **told})
        self.network.far.put(key, CDR + number.to_bytes(4, "little"), attachment=encode(passed))


@pytest.fixture
async def operator(tmp_path):
    operator = Operator(tmp_path)
    async with operator.client:
        await operator.network.join("sdrlink/**")
        yield operator
        await operator.network.part()


async def test_each_message_comes_once_and_only_messages_do(operator):
    far, client = operator.network.far, operator.client
    operator.put(1)
    operator.put(1, gw=9)
    operator.put(1, sr=1)
    operator.put(1, ODOM.replace("odom", "scan"))
    operator.put(1, ODOM.replace("mine", "other"))
    operator.put(1, "sdrlink/mine/robot_2")
    far.put(ODOM, CDR)
    far.put(ODOM, CDR, attachment=encode(Command("desk", 1)))
    operator.put(2, age=5)
    messages = []
    async with asyncio.timeout(10):
        async for each in client:
            messages.append(each)
            if len(messages) == 4:
                break
    assert [(each.robot, each.topic, each.passed.sr) for each in messages] == [
        (ROBOT, "odom", 0), (ROBOT, "odom", 1), (ROBOT, "scan", 0), (ROBOT, "odom", 0),
    ]  # fmt: skip
    assert messages[3].payload == CDR + b"\2\0\0\0"
    assert messages[3].passed == Passed(8, KIND, 1, 2, 2, age=5)
    assert (client.duplicates, client.overrun) == (1, 0)


async def test_what_nobody_takes_in_time_is_dropped_the_oldest_first(operator):
    for number in range(MOST_MESSAGES + 3):
        operator.put(number)
    await until(lambda: operator.client.overrun == 3)
    first = await operator.client.receive()
    assert first.payload == CDR + b"\3\0\0\0"


async def test_commands_have_numbers_and_their_fates_come_back(operator):
    client, network = operator.client, operator.network
    assert client.command(ROBOT, "cmd_vel", CDR) == 0
    assert client.command(ROBOT, "a b", CDR, kind=KIND, qos="bulk", lifespan_ms=5.0) == 1
    await until(lambda: len(network.came) == 2)
    told = {str(each.key_expr): each for each in network.came}
    first, second = told["sdrlink/mine/robot_2/cmd_vel"], told["sdrlink/mine/robot_2/a%20b"]
    commands = [read_command(each.attachment.to_bytes()) for each in (first, second)]
    name = commands[0].op
    assert len(name) == 8
    assert commands == [Command(name, 0), Command(name, 1, KIND, "bulk", 5.0)]
    assert first.payload.to_bytes() == CDR
    assert (int(first.priority), int(second.priority)) == (1, 7)
    mine, other = (Fate(8, "cmd_vel", op, 0, "taken") for op in (name, "other"))
    for key, payload in (
        ("robot_2", encode(other)), ("robot_x", encode(mine)), ("robot_2", b"junk"),
        ("robot_2", encode(mine)),
    ):  # fmt: skip
        network.far.put(f"sdrlink/mine/@sent/{key}", payload)
    await until(lambda: bool(operator.fates))
    assert operator.fates == [(ROBOT, mine)]


async def test_gateways_are_asked_for_what_they_know(operator):
    far = operator.network.far

    def reply(query):
        for key in ("@gw/7/status", "@gw/8/status", "@gw/x/status"):
            query.reply(f"sdrlink/mine/{key}", key.encode())

    served = far.declare_queryable("sdrlink/mine/@gw/*/status", reply)
    found = {}
    async with asyncio.timeout(10):
        while not found:
            found = await operator.client.ask_gateways("status", 1.0)
    assert found == {7: b"@gw/7/status", 8: b"@gw/8/status"}
    assert await operator.client.ask_gateways("heard", 0.5) == {}
    served.undeclare()


async def test_it_says_so_where_it_was_not_entered():
    client = FleetClient(FleetParams(name="mine"))
    with pytest.raises(RuntimeError, match="enter the client"):
        client.command(ROBOT, "cmd_vel", CDR)
    with pytest.raises(RuntimeError, match="enter the client"):
        await client.ask_gateways("status")
    await client.__aexit__(None, None, None)
    client.on_fate(ROBOT, Fate(8, "cmd_vel", "desk", 0, "taken"))
    assert (client.duplicates, client.overrun) == (0, 0)
