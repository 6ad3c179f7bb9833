"""A robot sends, gateways and an operator listen: what came where, and when."""

import asyncio
import contextlib
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import zenoh

from benchmarks.absent import PeerError
from benchmarks.fleet.field import ROBOT, Field
from benchmarks.peers.plain_zenoh import KEY, plain_config
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.fleet import FleetClient

SIZE = 724
CDR = b"\0\1\0\0"
SETTLED_S = 3.0
"""Time in s in which gateways meet the robot and agree who leads."""
QUIET_S = 1.0


@dataclass
class Drive:
    """Times of arrival in s by number of the message; at the operator, every one of them."""

    sent_at: dict[int, float] = field(default_factory=dict)
    at_gateways: dict[int, dict[int, float]] = field(default_factory=dict)
    at_operator: dict[int, list[float]] = field(default_factory=dict)
    put_by: dict[int, int] = field(default_factory=dict)
    """The gateway that put what came first at the operator; unknown for plain bridges."""
    duplicates: int = 0
    """Second copies that the operator's library dropped."""

    @property
    def heard(self) -> set[int]:
        """The messages that at least one gateway's daemon handed over."""
        return {number for each in self.at_gateways.values() for number in each}

    def loss(self, gateway: int) -> float:
        """Share of the messages that a gateway did not hear."""
        return 1 - len(self.at_gateways[gateway]) / len(self.sent_at)

    def first_at(self, number: int) -> float:
        """When a message that was heard came to the first gateway's consumers."""
        return min(each[number] for each in self.at_gateways.values() if number in each)

    def late_ms(self) -> list[float]:
        """How much later than there each message was at the operator, in the order of sending."""
        both = sorted(self.heard & set(self.at_operator))
        return [1e3 * (self.at_operator[number][0] - self.first_at(number)) for number in both]

    def added_ms(self) -> list[float]:
        """How much later each message was at the operator than at its gateway's own consumers."""
        return [
            1e3 * (at[0] - self.at_gateways[self.put_by[number]][number])
            for number, at in sorted(self.at_operator.items())
            if number in self.at_gateways.get(self.put_by.get(number, -1), {})
        ]


def message(number: int, size: int = SIZE) -> bytes:
    """A message that says its number."""
    return CDR + number.to_bytes(8, "little") + bytes(size - 12)


def number_of(payload: bytes) -> int:
    """The number that a message says."""
    return int.from_bytes(payload[4:12], "little")


async def drive(
    where: Field, n: int, every_s: float, change: Callable[[int], None] = lambda _: None
) -> Drive:
    """Send `n` messages; `change` is called with each number before it is sent."""
    found = Drive()
    with contextlib.ExitStack() as stack:
        for gateway in where.gateways:
            told = found.at_gateways[gateway] = {}
            stack.enter_context(_listening(where.folders[gateway], told))
        async with _operator(where, found):
            await asyncio.sleep(SETTLED_S)
            begin = time.monotonic()
            with Publisher(runtime_dir=where.folders[ROBOT]) as out:
                for number in range(n):
                    change(number)
                    await asyncio.sleep(max(0.0, begin + number * every_s - time.monotonic()))
                    found.sent_at[number] = time.monotonic()
                    out.send(f"/robot_{ROBOT}/odom", message(number))
            await asyncio.sleep(QUIET_S)
    if not found.at_operator:
        raise PeerError("nothing came to the operator")
    return found


@contextlib.asynccontextmanager
async def _operator(where: Field, found: Drive) -> AsyncIterator[None]:
    """Notes what comes at the operator."""
    if where.are_plain:
        with plain_operator(where.endpoint, found.at_operator):
            yield
        return
    async with FleetClient(where.params) as operator:
        hearing = asyncio.ensure_future(_hear(operator, found))
        yield
        hearing.cancel()
        found.duplicates = operator.duplicates


async def _hear(operator: FleetClient, found: Drive) -> None:
    async for each in operator:
        if each.topic == "odom" and not each.passed.again:
            number = number_of(each.payload)
            found.at_operator.setdefault(number, []).append(time.monotonic())
            found.put_by.setdefault(number, each.passed.gw)


@contextlib.contextmanager
def plain_operator(endpoint: str, came: dict[int, list[float]]) -> Iterator[None]:
    """Notes in `came` when each message of plain bridges came, in a thread of Zenoh's."""

    def take(sample: zenoh.Sample) -> None:
        number = number_of(sample.payload.to_bytes())
        came.setdefault(number, []).append(time.monotonic())

    with zenoh.open(plain_config(endpoint)) as session:
        subscribed = session.declare_subscriber(KEY, take)
        yield
        subscribed.undeclare()  # type: ignore[no-untyped-call]


@contextlib.contextmanager
def _listening(directory: Path, told: dict[int, float]) -> Iterator[None]:
    """Notes when each message came to a consumer of a daemon."""
    is_over = threading.Event()
    ready = threading.Event()

    def listen() -> None:
        with Subscriber(f"/rx_robot_{ROBOT}/odom", runtime_dir=directory) as heard:
            ready.set()
            while not is_over.is_set():
                came = heard.receive(0.2)
                if came is not None:
                    told[number_of(came.payload)] = time.monotonic()

    thread = threading.Thread(target=listen)
    thread.start()
    ready.wait(10)
    try:
        yield
    finally:
        is_over.set()
        thread.join()
