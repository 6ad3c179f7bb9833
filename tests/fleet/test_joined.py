"""A gateway in this process, between a real bus and a real Zenoh network."""

import asyncio
import json
import logging
from contextlib import asynccontextmanager

import msgspec
import pytest

from sdrlinkd.calls import Kind, Packet, Service, told
from sdrlinkd.fleet import (
    Claim,
    Command,
    Fate,
    GatewayReport,
    Keys,
    Passed,
    encode,
    read_claim,
    read_fate,
    read_passed,
    run_gateway,
    score,
)
from sdrlinkd.fleet.testing import Attachment
from sdrlinkd.wire import name_for
from tests.fleet.beside import CDR, OWN, PATIENCE_S, ROBOT, Daemon, Network, until, until_found
from tests.reported import topic

KEYS = Keys("mine")
ODOM = KEYS.message(ROBOT, "odom")
KIND = "nav_msgs/msg/Odometry"
OTHER = 8
DOMAIN = 42


class Joined:
    """Gateway 7 between its daemon and a plain node of Zenoh."""

    def __init__(self, folder, more, *, is_read):
        self.network = Network("tls")
        self.daemon = Daemon(
            folder,
            '[fleet]\nname = "mine"\nzenoh = "zenoh.json5"\n'
            f'listen = ["{self.network.endpoint}"]\n{more}',
        )
        if is_read:
            self.daemon.hears(ROBOT)
        else:
            self.daemon.snapshot = None

    async def join(self):
        await self.network.join(KEYS.all_messages, KEYS.routes, KEYS.all_sent)

    async def report(self):
        (answer,) = await self.network.ask(KEYS.gateway(OWN, "gateway"))
        return msgspec.json.decode(answer.payload.to_bytes(), type=GatewayReport)

    async def reports(self, is_so):
        """The gateway's report, once it is so."""
        report = await until_found(self.report, is_so)
        adds_up(report)
        return report

    async def led_by(self, gateway, robot=ROBOT):
        """The gateway's report, once `gateway` leads for a robot."""

        def is_so(report):
            return {each.robot: each.leader for each in report.robots}.get(robot) == gateway

        return await self.reports(is_so)

    async def follow(self, gateway=OTHER, robot=ROBOT):
        """Another gateway leads from now on."""
        tokens = [self.token(gateway), self.token(gateway, f"robot_{robot}")]
        self.claim(Claim(gateway, 50, 1.0), robot)
        await self.led_by(gateway, robot)
        return tokens

    def claim(self, claim, robot=ROBOT):
        self.network.far.put(KEYS.route(robot), encode(claim))

    def token(self, gateway, what=""):
        return self.network.token(KEYS.gateway(gateway, what))

    def command(self, n, name="cmd_vel", robot=ROBOT):
        key = KEYS.message(robot, name)
        self.network.far.put(key, CDR, attachment=encode(Command("desk", n)))

    def at(self, key):
        """What has come at a key."""
        return [each for each in self.network.came if str(each.key_expr) == key]

    def numbers(self, key=ODOM):
        return [each.payload.to_bytes()[-1] for each in self.at(key)]

    def told(self, key=ODOM):
        return [read_passed(each.attachment.to_bytes()) for each in self.at(key)]

    def fates(self, n):
        fates = [read_fate(each.payload.to_bytes()) for each in self.at(KEYS.sent(ROBOT))]
        return [each.fate for each in fates if each.n == n]


def adds_up(report):
    assert report.up_taken == sum(report.up.values())
    assert report.down_taken == sum(report.down.values())
    assert report.bridge_taken == sum(report.bridge.values())


@asynccontextmanager
async def started(folder, more="", *, joins=True, is_read=True):
    joined = Joined(folder, more, is_read=is_read)
    faults = []
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(lambda _, about: faults.append(about))
    running = asyncio.ensure_future(run_gateway(joined.daemon.setup, folder))
    try:
        await joined.daemon.is_heard()
        if joins:
            await joined.join()
        yield joined
    finally:
        await joined.network.part()
        running.cancel()
        await asyncio.wait([running], timeout=PATIENCE_S)
        joined.daemon.stop()
    assert running.cancelled()
    assert faults == []


@pytest.fixture
async def join(tmp_path):
    """A gateway that leads for robot 2, with nothing but its name configured."""
    async with started(tmp_path) as joined:
        await joined.led_by(OWN)
        yield joined


