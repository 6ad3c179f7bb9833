"""Zenoh's door: who may command a robot through a gateway."""

import asyncio
import contextlib
import json
import time

import pytest
import zenoh

from benchmarks.fleet.field import free_endpoint
from benchmarks.fleet.pdu_air import PduAir
from benchmarks.peers.zenoh_node import configured
from benchmarks.peers.zenoh_router import router_config
from sdrlinkd.adapters import type_hash
from sdrlinkd.client import Subscriber
from sdrlinkd.config import FleetParams
from sdrlinkd.fleet import FleetClient
from sdrlinkd.fleet.testing import Attachment, dds_type
from sdrlinkd.keyring import new_authority, zenoh_file
from sdrlinkd.process import Process, module
from tests.conftest import daemons
from tests.waiting import wait_for

ROBOT, BASE = 2, 7
MINE, FORGED, NODES = b"\0\1\0\0mine", b"\0\1\0\0forged", b"\0\1\0\0a node's"
DOMAIN, TWIST = 42, "geometry_msgs/msg/Twist"
FLEET_KEY = f"sdrlink/mine/robot_{ROBOT}/cmd_vel"
ROS_KEY = f"{DOMAIN}/robot_{ROBOT}/cmd_vel/{dds_type(TWIST)}/{type_hash(TWIST)}"
"""By which a node on rmw_zenoh publishes."""
TEAM, STRANGERS = new_authority(), new_authority()


def tls_in(file):
    """The settings of TLS in a file of Zenoh's."""
    return json.loads(file.split("\n", 1)[1])["transport"]["link"]["tls"]


def connecting(file):
    """Those of them with which it connects."""
    return {name: value for name, value in tls_in(file).items() if name.startswith("connect")}


MEMBERS = zenoh_file(TEAM, "desk", 1)
STRANGERS_CLIENTS = {
    "no certificate": {},
    "another team's certificate": connecting(zenoh_file(STRANGERS, "desk", 1)),
    "a certificate that has ended": connecting(zenoh_file(TEAM, "desk", -0.5)),
}
"""With which settings of TLS each tries; all trust the gateway's certificate."""
FOR_ALL = [
    ("tls", "no certificate"),
    *(
        pytest.param(protocol, who, marks=pytest.mark.long)
        for protocol in ("tls", "quic")
        for who in STRANGERS_CLIENTS
        if (protocol, who) != ("tls", "no certificate")
    ),
]


class Base:
    """A robot, and a base station whose gateway listens with certificates."""

    def __init__(self, folder, start_daemon, stack):
        self.endpoints = {each: free_endpoint(each) for each in ("tls", "quic")}
        file = folder / "base.json5"
        file.write_text(zenoh_file(TEAM, "base", 1))
        air = stack.enter_context(PduAir((ROBOT, BASE)))
        fleet = (
            f'[fleet]\nname = "mine"\nlisten = {json.dumps([*self.endpoints.values()])}\n'
            f'zenoh = "{file}"\ndown = ["cmd_vel"]\nros_domain = {DOMAIN}\n'
        )
        self.robot, base = (
            start_daemon(
                f'namespace = "robot_{each}"\nbackend = "gnuradio"\n{air.settings(each)}{more}'
            )
            for each, more in ((ROBOT, ""), (BASE, fleet))
        )
        self.gateway = stack.enter_context(
            Process(module("sdrlinkd.cli.gateway", "--config", base.config), name="gateway")
        )
        self.file = folder / "desk.json5"
        self.commands = stack.enter_context(
            Subscriber(f"/rx_robot_{BASE}/cmd_vel", runtime_dir=self.robot.directory)
        )

    def hears(self, command, within_s):
        """Whether the robot hears a command within so many seconds."""
        over = time.monotonic() + within_s
        with contextlib.suppress(TimeoutError):
            while (left := over - time.monotonic()) > 0:
                message = self.commands.receive(left)
                if message is not None and message.payload == command:
                    return True
        return False


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    with contextlib.ExitStack() as stack:
        start = stack.enter_context(daemons(tmp_path_factory))
        yield Base(tmp_path_factory.mktemp("door"), start, stack)


def connected(settings, endpoint):
    """A session with these settings of TLS. Raises ZError if the gateway ends it."""
    config = configured(mode="client", connect=[endpoint])
    ours = "root_ca_certificate_base64"
    settings = {ours: tls_in(MEMBERS)[ours], "verify_name_on_connect": False, **settings}
    config.insert_json5("transport/link/tls", json.dumps(settings))
    config.insert_json5("connect/timeout_ms", "1000")
    return zenoh.open(config)


