"""Two or three nodes on one slow channel, as network namespaces of this machine.

    A ─air─ B                  shared=False: each direction has an air of its own
    A ─┐   ┌─ B
       ├─air                   shared=True: one air for all traffic
    A ─┴─ R ─┴─ B              relay=True: R forwards, and both hops use that air

A token bucket lets frames out at the channel's rate, at most one ahead of the one in the air. The
air is a process (see `air`): a frame is received when its airtime is over. On the shared channel
each node has its own queue, and the queues take turns frame by frame, like stations on Wi-Fi: A, R
and B are macvlans in "vepa" mode on one device, which receives again what it sends. Queued frames
still count against the sender's socket buffer, as in a driver's queue.
"""

import contextlib
import functools
import itertools
import os
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

from benchmarks.absent import PeerError
from benchmarks.environments import variables
from sdrlinkd.process import Process, ProcessError, module

DEVICE = "air"
NET = "10.77.0"
BURST = 1600
"""Bytes of one frame, so that a late timer costs no throughput."""
AIR = "benchmarks.peers.pound.air"
START_S = 10.0
Discipline = Literal["fifo", "laser_first", "fq_codel"]
"""How a node's packets queue: by arrival, those of the laser's port first, or as in Linux."""
LASER_PORTS = (("sport", 45000), ("dport", 46000))
"""Ports of topic 0, from the sender: of TCP and of UDP."""
TCP = ("congctl", "cubic")
"""Linux's default congestion control, whatever this machine's setting is."""

_COUNT = itertools.count()


class NetworkError(PeerError):
    """The test network cannot be built here; the message says why."""


class Node(NamedTuple):
    """A namespace and its address on the channel."""

    namespace: str
    address: str

    def command(self, *words: str) -> list[str]:
        """The words of a command, run in this namespace."""
        return ["ip", "netns", "exec", self.namespace, *words]


@dataclass(frozen=True)
class Network:
    """An open network; see `network`."""

    a: Node
    b: Node
    relay: Node | None
    rate_bps: float
    shared: bool

    @property
    def hops(self) -> int:
        """Number of times that each packet is on the channel."""
        return 2 if self.relay else 1

    def outage(self, seconds: float) -> tuple[float, float]:
        """Take the sender's or the relay's link down and up again; (down, up) as monotonic s."""
        namespace = (self.relay or self.a).namespace
        _run("ip", "-n", namespace, "link", "set", DEVICE, "down")
        down = time.monotonic()
        # Absolute times, so that the commands' own duration does not count.
        time.sleep(max(0.0, down + seconds - time.monotonic()))
        _run("ip", "-n", namespace, "link", "set", DEVICE, "up")
        return down, time.monotonic()


@functools.cache
def available() -> str | None:
    """Why the networks are not available, or None if they are."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    for tool in ("ip", "tc"):
        if shutil.which(tool) is None:
            return f"{tool} is not installed (Debian: iproute2)"
    try:
        _sweep()
        for shared in (False, True):
            with _network(6e6, shared, shared, 0.5, "fifo"):
                pass
    except (NetworkError, OSError) as error:
        return str(error)
    return None


@contextlib.contextmanager
def network(
    rate_bps: float = 6e6,
    *,
    shared: bool = False,
    relay: bool = False,
    queue_s: float = 0.5,
    discipline: Discipline = "fifo",
) -> Iterator[Network]:
    """A network for the duration of the `with`; `relay` implies `shared`, as a discipline does.

    A node's queue holds what the channel carries in `queue_s`. Raises NetworkError.
    """
    if (reason := available()) is not None:
        raise NetworkError(reason)
    shared = shared or relay or discipline != "fifo"
    with _network(rate_bps, shared, relay, queue_s, discipline) as it:
        yield it


@contextlib.contextmanager
def _network(
    rate_bps: float, shared: bool, relay: bool, queue_s: float, discipline: Discipline
) -> Iterator[Network]:
    name = f"pound{os.getpid()}n{next(_COUNT)}"
    a, r, b = (Node(f"{name}{letter}", f"{NET}.{i}") for i, letter in enumerate("arb", 1))
    nodes = [a, r, b] if relay else [a, b]
    air = f"{name}air"
    rooms = [node.namespace for node in nodes] + [air]
    stack = contextlib.ExitStack()
    try:
        for room in rooms:
            _run("ip", "netns", "add", room)
            _settle(room, forward=relay and room == r.namespace)
        devices = ["sky"] if shared else ["sky", "sky2"]
        stack.enter_context(_air(air, rate_bps, devices))
        if shared:
            _share(air, nodes, rate_bps, queue_s, discipline)
        else:
            for node, device in zip(nodes, devices, strict=True):
                _own(air, device, node, rate_bps, queue_s)
        for node in nodes:
            _run("ip", "-n", node.namespace, "addr", "add", f"{node.address}/24", "dev", DEVICE)
            _run("ip", "-n", node.namespace, "link", "set", DEVICE, "up")
            own = f"{NET}.0/24 dev {DEVICE} proto kernel scope link src {node.address}".split()
            _run("ip", "-n", node.namespace, "route", "replace", *own, *TCP)
        if relay:
            for here, there in ((a, b), (b, a)):
                way = ["route", "add", there.address, "via", r.address, *TCP]
                _run("ip", "-n", here.namespace, *way)
        yield Network(a, b, r if relay else None, rate_bps, shared)
    finally:
        stack.close()
        for room in rooms:
            subprocess.run(["ip", "netns", "del", room], check=False, capture_output=True)


def _sweep() -> None:
    """Remove what killed processes left behind."""
    for name in re.findall(r"^(pound\d+n\w+)", _run("ip", "netns", "list"), re.MULTILINE):
        if not Path("/proc", name.removeprefix("pound").split("n")[0]).exists():
            _run("ip", "netns", "del", name)


def _settle(room: str, forward: bool) -> None:
    """Set the rules of a namespace: IPv4 only, and no short cuts past R."""
    rules = {
        "ipv6/conf/all/disable_ipv6": 1,
        "ipv4/ip_forward": int(forward),
        "ipv4/conf/all/send_redirects": 0,
        "ipv4/conf/default/send_redirects": 0,
        "ipv4/conf/all/accept_redirects": 0,
        "ipv4/conf/default/accept_redirects": 0,
    }
    script = "; ".join(f"echo {value} > /proc/sys/net/{key}" for key, value in rules.items())
    # Settings that a kernel lacks cannot interfere.
    command = ["ip", "netns", "exec", room, "sh", "-c", f"exec 2>/dev/null; {script}; true"]
    subprocess.run(command, check=False, capture_output=True)
    _run("ip", "-n", room, "link", "set", "lo", "up")


@contextlib.contextmanager
def _air(room: str, rate_bps: float, devices: list[str]) -> Iterator[None]:
    """Run the air's process, which has these devices."""
    command = ["ip", "netns", "exec", room, *module(AIR, f"{rate_bps:.0f}", *devices)]
    process = Process(command, name="the air", environment=variables(), session=False)
    try:
        process.start()
        process.line(START_S)
    except ProcessError as error:
        process.kill()
        raise NetworkError(str(error)) from None
    try:
        yield
    finally:
        process.kill()