async def test_what_the_daemon_hears_is_put_and_can_be_asked_for(join, caplog):
    daemon, network = join.daemon, join.network
    await until(lambda: bool(join.at(KEYS.route(ROBOT))))
    claims = [read_claim(each.payload.to_bytes()) for each in join.at(KEYS.route(ROBOT))]
    assert claims[0] == Claim(OWN, 1, 1.0)
    await until(lambda: len(join.at(KEYS.route(ROBOT))) > 2)
    daemon.hears(ROBOT, 3, topics=[topic(name=f"/robot_{OWN}/odom", qos="urgent")], snr_db=20.0)
    await join.led_by(OWN, 3)
    daemon.bring(1)
    daemon.bring(2, snr_db=20.5, series=3)
    # Its own, and what another gateway has sent for a robot elsewhere, are not put.
    daemon.bring(3, robot=OWN)
    daemon.bring(4, name_for(12, "odom"), OTHER)
    daemon.bring(5, "scan", robot=3)
    await until(lambda: len(join.numbers()) == 2 and bool(join.numbers(KEYS.message(3, "scan"))))
    assert join.numbers() == [1, 2]
    assert {int(each.priority) for each in join.at(ODOM)} == {1}
    assert int(join.at(KEYS.message(3, "scan"))[0].priority) == 5
    first, second = join.told()
    assert (first.gw, first.ty, first.e, first.sr) == (OWN, KIND, 1, 0)
    assert (second.sr, second.sn) == (3, 20.5)
    assert 250_000 <= first.age < 20_000_000
    report = await join.report()
    adds_up(report)
    assert report.up == {**dict.fromkeys(report.up, 0), "up_put": 3, "up_bridged": 1}
    assert (report.gateway, report.fleet, report.is_reached, report.has_daemon) == (
        OWN, "mine", True, True,
    )  # fmt: skip
    assert [(each.robot, each.leader, each.score) for each in report.robots] == [
        (ROBOT, OWN, score(0.0, 20.0)), (3, OWN, score(0.0, 20.0)),
    ]  # fmt: skip
    assert (report.others, report.bridges, report.bridge_taken, report.calls) == ([], False, 0, {})
    assert (report.puts_failed, report.samples_dropped, report.queries_refused) == (0, 0, 0)
    (status,) = await network.ask("sdrlink/mine/@gw/*/status")
    assert json.loads(status.payload.to_bytes())["node"] == OWN
    (heard,) = await network.ask(KEYS.gateway(OWN, "heard"))
    assert [each["src"] for each in json.loads(heard.payload.to_bytes())] == [ROBOT, 3]
    (last,) = await network.ask(KEYS.messages(ROBOT))
    assert (str(last.key_expr), last.payload.to_bytes()[-1]) == (ODOM, 2)
    assert read_passed(last.attachment.to_bytes()).again
    tokens = await asyncio.to_thread(lambda: list(network.far.liveliness().get(KEYS.gateways)))
    assert {str(each.ok.key_expr) for each in tokens} == {
        KEYS.gateway(OWN), KEYS.hears(OWN, ROBOT), KEYS.hears(OWN, 3),
    }  # fmt: skip
    # An operator's command is no business of a gateway that takes none.
    join.command(1)
    await asyncio.sleep(0.1)
    assert (await join.report()).down_taken == 0
    assert caplog.text.count("leads for robot 2") <= 1


async def test_a_gateway_leaves_messages_to_the_leader_and_puts_what_that_misses(join):
    daemon, far = join.daemon, join.network.far
    tokens = await join.follow()
    assert (await join.report()).others == [OTHER]
    passed = Passed(OTHER, KIND, 1, 1, 1, 0)
    far.put(ODOM, CDR + b"\1", attachment=encode(passed))
    assert (await join.report()).up_taken == 0
    daemon.bring(1)
    await join.reports(lambda report: report.up["up_left"] == 1)
    daemon.bring(2)
    await join.reports(lambda report: report.up["up_put"] == 1)
    await until(lambda: [each.gw for each in join.told()] == [OTHER, OWN])
    # Claims of strangers and to robots elsewhere change nothing.
    far.put(KEYS.route(ROBOT), b"junk")
    join.claim(Claim(9, 99, 1.0), 99)
    assert (await join.led_by(OTHER)).robots[0].put_for_others == 1
    # The leader's token for another robot, or that it bridges, says nothing.
    for what in ("robot_9", "bridge"):
        token = join.token(OTHER, what)
        await asyncio.sleep(0.05)
        token.undeclare()
    await asyncio.sleep(0.05)
    await join.led_by(OTHER)
    tokens[1].undeclare()
    await join.led_by(OWN)
    assert (await join.report()).others == [OTHER]
    daemon.bring(3)
    await join.reports(lambda report: report.up["up_put"] == 2)
    join.claim(Claim(OTHER, 90, 1.0))
    await join.led_by(OTHER)
    tokens[0].undeclare()
    await join.led_by(OWN)
    assert (await join.report()).others == []


