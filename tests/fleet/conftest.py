"""A robot, two gateways that hear it, and a Zenoh router, all of them real."""

import contextlib

import msgspec
import pytest
import zenoh

from benchmarks.fleet.field import certified, free_endpoint
from benchmarks.fleet.pdu_air import PduAir
from benchmarks.peers.zenoh_router import router_config
from sdrlinkd.config import FleetParams
from sdrlinkd.fleet import GatewayReport
from sdrlinkd.process import Process, module
from tests.waiting import wait_for

ROBOT, FIRST, SECOND = 2, 7, 8


class Router:
    """A Zenoh router that can be stopped and started again at the same ports.

    Programs on its own computer use `endpoint`; those that connect to `door` need a certificate.
    """

    def __init__(self, folder):
        self.endpoint, self.door = free_endpoint(), free_endpoint("tls")
        self.file = str(certified(folder))
        self.session = None

    def start(self):
        self.session = zenoh.open(router_config(self.endpoint, self.door, file=self.file))

    def stop(self):
        if self.session is not None:
            self.session.close()
            self.session = None

    def ask(self, key):
        """The answers to a query, by key."""
        return {str(each.ok.key_expr): each.ok for each in self.session.get(key) if each.ok}


class Fleet:
    """Daemons of ROBOT, FIRST and SECOND on an air of PDUs, and gateways beside the last two."""

    def __init__(self, folder):
        self.folder = folder
        self.air = PduAir((ROBOT, FIRST, SECOND))
        self.router = Router(folder)
        self.gateways = {}
        self.daemons = {}

    def start(self, start_daemon, more, top=""):
        self.router.start()
        for robot in (ROBOT, FIRST, SECOND):
            self.daemons[robot] = start_daemon(
                f'{top}namespace = "robot_{robot}"\nbackend = "gnuradio"\n'
                f"{self.air.settings(robot)}"
                f'[fleet]\nname = "mine"\nconnect = ["{self.router.door}"]\n'
                f'zenoh = "{self.router.file}"\n{more}'
            )
        self.gateways = {gateway: self.gateway(gateway) for gateway in (FIRST, SECOND)}
        wait_for(lambda: all(self.hears(gateway) for gateway in self.gateways))
        return self

    def gateway(self, gateway):
        command = module("sdrlinkd.cli.gateway", "--config", self.daemons[gateway].config)
        process = Process(command, name=f"gateway {gateway}", log=self.folder / f"log_{gateway}")
        process.start()
        return process

    def report(self, gateway):
        """What a gateway says of itself; None while it does not answer."""
        for answer in self.router.ask(f"sdrlink/mine/@gw/{gateway}/gateway").values():
            return msgspec.json.decode(answer.payload.to_bytes(), type=GatewayReport)
        return None

    def hears(self, gateway):
        """Whether a gateway hears the robot, and somebody leads for it."""
        report = self.report(gateway)
        robots = [] if report is None else report.robots
        return any(each.robot == ROBOT and each.leader is not None for each in robots)

    @property
    def leader(self):
        """The gateway that leads for the robot, if all agree."""
        reports = [self.report(each) for each, at in self.gateways.items() if at.is_running]
        leaders = {
            each.leader for report in reports for each in report.robots if each.robot == ROBOT
        }
        return leaders.pop() if len(leaders) == 1 else None

    @property
    def params(self):
        """What an operator's program needs to join."""
        return FleetParams(name="mine", connect=[self.router.endpoint])

    def close(self):
        for gateway, process in self.gateways.items():
            if process.is_running:
                process.stop()
            assert "Traceback" not in process.log(), (gateway, process.log())
        self.router.stop()
        self.air.close()


@pytest.fixture
def start_fleet(start_daemon, tmp_path):
    """Starts a fleet; `more` is TOML for the section `[fleet]`, and `top` stands ahead of all."""
    with contextlib.ExitStack() as stack:

        def start(more="", top=""):
            fleet = Fleet(tmp_path)
            stack.callback(fleet.close)
            return fleet.start(start_daemon, more, top)

        yield start
