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
ROUTER, WAN, PLAIN = (f"benchmarks.peers.{each}" for each in ("zenoh_router", "wan", "plain_zenoh"))
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
    are_plain: bool
    """Whether the gateways are plain bridges, without any of our rules."""

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
    losses: Mapping[int, float], seed: int, wan_ms: float = 0.0, *,
    routes: bool = False, are_plain: bool = False,
) -> Iterator[Field]:  # fmt: skip
    """Run the robot's daemon, and for each gateway, which loses so much of it, both its programs.

    The gateways are `wan_ms` away from the router. With `routes`, the first one is the router
    itself; with `are_plain`, they are plain bridges to Zenoh. Raises PeerError.
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
            folder = started.folders[gateway]
            gateways[gateway] = (
                start_plain(stack, gateway, folder, far)
                if are_plain
                else processes.start_module(
                    stack, f"gateway_{gateway}", "sdrlinkd.cli.gateway",
                    "--config", str(folder.with_suffix(".toml")),
                )
            )  # fmt: skip
        yield Field(air, endpoint, far, started.folders, gateways, router, are_plain)


def start_plain(stack: ExitStack, gateway: int, folder: Path, endpoint: str) -> Process:
    """A plain bridge from a gateway's daemon to the router at an endpoint, once it listens."""
    arguments = (str(folder), f"/rx_robot_{ROBOT}/odom", endpoint)
    process = processes.start_module(stack, f"plain_{gateway}", PLAIN, *arguments)
    process.line()
    return process


@contextmanager
def _file(text: str) -> Iterator[Path]:
    with NamedTemporaryFile("w", suffix=".json5") as file:
        file.write(text)
        file.flush()
        yield Path(file.name)