def _own(air: str, device: str, node: Node, rate_bps: float, queue_s: float) -> None:
    """Give a node a device of its own, behind a token bucket."""
    _run("ip", "-n", air, "link", "set", device, "gso_max_segs", "1")
    _run("ip", "-n", air, "link", "set", device, "netns", node.namespace, "name", DEVICE)
    shape = ["tbf", "rate", f"{rate_bps:.0f}bit", "burst", str(BURST)]
    shape += ["latency", f"{1e3 * queue_s:.0f}ms"]
    _run("tc", "-n", node.namespace, "qdisc", "add", "dev", DEVICE, "root", *shape)


def _share(
    air: str, nodes: list[Node], rate_bps: float, queue_s: float, discipline: Discipline
) -> None:
    """Make each node a station on one device, with a queue of its own."""
    ip, tc = ("ip", "-n", air), ("tc", "-n", air)
    _run(*ip, "link", "set", "sky", "gso_max_segs", "1")
    _run(*ip, "link", "set", "sky", "up")
    whole = [f"{rate_bps:.0f}bit", "burst", str(BURST), "cburst", str(BURST)]
    # Almost no guaranteed rate: all of it is borrowed from the one bucket, in turns.
    turn = ["htb", "rate", "8kbit", "ceil", *whole, "quantum", "1514"]
    _run(*tc, "qdisc", "add", "dev", "sky", "root", "handle", "1:", "htb", "default", "99")
    under = [*tc, "class", "add", "dev", "sky", "parent"]
    _run(*under, "1:", "classid", "1:1", "htb", "rate", *whole)
    _run(*under, "1:1", "classid", "1:99", *turn)
    fifo = ["bfifo", "limit", str(int(rate_bps * queue_s / 8))]
    for i, node in enumerate(nodes, 10):
        _run(*ip, "link", "add", f"m{i}", "link", "sky", "type", "macvlan", "mode", "vepa")
        _run(*ip, "link", "set", f"m{i}", "gso_max_segs", "1")
        _run(*ip, "link", "set", f"m{i}", "netns", node.namespace, "name", DEVICE)
        # By the sending station, not by the address in the packet: R sends packets that A made.
        mac = _run("ip", "-n", node.namespace, "-br", "link", "show", DEVICE).split()[2]
        digits = mac.replace(":", "")
        station = f"match u32 0x{digits[:8]} 0xffffffff at -8 match u16 0x{digits[8:]} 0xffff at -4"
        rank = ["prio", "1"] if discipline == "laser_first" else []
        of = f"1:{i}"
        _run(*under, "1:1", "classid", of, *turn, *rank)
        leaf = ["fq_codel"] if discipline == "fq_codel" else fifo
        _run(*tc, "qdisc", "add", "dev", "sky", "parent", of, *leaf)
        filters = [*tc, "filter", "add", "dev", "sky", "parent", "1:", "prio"]
        if discipline == "laser_first":
            first = f"1:{i + 20}"
            _run(*under, "1:1", "classid", first, *turn, "prio", "0")
            _run(*tc, "qdisc", "add", "dev", "sky", "parent", first, *fifo)
            for side, port in LASER_PORTS:
                match = [*station.split(), "match", "ip", side, str(port), "0xffff"]
                _run(*filters, "1", "protocol", "ip", "u32", *match, "flowid", first)
        _run(*filters, "2", "protocol", "all", "u32", *station.split(), "flowid", of)


def _run(*words: str) -> str:
    done = subprocess.run(words, check=False, capture_output=True, text=True)
    if done.returncode:
        raise NetworkError(f"{' '.join(words)}: {done.stderr.strip()}")
    return done.stdout
