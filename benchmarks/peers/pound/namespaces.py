"""Two or three nodes on one slow channel, as network namespaces of this machine.

    A ─veth─ B                 shared=False: each direction has a token bucket of its own
    A ─┐   ┌─ B
       ├─air                   shared=True: one bucket for all traffic
    A ─┴─ R ─┴─ B              relay=True: R forwards, and both hops use that bucket

On the shared channel each node has its own queue, and the queues take turns packet by packet, like
stations on Wi-Fi: A, R and B are macvlans in "vepa" mode on one veth, whose other end reflects.
Queued packets still count against the sender's socket buffer, as in a driver's queue.
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
from typing import NamedTuple

from benchmarks.absent import PeerError

DEVICE = "air"
NET = "10.77.0"
BURST = 4600
"""Bytes of three frames, so that a late timer costs no throughput."""
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
            with _network(6e6, shared, shared, 0.5):
                pass
    except NetworkError as error:
        return str(error)
    return None


@contextlib.contextmanager
def network(
    rate_bps: float = 6e6, *, shared: bool = False, relay: bool = False, queue_s: float = 0.5
) -> Iterator[Network]:
    """A network for the duration of the `with`; `relay` implies `shared`.

    A node's queue holds what the channel carries in `queue_s`.
    """
    if (reason := available()) is not None:
        raise NetworkError(reason)
    with _network(rate_bps, shared or relay, relay, queue_s) as it:
        yield it


@contextlib.contextmanager
def _network(rate_bps: float, shared: bool, relay: bool, queue_s: float) -> Iterator[Network]:
    name = f"pound{os.getpid()}n{next(_COUNT)}"
    a, r, b = (Node(f"{name}{letter}", f"{NET}.{i}") for i, letter in enumerate("arb", 1))
    nodes = [a, r, b] if relay else [a, b]
    air = f"{name}air"
    rooms = [node.namespace for node in nodes] + [air] * shared
    try:
        for room in rooms:
            _run("ip", "netns", "add", room)
            _settle(room, forward=relay and room == r.namespace)
        if shared:
            _share(air, nodes, rate_bps, queue_s)
        else:
            _join(a, b, rate_bps, queue_s)
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


def _join(a: Node, b: Node, rate_bps: float, queue_s: float) -> None:
    ends = [DEVICE, "netns", a.namespace], [DEVICE, "netns", b.namespace]
    _run("ip", "link", "add", *ends[0], "type", "veth", "peer", "name", *ends[1])
    for node in (a, b):
        _run("ip", "-n", node.namespace, "link", "set", DEVICE, "gso_max_segs", "1")
        shape = ["tbf", "rate", f"{rate_bps:.0f}bit", "burst", str(BURST)]
        shape += ["latency", f"{1e3 * queue_s:.0f}ms"]
        _run("tc", "-n", node.namespace, "qdisc", "add", "dev", DEVICE, "root", *shape)


def _share(air: str, nodes: list[Node], rate_bps: float, queue_s: float) -> None:
    ip, tc = ("ip", "-n", air), ("tc", "-n", air)
    _run(*ip, "link", "add", "sky", "type", "veth", "peer", "name", "mirror")
    _run(*ip, "link", "add", "bridge", "type", "bridge")
    _run(*ip, "link", "set", "mirror", "master", "bridge")
    _run(*ip, "link", "set", "mirror", "type", "bridge_slave", "hairpin", "on")
    _run(*ip, "link", "set", "sky", "gso_max_segs", "1")
    for device in ("sky", "mirror", "bridge"):
        _run(*ip, "link", "set", device, "up")
    whole = [f"{rate_bps:.0f}bit", "burst", str(BURST), "cburst", str(BURST)]
    # Almost no guaranteed rate: all of it is borrowed from the one bucket, in turns.
    turn = ["htb", "rate", "8kbit", "ceil", *whole, "quantum", "1514"]
    _run(*tc, "qdisc", "add", "dev", "sky", "root", "handle", "1:", "htb", "default", "99")
    under = [*tc, "class", "add", "dev", "sky", "parent"]
    _run(*under, "1:", "classid", "1:1", "htb", "rate", *whole)
    _run(*under, "1:1", "classid", "1:99", *turn)
    limit = str(int(rate_bps * queue_s / 8))
    for i, node in enumerate(nodes, 10):
        of = f"1:{i}"
        _run(*under, "1:1", "classid", of, *turn)
        _run(*tc, "qdisc", "add", "dev", "sky", "parent", of, "bfifo", "limit", limit)
        _run(*ip, "link", "add", f"m{i}", "link", "sky", "type", "macvlan", "mode", "vepa")
        _run(*ip, "link", "set", f"m{i}", "gso_max_segs", "1")
        _run(*ip, "link", "set", f"m{i}", "netns", node.namespace, "name", DEVICE)
        # By the sending station, not by the address in the packet: R sends packets that A made.
        mac = _run("ip", "-n", node.namespace, "-br", "link", "show", DEVICE).split()[2]
        digits = mac.replace(":", "")
        match = f"match u32 0x{digits[:8]} 0xffffffff at -8 match u16 0x{digits[8:]} 0xffff at -4"
        into = ["parent", "1:", "protocol", "all", "u32", *match.split(), "flowid", of]
        _run(*tc, "filter", "add", "dev", "sky", *into)


def _run(*words: str) -> str:
    done = subprocess.run(words, check=False, capture_output=True, text=True)
    if done.returncode:
        raise NetworkError(f"{' '.join(words)}: {done.stderr.strip()}")
    return done.stdout