def put_to_both(session, command):
    """Command robot ROBOT as an operator's program does, and as a node on rmw_zenoh."""
    session.put(FLEET_KEY, command)
    put_as_node(session, command)


def put_as_node(session, command):
    now_ns = time.time_ns()
    session.put(ROS_KEY, command, attachment=Attachment(now_ns >> 10, now_ns, bytes(16)).build())


def put_as_stranger(settings, endpoint):
    """Command robot ROBOT with these settings of TLS."""
    with contextlib.suppress(zenoh.ZError), connected(settings, endpoint) as session:
        for _ in range(10):
            put_to_both(session, FORGED)
            time.sleep(0.05)


def commanded_by_node(endpoint, base):
    """Whether a command of a node that has a certificate of the team comes to the robot."""
    with connected(tls_in(MEMBERS), endpoint) as session:
        for _ in range(50):
            put_as_node(session, NODES)
            if base.hears(NODES, 0.2):
                return True
    return False


async def commanded_by(params, folder, base):
    """Whether a command of an operator's program comes to the robot."""
    async with FleetClient(params, folder) as operator:
        for _ in range(50):
            operator.command(ROBOT, "cmd_vel", MINE, lifespan_ms=1000)
            if await asyncio.to_thread(base.hears, MINE, 0.2):
                return True
    return False


@pytest.mark.slow
@pytest.mark.parametrize(("protocol", "who"), FOR_ALL)
def test_who_has_no_right_commands_no_robot_and_who_has_it_does(protocol, who, base, tmp_path):
    """Each client in its own way, and then a member of the team: an effect is what counts."""
    endpoint = base.endpoints[protocol]
    (tmp_path / "team.json5").write_text(MEMBERS)
    params = FleetParams(name="mine", connect=[endpoint], zenoh="team.json5")
    assert asyncio.run(commanded_by(params, tmp_path, base))
    assert commanded_by_node(endpoint, base)
    put_as_stranger(STRANGERS_CLIENTS[who], endpoint)
    assert not base.hears(FORGED, 1.0)
    assert asyncio.run(commanded_by(params, tmp_path, base))
    assert base.gateway.is_running


@pytest.mark.slow
@pytest.mark.parametrize("rules", [None, pytest.param("any", marks=pytest.mark.long)])
def test_a_gateway_does_not_start_at_a_router_that_lets_strangers_command(
    rules, start_daemon, tmp_path
):
    """The router asks nobody for a certificate; what it says of itself is not asked."""
    endpoint = free_endpoint("tls")
    file = tmp_path / "team.json5"
    file.write_text(MEMBERS)
    config = router_config(endpoint, file=str(file))
    config.insert_json5("transport/link/tls/enable_mtls", "false")
    if rules is not None:
        may_put = {
            "id": "r", "permission": "allow", "flows": ["ingress", "egress"],
            "messages": ["put", "declare_subscriber"], "key_exprs": ["sdrlink/**"],
        }  # fmt: skip
        told = {
            "enabled": True, "default_permission": "deny", "rules": [may_put],
            "subjects": [{"id": "s"}], "policies": [{"rules": ["r"], "subjects": ["s"]}],
        }  # fmt: skip
        config.insert_json5("access_control", json.dumps(told))
    daemon = start_daemon(
        f'[fleet]\nname = "mine"\nconnect = ["{endpoint}"]\nzenoh = "{file}"\ndown = ["cmd_*"]\n'
    )
    with (
        zenoh.open(config),
        Process(module("sdrlinkd.cli.gateway", "--config", daemon.config)) as gateway,
    ):
        assert gateway.wait() == 2
        assert f'"{endpoint}": a program without a certificate may command' in gateway.err()


@pytest.mark.slow
def test_a_router_that_asks_for_certificates_is_named_once(start_daemon, tmp_path):
    endpoint = free_endpoint("tls")
    file = tmp_path / "team.json5"
    file.write_text(MEMBERS)
    daemon = start_daemon(
        f'[fleet]\nname = "mine"\nconnect = ["{endpoint}"]\nzenoh = "{file}"\ndown = ["*"]\n'
    )
    with (
        zenoh.open(router_config(endpoint, file=str(file))),
        Process(module("sdrlinkd.cli.gateway", "--config", daemon.config)) as gateway,
    ):
        wait_for(lambda: "decides who may command" in gateway.err() and gateway.is_running)
        wait_for(lambda: "joined fleet" in gateway.err())
        assert gateway.err().count("decides who may command robots") == 1
