"""One running node: connects the link to the bus and to the PDU link."""

import asyncio
import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import msgspec

from sdrlinkd import __version__
from sdrlinkd.airwatch import AirWatch
from sdrlinkd.bus import Bus, Ingress
from sdrlinkd.config import Setup
from sdrlinkd.health import Health, Level, Line, line_told
from sdrlinkd.hostclock import HostClock
from sdrlinkd.keeping import Keeping
from sdrlinkd.link import (
    AS_CONFIGURED,
    Burst,
    Link,
    Names,
    Opportunity,
    Outcome,
    Overrides,
    PduLinkTraits,
    Told,
)
from sdrlinkd.localtime import UNKNOWN, PublishClock, at_once, host_clocks, local_times
from sdrlinkd.opening import Opening
from sdrlinkd.pdulink import Heard, PduLink
from sdrlinkd.reports import Snapshot
from sdrlinkd.traffic import OwnTraffic
from sdrlinkd.wanting import Wanting

if TYPE_CHECKING:
    # Its package imports the bag readers, which the daemon on a robot does not need.
    from sdrlinkd.adapters import ChronySocket, Due, MessageTypes, Transforms

TICK_S = 0.05
SHORTEST_TICK_S = 0.001

log = logging.getLogger("sdrlinkd")


class Node:
    """Connects the link, the bus and the PDU link; it has no queue and takes no decision itself.

    `types` knows which messages begin with a std_msgs/Header, and the stop messages of commands.
    `chrony` receives samples of another robot's clock. `keeping` keeps the state of keys.
    """

    def __init__(
        self,
        setup: Setup,
        link: Link,
        opening: Opening,
        open_bus: Callable[[Ingress], Bus],
        transforms: Mapping[int, "Transforms"],
        types: "MessageTypes",
        chrony: "ChronySocket | None" = None,
        keeping: Keeping | None = None,
    ) -> None:
        self._keeping = keeping
        self._setup = setup
        self._link = link
        self._opening = opening
        self._transforms = transforms
        self._types = types
        self._host_clock = HostClock(link, chrony, setup.config.chrony.robot)
        self.health = Health()
        self._publish_clock = PublishClock()
        self._traffic: OwnTraffic[Due] | None = None
        self._ticked_at = float("-inf")
        self._is_lockstep = self._is_attached = False
        self._queue_moved = asyncio.Event()
        self._started_at, self._loop_lag_s = time.monotonic(), 0.0
        self._draining = False
        self.bus = open_bus(self)
        self.wanting = Wanting(setup, link, self.bus)
        self._air = AirWatch(self.bus, lambda: self._pdu_link)

    @property
    def _pdu_link(self) -> PduLink:
        return self._opening.pdu_link

    # The bus's Ingress.

    def submit(
        self,
        topic_id: int,
        payload: bytes,
        overrides: Overrides = AS_CONFIGURED,
        published_ns: int | None = None,
    ) -> None:
        """Take a message from a producer."""
        now, clocks = at_once(self._pdu_link.now, host_clocks)
        if not self._is_lockstep and (age_s := self._publish_clock.age(published_ns, *clocks)):
            overrides = overrides._replace(age_s=age_s)
        transforms = self._transforms.get(topic_id)
        if transforms is not None:
            gathered, reason = transforms.take(payload, now)
            if gathered is None:
                self.refuse(reason, topic_id, overrides.receipt, overrides.dst)
                return
            payload = gathered
        self._link.submit(topic_id, payload, now, overrides)
        if overrides.receipt:
            self._tell_verdicts()
        self._pdu_link.wake()

    def refuse(
        self, reason: str, topic_id: int | None = None, receipt: str = "", dst: int | None = None
    ) -> None:
        """Count a message that the bus refused."""
        self._link.refuse(reason, topic_id, receipt, dst)
        if receipt:
            self._tell_verdicts()

    # The PDU link's listener.
    def attach(self, traits: PduLinkTraits) -> None:
        """Fit the link to the PDU link, which has just opened. Raises ConfigError."""
        config = self._opening.config
        fit = self._link.attach(traits, config.access, config.rate)
        log.info("access %s", fit.settled.sentence)
        self._is_lockstep, self._is_attached = traits.is_lockstep, True
        self.health.shares_air = traits.shares_air
        if self._traffic is not None:
            self._traffic.begin(self._pdu_link.now())

    def heard(self, pdus: Sequence[Heard]) -> None:
        """Take PDUs from the air, and publish the messages that they complete."""
        now, now_ns = at_once(self._pdu_link.now, time.time_ns)
        link = self._link
        self._air.heard(pdus)
        for data, at, snr_db, ended_at, doppler_hz in pdus:
            messages = link.hear(data, at, snr_db, now, ended_at, doppler_hz)
            # First, as the PDU may bring both a new meaning of a number and messages of it.
            self.bus.forget_topics(link.take_changed_topics())
            for message in messages:
                times, age_s = UNKNOWN, link.delivered(message, now)
                if age_s is not None:
                    has_header = self._types.has_header(message.topic.type)
                    times = local_times(link, message, age_s, now, now_ns, has_header)
                received_ns = now_ns - round((now - message.heard_at) * 1e9)
                self.bus.publish(message, age_s, received_ns, times, link.retain(message))
        self._tell_verdicts()
        if link.relays:
            self._pdu_link.wake()

    def advance(self, now: float) -> None:
        """Advance to `now`: submit generated traffic that is due and run the link's timers."""
        for at, message in self._traffic.due(now) if self._traffic else ():
            self._link.submit(message.topic_id, message.payload, at)
            self._pdu_link.wake()
        if now - self._ticked_at >= TICK_S:
            self._ticked_at = now
            for topic_id, transforms in self._transforms.items():
                if (gathered := transforms.flush(now)) is not None:
                    self._link.submit(topic_id, gathered, now)
                    self._pdu_link.wake()
            self.wanting.look(now)
            self._air.look()
            if self._keeping is not None:
                self._keeping.look(now, at_once=self._is_lockstep)
            self._link.handle_timers(now)
            self._tell_verdicts()
            self._queue_moved.set()  # messages may have expired
        if now >= self._link.silence_at:
            self._stop_silent(now)

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The next burst, decided now; None if there is none."""
        burst = self._link.next_burst(opportunity)
        self._air.composed(burst)
        return burst

    def next_wakeup(self, now: float) -> float:
        """Earliest time on the link's clock at which there may be something to send."""
        return self._link.next_wakeup(now)

    def settled(self, burst: Burst, outcome: Outcome, at: float) -> None:
        """Report the outcome of a burst to the link."""
        self._link.confirm(burst, outcome, at)
        self._air.settled(burst, outcome)
        self._tell_verdicts()
        self._queue_moved.set()

    # The daemon's tasks.

    def play(self, traffic: Iterator["Due"]) -> None:
        """Send generated `traffic` at its times, counted from when the PDU link is up."""
        self._traffic = OwnTraffic(traffic)

    async def carry(self) -> None:
        """Bring the PDU link up and run it, forever. Raises UserError."""
        waits = self._setup.config.waits_for_consumer
        while True:
            carry = await self._opening.until_up(self)
            if waits:
                await self.bus.has_consumer.wait()
            await self._opening.run(carry)

    async def tick(self) -> None:
        """Run the link's timers and measure the event loop's lag, forever."""
        while True:
            silent_s = self._link.silence_at - self._pdu_link.now()
            tick_s = TICK_S if self._is_lockstep else min(TICK_S, max(silent_s, SHORTEST_TICK_S))
            due = time.monotonic() + tick_s
            self._publish_clock.turned(host_clocks()[1])
            await asyncio.sleep(tick_s)
            self._loop_lag_s = max(time.monotonic() - due, 0.9 * self._loop_lag_s)
            if not self._is_attached:
                # No PDU link has opened yet, so it is unknown whether it runs in real time.
                self._link.expire_queue(self._pdu_link.now())
                self._tell_verdicts()
            elif not self._is_lockstep:
                self._host_clock.look(self._pdu_link.now())
                self.advance(self._pdu_link.now())
                await self._end_recording()

    async def _end_recording(self) -> None:
        """Close a recording once it holds all generated traffic; a played one ends by itself."""
        if self._traffic and self._traffic.is_over and not self._link.has_work:
            self._traffic, config = None, self._setup.config
            if config.backend == "iqfile" and not config.iqfile.receive:
                await self._pdu_link.idle()
                await self._pdu_link.close()

    async def drain(self, at_most_s: float) -> None:
        """Stop taking messages, send the queue for at most `at_most_s`, and drop the rest."""
        self._draining = True
        await self.bus.stop_ingress()
        self._link.drain()
        self._pdu_link.wake()
        try:
            # Without a radio, waiting sends nothing.
            is_vain = self._opening.state in ("waiting", "refused")
            async with asyncio.timeout(0 if is_vain else at_most_s):
                while self._link.has_work:
                    self._queue_moved.clear()
                    await self._queue_moved.wait()
                await self._pdu_link.idle()
        except TimeoutError:
            pass
        self._link.shut_down()
        self._tell_verdicts()

    def why(self, topic_id: int, told: Told) -> list[str]:
        """What happens to a topic's messages and why, in plain sentences.

        If the verdict on the daemon is not OK, it follows the first sentence, and then what the
        receiver cuts out of what it hears.
        """
        policy, *rest = self._link.why(topic_id, told, self._pdu_link.now())
        snapshot = self.snapshot(0)
        verdict, lines = snapshot.verdict, snapshot.carrier.lines
        heard = [
            f"the receiver cuts {line_told(line)}: {line.cut_pct:g} % of the band" for line in lines
        ]
        if verdict.level != "OK":
            heard.insert(0, f"the link is {verdict.level}: {'; '.join(verdict.reasons)}")
        return [policy, *heard, *rest]

    def snapshot(self, control_requests: int) -> Snapshot:
        """A snapshot of everything that the daemon reports now."""
        now = self._pdu_link.now()
        pdu_link = self._opening.report(time.monotonic())
        noted = self._link.notices(now, self._setup.topic_warnings)
        snapshot = Snapshot(
            version=__version__,
            node=self._setup.node_id,
            namespace=self._setup.config.namespace,
            state="draining" if self._draining else "running",
            taken_at_unix_ns=time.time_ns(),
            uptime_s=time.monotonic() - self._started_at,
            loop_lag_ms=self._loop_lag_s * 1e3,
            host_clock_steps=self._host_clock.steps,
            carrier=pdu_link,
            bus=self.bus.report(control_requests),
            link=self._link.report(now, Names(self.bus.names_in(), self.bus.names_out())),
            notices=[*self._setup.warnings, *pdu_link.notices, *noted],
        )
        return msgspec.structs.replace(snapshot, verdict=self.health.judge(snapshot))

    def _tell_verdicts(self) -> None:
        for verdict in self._link.take_verdicts():
            self.bus.tell(verdict)

    def _stop_silent(self, now: float) -> None:
        """Publish the stop message of each command topic that fell silent, once."""
        for src, topic_id in self._link.take_silent(now):
            topic = self._link.heard_topic(src, topic_id)
            if topic is None:
                continue
            name = self._setup.republished(src, topic.name)
            if (stop := self._types.stop(topic)) is None:
                done, level = "but no stop message can be made for its type", Level.ERROR
            else:
                done, level = "published the stop message", Level.WARNING
                self.bus.publish_stop(src, topic, stop)
            line = Line(name, level, f"{name}: silent, {done}")
            if self.health.passed(line, time.monotonic() - self._started_at) is not None:
                log.log(level, "%s", line.text)

    def audit(self) -> list[str]:
        """Discrepancies in the ledger, as sentences; empty when it adds up."""
        return self._link.audit()
