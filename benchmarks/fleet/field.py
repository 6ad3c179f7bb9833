"""A robot, gateways that hear it, and a Zenoh router, as separate programs."""

import socket
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks import processes
from benchmarks.daemons import is_up, running
from benchmarks.fleet.pdu_air import PduAir
from sdrlinkd.config import FleetParams
from sdrlinkd.keyring import new_authority, zenoh_file
from sdrlinkd.process import Process

ROBOT = 2
FLEET = "bench"
ROUTER, WAN, PLAIN = (f"benchmarks.peers.{each}" for each in ("zenoh_router", "wan", "plain_zenoh"))


@dataclass
class Field:
    """What runs; `gateways` are the processes by robot id."""

    air: PduAir
    endpoint: str
    """Where operators' programs connect; on the router's computer, they need no certificate."""
    far_endpoint: str
    """Where plain bridges find the router, over the wide-area network."""
    door: str
    """The same for gateways, with certificates."""
    certificate: Path
    folders: dict[int, Path]
    gateways: dict[int, Process]
    router: Process | None
    """A router of its own; None: a gateway is the router."""
    are_plain: bool
    """Whether the gateways are plain bridges, without any of our rules."""

    @property
    def params(self) -> FleetParams:
        """What an operator's program needs to join."""
        return FleetParams(name=FLEET, connect=[self.endpoint], zenoh=str(self.certificate))


def certified(folder: Path) -> Path:
    """A file of Zenoh's in a folder, with a certificate, for all programs of a team."""
    file = folder / "zenoh.json5"
    file.write_text(zenoh_file(new_authority(), "all", days=1))
    return file


def free_endpoint(protocol: str = "tcp") -> str:
    """An endpoint at which nobody listens."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"{protocol}/127.0.0.1:{free.getsockname()[1]}"


@contextmanager
def routed(*endpoints: str, file: str = "") -> Iterator[Process]:
    """A Zenoh router at endpoints; see `router_config`."""
    with ExitStack() as stack:
        router = processes.start_module(stack, "router", ROUTER, file, *endpoints)
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
    endpoint, door = free_endpoint(), free_endpoint("tls")
    far, far_door = endpoint, door
    robots = [ROBOT, *losses]
    with PduAir(robots, seed) as air, ExitStack() as stack:
        file = certified(Path(stack.enter_context(TemporaryDirectory())))
        router = None
        if not routes:
            router = stack.enter_context(routed(endpoint, door, file=str(file)))
        if wan_ms:
            far, far_door = free_endpoint(), free_endpoint("tls")
            for name, way in (("wan", (far, endpoint)), ("wan of ours", (far_door, door))):
                ports = [each.rpartition(":")[2] for each in way]
                processes.start_module(stack, name, WAN, *ports, str(wan_ms)).line()
        ends = dict.fromkeys(robots, f'connect = ["{far_door}"]')
        if routes:
            endpoint = door
            ends[min(losses)] = f'listen = ["{door}"]'
        more = f'[fleet]\nname = "{FLEET}"\nzenoh = "{file}"\ndown = ["cmd_vel"]\n'
        own = {robot: f"{air.settings(robot)}{more}{end}\n" for robot, end in ends.items()}
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
        yield Field(air, endpoint, far, door, file, started.folders, gateways, router, are_plain)


def start_plain(stack: ExitStack, gateway: int, folder: Path, endpoint: str) -> Process:
    """A plain bridge from a gateway's daemon to the router at an endpoint, once it listens."""
    arguments = (str(folder), f"/rx_robot_{ROBOT}/odom", endpoint)
    process = processes.start_module(stack, f"plain_{gateway}", PLAIN, *arguments)
    process.line()
    return process