async def test_a_gateway_waits_longer_behind_those_with_lower_ids(join):
    await join.follow()
    for gateway in (3, 4):
        join.token(gateway, f"robot_{ROBOT}")
    join.claim(Claim(OTHER, 60, 1.0))
    await join.led_by(OTHER)
    loop = asyncio.get_running_loop()
    # It looks at its rank now and then.
    for n in range(1, 40):
        before = loop.time()
        join.daemon.bring(n)
        await until(lambda n=n: n in join.numbers())
        # 20 ms for the leader, and 10 ms for each of the others.
        if loop.time() - before > 0.039:
            return
    pytest.fail("it goes before the others")


async def test_what_came_while_the_network_was_away_is_put_when_it_is_there(tmp_path, caplog):
    caplog.set_level(logging.INFO, logger="sdrlinkd")
    async with started(tmp_path, joins=False) as join:
        daemon, network = join.daemon, join.network
        daemon.hears(ROBOT, 3)
        await until(lambda: "leads for robot 3" in caplog.text)
        for number, robot in ((1, ROBOT), (2, ROBOT), (3, 3)):
            daemon.bring(number, robot=robot)
        await asyncio.sleep(0.1)
        await join.join()
        await join.follow(robot=3)
        daemon.bring(4, "scan")
        await until(lambda: bool(join.numbers()))
        assert join.numbers() == [2]
        assert join.told()[0].again
        assert f"joined fleet mine as gateway {OWN}" in caplog.text
        report = await join.reports(lambda report: report.up_again >= 2)
        assert report.up["up_away"] == 3
        await until(lambda: join.numbers(KEYS.message(3, "odom")) == [3])
        await until(lambda: len(join.numbers(KEYS.message(ROBOT, "scan"))) == 2)
        assert [each.again for each in join.told(KEYS.message(ROBOT, "scan"))] == [False, True]
        await network.part()
        await until(lambda: "no Zenoh router is reached; messages stay here" in caplog.text)


DOWN = 'down = ["cmd_vel"]\n'


async def test_commands_reach_the_daemon_and_their_fates_come_back(tmp_path):
    async with started(tmp_path, DOWN) as join:
        daemon = join.daemon
        await join.led_by(OWN)
        join.command(1)
        join.command(2, "odom")
        await until(lambda: len(daemon.taken) == 1)
        name, cdr, wishes, _ = daemon.taken[0]
        assert (name, cdr, wishes.dst) == (f"/robot_{OWN}/cmd_vel", CDR, ROBOT)
        daemon.tell(wishes.receipt, 3, "delivered")
        await until(lambda: join.fates(1) == ["taken", "delivered"])
        report = await join.reports(lambda report: report.down_taken == 2)
        assert report.down == {
            **dict.fromkeys(report.down, 0), "down_sent": 1, "down_not_allowed": 1,
        }  # fmt: skip
        await join.follow()
        # What the leader takes is left to it, and sent if it does not.
        for n, fate in ((3, "taken"), (4, None)):
            if fate is not None:
                told_ = encode(Fate(OTHER, "cmd_vel", "desk", n, fate))
                join.network.far.put(KEYS.sent(ROBOT), told_)
            join.command(n)
        await until(lambda: join.fates(4) == ["taken"])
        report = await join.reports(lambda report: report.down["down_sent"] == 2)
        assert report.down["down_left"] == 1
        assert len(daemon.taken) == 2
        assert join.fates(3) == ["taken"]


