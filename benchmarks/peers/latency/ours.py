"""Our own daemons as a peer: programs on the bus; between daemons a line, an air, or nothing."""

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from benchmarks.peers.latency.daemons import Air, running
from benchmarks.peers.latency.job import ANSWERED, ASKED, FIRST_TOPIC, REPLY, REQUEST, Address
from benchmarks.peers.latency.pacer import BITS_PER_BYTE
from benchmarks.peers.latency.way import End, Way, late_s
from benchmarks.processes import precede, start_module
from sdrlinkd.client import Publisher, Subscriber

AIR = Air()
ROBOT = {"companion": 1, "fcu": 2}
SHARED = "direct"
"""With this link both ends are programs of one robot."""
TOPICS = {SHARED: 7, "ether": 15, "line": 15}
"""Number of topics each way: of one registry for both ways, or of one each."""
PDU_OVERHEAD = 26
"""Octets of a PDU with one message beside it: header, entry, STAMP and CRC."""
LINE = """[gnuradio]
transport = "tcp"
send = "127.0.0.1:{port}"
rate_bit_s = {rate_bit_s}
"""


class BusEnd:
    """One end's program. Messages for time synchronisation are recognised by their length."""

    def __init__(self, address: Address, side: str) -> None:
        robot = ROBOT[side]
        other = next(each for each in ROBOT.values() if each != robot)
        if address.transport == SHARED:
            robot = other = 1
        ours, theirs = ("c", "f") if side == "companion" else ("f", "c")
        if address.transport != SHARED:
            ours = theirs = "t"
        self._out = Publisher(address.place)
        self._heard = Subscriber(f"/rx_robot_{other}/{theirs}*", runtime_dir=address.place)
        self._prefix = f"/robot_{robot}/{ours}"
        self._skip = len(f"/rx_robot_{other}/{theirs}")

    def send(self, kind: int, payload: bytes) -> None:
        """Hand a message to the daemon."""
        number = max(0, kind - FIRST_TOPIC)
        self._out.send(f"{self._prefix}{number}", payload)

    def receive(self, timeout_s: float) -> Iterator[tuple[int, bytes]]:
        """Wait for one message from the daemon and yield it."""
        message = self._heard.receive(timeout_s)
        if message is None:
            return
        payload = message.payload
        if len(payload) == ASKED.size:
            yield REQUEST, payload
        elif len(payload) == ANSWERED.size:
            yield REPLY, payload
        else:
            yield FIRST_TOPIC + int(message.topic[self._skip :]), payload


@contextmanager
def direct(_: int) -> Iterator[Way]:
    """Both ends on one daemon, whose PDUs are looped back."""
    names = [f"{side}{i}" for side in "cf" for i in range(TOPICS[SHARED])]
    with running(AIR._replace(backend=SHARED), [1], names) as daemons:
        address = Address(SHARED, str(daemons.folders[1]))
        yield Way({side: End(address) for side in ROBOT}, daemons.processes)


@contextmanager
def ether(_: int) -> Iterator[Way]:
    """A daemon for each end, and the hub of their air."""
    names = [f"t{i}" for i in range(TOPICS["ether"])]
    with running(AIR, list(ROBOT.values()), names) as daemons:
        ends = {
            side: End(Address("ether", str(daemons.folders[robot])))
            for side, robot in ROBOT.items()
        }
        yield Way(ends, daemons.processes)


@contextmanager
def line(baud: int, size: int) -> Iterator[Way]:
    """A daemon for each end, and a serial line between; PDUs have room for one message.

    The PDUs are octets without framing. The daemons find them by their CRC, and send the next one
    when the line has carried the last. The line is the one of the other peers.
    """
    names = [f"t{i}" for i in range(TOPICS["line"])]
    with ExitStack() as stack:
        wire = start_module(stack, "line", "benchmarks.peers.latency.wire", str(baud), "tcp")
        precede(wire, real_time=True)
        own = {
            robot: LINE.format(port=port, rate_bit_s=baud * 8 / BITS_PER_BYTE)
            for robot, port in zip(ROBOT.values(), json.loads(wire.line()), strict=True)
        }
        air = AIR._replace(backend="gnuradio", pdu_size=size + PDU_OVERHEAD)
        daemons = stack.enter_context(running(air, list(ROBOT.values()), names, own))
        ends = {
            side: End(Address("line", str(daemons.folders[robot]))) for side, robot in ROBOT.items()
        }
        yield Way(ends, [wire, *daemons.processes], lambda: late_s(wire))
