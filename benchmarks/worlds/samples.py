"""Robots in one process on a simulated air in lock-step, with a daemon's link, modem and radio.

They have no bus.
"""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from random import Random
from typing import NamedTuple, TypeVar

from backends import AirParams, LocalEther, Radio, RadioParams, World
from benchmarks.worlds.arrivals import Arrival
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AccessParams,
    Burst,
    ClockParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    PduLinkTraits,
    QueueParams,
    RateParams,
    ReassemblyParams,
    may_share,
)
from sdrlinkd.modem import modem_on
from sdrlinkd.pdulink import Heard
from sdrlinkd.wire import make_registry

TOPICS = (("data", "std_msgs/msg/ByteMultiArray"), ("stop", "std_msgs/msg/Empty"))
DATA, STOP = 0, 1
TICK_S = 0.05
NO_CLOCK = ClockParams(period_s=0.0)


class Got(NamedTuple):
    """A message that arrived, and its age at arrival."""

    src: int
    topic_id: int
    age_s: float


class Station:
    """One robot, which drives its link like a daemon."""

    def __init__(
        self, own_id: int, radio: Radio, access: AccessParams, modem: ModemParams, pdu_size: int,
        arrivals: Sequence[Arrival], seed: int, clock: ClockParams = NO_CLOCK,
    ) -> None:  # fmt: skip
        self.link = Link(
            LinkParams(pdu_size=pdu_size), QueueParams(), ReassemblyParams(),
            make_registry(TOPICS), own_id, Random(seed), clock=clock,
        )  # fmt: skip
        self.modem = modem_on(modem, pdu_size, radio, "ether", may_share(access, own_id))
        self._access = access
        self._arrivals = iter(arrivals)
        self._next = next(self._arrivals, None)
        self._ticked_at = 0.0
        self.sent = 0
        self.got: list[Got] = []
        self.bursts = 0

    async def open(self) -> None:
        """Open the radio of this robot."""
        self.carry = await self.modem.open(self)

    def attach(self, traits: PduLinkTraits) -> None:
        """Note the radio's traits, and pass them to the link."""
        self.access = self.link.attach(traits, self._access, RateParams()).settled.access

    def advance(self, now: float) -> None:
        """Submit the messages that have arrived up to `now`."""
        while self._next is not None and self._next.at <= now:
            at, topic_id, payload, overrides = self._next
            self.link.submit(topic_id, payload, at, overrides)
            self.sent += 1
            self._next = next(self._arrivals, None)
        if now - self._ticked_at >= TICK_S:
            self._ticked_at = now
            self.link.handle_timers(now)

    def heard(self, pdus: Sequence[Heard]) -> None:
        """Take PDUs from the air, and record what they contained."""
        for data, at, snr_db, *_ in pdus:
            for message in self.link.hear(data, at, snr_db):
                age_s = self.link.delivered(message, self.modem.now())
                if age_s is not None:
                    self.got.append(Got(message.src, message.topic_id, age_s))

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The next burst to send, if any."""
        return self.link.next_burst(opportunity)

    def next_wakeup(self, now: float) -> float:
        """Time at which there may be something to send."""
        return self.link.next_wakeup(now)

    def settled(self, burst: Burst, outcome: Outcome, at: float) -> None:
        """Report the outcome of a burst to the link."""
        self.bursts += 1
        self.link.confirm(burst, outcome, at)


AnyStation = TypeVar("AnyStation", bound=Station)


async def run(
    air: AirParams,
    radios: dict[int, RadioParams],
    access: AccessParams,
    modem: ModemParams,
    pdu_size: int,
    arrivals: dict[int, list[Arrival]],
    until_s: float,
    seed: int,
) -> list[Station]:
    """Run stations with these arrivals on one air up to `until_s`, and return them."""

    def make(node: int, radio: Radio) -> Station:
        return Station(node, radio, access, modem, pdu_size, arrivals[node], 100 * seed + node)

    return await play(air, radios, make, until_s, seed)


async def play(
    air: AirParams,
    radios: dict[int, RadioParams],
    make: Callable[[int, Radio], AnyStation],
    until_s: float,
    seed: int,
    look: Callable[[Sequence[AnyStation]], None] = lambda _: None,
    looks_at_s: Iterable[float] = (),
) -> list[AnyStation]:
    """Run stations that `make` makes on one air up to `until_s`, and return them.

    `look` is called with all of them at the times `looks_at_s`.
    """
    ether = LocalEther(air, radios, World(air, {}), seed)
    stations = [make(each, ether.radios[each]) for each in radios]
    for station in stations:
        await station.open()
    async with asyncio.TaskGroup() as tasks:
        running = [tasks.create_task(station.carry()) for station in stations]
        for at_s in looks_at_s:
            await ether.run(at_s)
            look(stations)
        await ether.run(until_s)
        for station in stations:
            await station.modem.close()
        for task in running:
            task.cancel()
    return stations