async def test_a_gateway_bridges_once_it_knows_who_is_on_its_air(tmp_path):
    async with started(tmp_path, 'bridge = ["od*"]\n') as join:
        daemon, far = join.daemon, join.network.far
        tokens = await asyncio.to_thread(lambda: list(far.liveliness().get(KEYS.bridges(OWN))))
        assert len(tokens) == 1
        served = far.declare_queryable(
            "sdrlink/mine/robot_12/**",
            lambda query: query.reply(
                KEYS.message(12, "odom"), CDR + b"\1",
                attachment=encode(Passed(OTHER, KIND, 1, 1, 1, age=5, again=True)),
            ),
        )  # fmt: skip
        assert not (await join.report()).bridges
        await join.reports(lambda report: report.bridges)
        await until(lambda: len(daemon.taken) == 1)
        assert daemon.taken[0][:2] == ("/rx_robot_12/odom", CDR + b"\1")
        served.undeclare()
        put = encode(Passed(OTHER, KIND, 1, 2, 2, age=5))
        for key in (KEYS.message(12, "odom"), KEYS.message(12, "scan"), ODOM):
            far.put(key, CDR + b"\2", attachment=put)
        report = await join.reports(lambda report: report.bridge_taken >= 4)
        await until(lambda: len(daemon.taken) == 2)
        report = await join.reports(lambda report: report.bridge["bridge_sent"] == 2)
        assert (report.bridge["bridge_near"], report.bridge["bridge_not_allowed"]) == (1, 1)
        # One with a lower id goes before it if it is on the same air.
        join.token(3, "bridge")
        await asyncio.sleep(0.1)
        assert (await join.report()).bridges
        daemon.hears(ROBOT, 3)
        await join.reports(lambda report: not report.bridges)


async def test_a_gateway_is_a_node_of_the_ros_graph(tmp_path):
    more = f'down = ["cmd_vel", "set"]\nros_domain = {DOMAIN}\n'
    async with started(tmp_path, more) as join:
        daemon, network, far = join.daemon, join.network, join.network.far
        nodes = []
        kept = far.declare_subscriber(f"{DOMAIN}/**", nodes.append)
        daemon.bring(1, "map", kind="nav_msgs/msg/OccupancyGrid")
        await join.led_by(OWN)
        gid = bytes(range(16))
        key = f"{DOMAIN}/robot_{ROBOT}/cmd_vel/geometry_msgs::msg::dds_::Twist_/RIHS01_{'ab' * 32}"
        far.put(key, CDR, attachment=Attachment(3, 5, gid).build())
        await until(lambda: len(daemon.taken) == 1)
        assert daemon.taken[0][:2] == (f"/robot_{OWN}/cmd_vel", CDR)
        await join.reports(lambda report: report.down["down_sent"] == 1)
        daemon.bring(2)
        await until(lambda: any("/odom/" in str(each.key_expr) for each in nodes))
        assert str(nodes[-1].key_expr).startswith(f"{DOMAIN}/robot_2/odom/nav_msgs::msg::dds_::")
        far.put(ODOM, CDR + b"\3", attachment=encode(Passed(OTHER, KIND, 1, 3, 3)))
        await until(lambda: nodes[-1].payload.to_bytes() == CDR + b"\3")
        service = told([Service("/set", "a/srv/Set", "")])
        daemon.bring(4, "_sdrlink/services", payload=service, kind="std_msgs/msg/String")
        at = f"{DOMAIN}/robot_{ROBOT}/set/a::srv::dds_::Set_/RIHS01_{'ab' * 32}"
        asked = Attachment(1, 5, gid).build()
        served = f"@ros2_lv/{DOMAIN}/*/0/*/SS/**"

        async def is_served():
            return await asyncio.to_thread(lambda: list(far.liveliness().get(served)))

        await until_found(is_served, bool)
        asking = asyncio.ensure_future(network.ask(at, b"body", asked))

        def requests():
            return [cdr for name, cdr, *_ in daemon.taken if name == "/robot_2/_sdrlink/calls"]

        await until(lambda: bool(requests()))
        packet = Packet.parse(requests()[0])
        answer = packet._replace(kind=Kind.ANSWER, body=b"done", name="").build()
        daemon.bring(5, f"robot_{OWN}/_sdrlink/calls", payload=answer, kind="sdrlink_ros/msg/Call")
        (reply,) = await asking
        assert reply.payload.to_bytes() == b"done"
        assert (await join.report()).calls == {"calls_answered": 1}
        # Another gateway leads from now on.
        await join.follow()
        await until_found(is_served, lambda found: not found)
        kept.undeclare()


async def test_a_daemon_whose_report_cannot_be_read_is_heard_all_the_same(tmp_path):
    async with started(tmp_path, is_read=False) as join:
        assert not (await join.report()).has_daemon
        join.daemon.bring(1)
        await until(lambda: join.numbers() == [1])
        assert int(join.at(ODOM)[0].priority) == 5


async def test_a_gateway_waits_for_its_daemon(join):
    join.daemon.stop()
    report = await join.reports(lambda report: not report.has_daemon)
    assert [each.score for each in report.robots] == [None]
    (heard,) = await join.network.ask(KEYS.gateway(OWN, "heard"))
    assert heard.payload.to_bytes() == b"[]"
    join.daemon.start()
    await join.reports(lambda report: report.has_daemon)
    await join.led_by(OWN)
