"""A robot, gateways that hear it, and a Zenoh router, as separate programs."""

import socket
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile

from benchmarks import processes
from benchmarks.daemons import is_up, running
from benchmarks.fleet.pdu_air import PduAir
from sdrlinkd.config import FleetParams
from sdrlinkd.process import Process

ROBOT = 2
FLEET = "bench"
ROUTER, WAN = "benchmarks.peers.zenoh_router", "benchmarks.peers.wan"
GUARD = (
    '{access_control: {enabled: true, default_permission: "allow", rules: [], subjects: [], '
    "policies: []}}"
)
"""Rules of Zenoh that let everything pass: on this machine alone, commands are safe."""


@dataclass
class Field:
    """What runs; `gateways` are the processes by robot id."""

    air: PduAir
    endpoint: str
    far_endpoint: str
    """Where gateways find the router, over the wide-area network."""
    folders: dict[int, Path]
    gateways: dict[int, Process]
    router: Process | None
    """A router of its own; None: a gateway is the router."""

    @property
    def params(self) -> FleetParams:
        """What an operator's program needs to join."""
        return FleetParams(name=FLEET, connect=[self.endpoint])


def free_endpoint() -> str:
    """A TCP endpoint at which nobody listens."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{free.getsockname()[1]}"


@contextmanager
def routed(endpoint: str) -> Iterator[Process]:
    """A Zenoh router at an endpoint."""
    with ExitStack() as stack:
        router = processes.start_module(stack, "router", ROUTER, endpoint)
        router.line()
        yield router


@contextmanager
def field(
    losses: Mapping[int, float], seed: int, wan_ms: float = 0.0, *, routes: bool = False
) -> Iterator[Field]:
    """Run the robot's daemon, and for each gateway, which loses so much of it, both its programs.

    The gateways are `wan_ms` away from the router. With `routes`, the first one is the router
    itself. Raises PeerError.
    """
    endpoint = free_endpoint()
    far = free_endpoint() if wan_ms else endpoint
    robots = [ROBOT, *losses]
    with PduAir(robots, seed) as air, ExitStack() as stack:
        guard = stack.enter_context(_file(GUARD))
        ends = dict.fromkeys(robots, f'connect = ["{far}"]')
        if routes:
            ends[min(losses)] = f'listen = ["{endpoint}"]'
        more = f'[fleet]\nname = "{FLEET}"\nzenoh = "{guard}"\ndown = ["cmd_vel"]\n'
        own = {robot: f"{air.settings(robot)}{more}{end}\n" for robot, end in ends.items()}
        router = None if routes else stack.enter_context(routed(endpoint))
        if wan_ms:
            ports = [each.rpartition(":")[2] for each in (far, endpoint)]
            processes.start_module(stack, "wan", WAN, *ports, str(wan_ms)).line()
        started = stack.enter_context(
            running("gnuradio", robots, ["odom", "cmd_vel"], "", "", own=own, ready=is_up)
        )
        air.loss = {(ROBOT, gateway): loss for gateway, loss in losses.items()}
        gateways = {}
        for gateway in losses:
            config = started.folders[gateway].with_suffix(".toml")
            gateways[gateway] = processes.start_module(
                stack, f"gateway_{gateway}", "sdrlinkd.cli.gateway", "--config", str(config)
            )
        yield Field(air, endpoint, far, started.folders, gateways, router)


@contextmanager
def _file(text: str) -> Iterator[Path]:
    with NamedTemporaryFile("w", suffix=".json5") as file:
        file.write(text)
        file.flush()
        yield Path(file.name)
