"""The link: one node's whole traffic, as a calculator over bytes and `now`."""

from collections.abc import Hashable, Mapping
from random import Random

from sdrlinkd.link.inbox import Delivered, Inbox
from sdrlinkd.link.meters import RateMeter, RecentAges
from sdrlinkd.link.params import LinkParams, QueueParams, ReassemblyParams
from sdrlinkd.link.qos import AS_CONFIGURED, Overrides, TopicPolicy
from sdrlinkd.link.sender import Burst, Outcome, Sender
from sdrlinkd.reports import RATE_WINDOW_S
from sdrlinkd.wire import Beacon, Record, Registry, build_records, equal_payload

INFINITE = float("inf")


class Link:
    """Joins sender and inbox; holds the beacons. Never waits, never reads a clock.

    `now`, `start` and `at` are seconds on one clock of the caller's choice; `rng` is the only
    chance. `hears_self` is the paper's loopback experiment.
    """

    def __init__(
        self,
        params: LinkParams,
        queue: QueueParams,
        reassembly: ReassemblyParams,
        registry: Registry,
        own_id: int,
        rng: Random,
        *,
        hears_self: bool = False,
    ) -> None:
        self.params = params
        self.registry = registry
        self.own_id = own_id
        self.digest = registry.digest()
        self._beacon_digest = self.digest
        if len(build_records([self.digest])) > equal_payload(params.pdu_size, 1):
            self._beacon_digest = self.digest.shortened()
        self.sender = Sender(params, queue, registry, own_id, rng, reassembly.timeout_s)
        self.inbox = Inbox(params, reassembly, registry, own_id, hears_self)
        self.rates = RateMeter(RATE_WINDOW_S)
        self.ages: dict[tuple[int, int], RecentAges] = {}
        self._boot_id = rng.randrange(1 << 16)
        self._beacon_number = 0
        self._beacon_at = INFINITE
        if params.beacon_s > 0 and registry.has_control:
            self._beacon_at = 0.0

    def set_policies(self, policies: Mapping[int, TopicPolicy]) -> None:
        """Apply per-topic policies by topic id; the others get the defaults."""
        self.sender.set_policies(policies)

    def submit(
        self,
        topic_id: int,
        payload: bytes,
        now: float,
        overrides: Overrides = AS_CONFIGURED,
    ) -> str | None:
        """Queue a message; None, or the ledger's reason for refusing it."""
        return self.sender.submit(topic_id, payload, now, overrides)

    def compose(self, start: float, max_pdus: int) -> Burst | None:
        """The burst that should leave at `start`, decided now; None when there is nothing.

        A beacon that is due rides in spare room; when traffic leaves none for a whole period, or
        there is no traffic, it gets a PDU of its own.
        """
        overdue = False
        if start >= self._beacon_at:
            overdue = self.sender.packetizer.offered
            self._offer_beacon(start)
        burst = self.sender.compose_records() if overdue else self.sender.compose(start, max_pdus)
        if burst is None and self.sender.packetizer.offered:
            burst = self.sender.compose_records()
        return burst

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """What the radio says became of a burst."""
        self.sender.confirm(burst, outcome, now)

    def hear(self, data: bytes, at: float, snr_db: float | None = None) -> list[Delivered]:
        """Take a PDU whose burst's preamble arrived at `at`; the messages it completed."""
        return self.inbox.hear(data, at, snr_db)

    def delivered(self, message: Delivered, now: float) -> float | None:
        """The age in seconds at which `message` is handed over at `now`; None when unknown."""
        if message.origin_at is None:
            return None
        age_s = now - message.origin_at
        key = (message.src, message.topic_id)
        ages = self.ages.get(key)
        if ages is None:
            ages = self.ages[key] = RecentAges()
        ages.add(age_s)
        return age_s

    def handle_timers(self, now: float) -> None:
        """Let time pass: expiries, reassembly timeouts, rate samples."""
        self.sender.expire(now)
        self.inbox.expire(now)
        if self.rates.is_due(now):
            self.rates.sample(self.rate_counters(), now)

    def next_wakeup(self, now: float) -> float:
        """When `compose` may next return a burst; not after `now`: at once."""
        return min(self._beacon_at, self.sender.packetizer.next_wakeup(now))

    def drain(self) -> None:
        """Nothing more will come: partial PDUs go at once, beacons end."""
        self._beacon_at = INFINITE
        self.sender.packetizer.flush()

    def shut_down(self) -> None:
        """Drop what could not be sent any more, by name."""
        self.sender.shut_down()

    def audit(self) -> list[str]:
        """Where the ledger does not add up; empty when it does."""
        return self.sender.audit() + self.inbox.audit()

    def rate_counters(self) -> dict[Hashable, int]:
        """The counters of which the snapshot shows rates."""
        tx: dict[Hashable, int] = {
            ("tx", topic.id): self.sender.tally(topic.id).accepted for topic in self.registry.topics
        }
        rx: dict[Hashable, int] = {
            ("rx", *key): tally.delivered for key, tally in self.inbox.tallies.items()
        }
        return {**tx, **rx}

    def _offer_beacon(self, start: float) -> None:
        records: list[Record] = [Beacon(self._boot_id, self._beacon_number), self._beacon_digest]
        self.sender.packetizer.offer(records)
        self._beacon_number = (self._beacon_number + 1) & 0xFFFF
        self._beacon_at = start + self.params.beacon_s
