"""The receive half of the link: from PDUs heard to messages delivered."""

from collections import Counter
from collections.abc import Sequence
from math import inf

from sdrlinkd.errors import PduError
from sdrlinkd.link.packing import is_sound, missing_fragments
from sdrlinkd.link.params import LinkParams, ReassemblyParams
from sdrlinkd.link.queue import DEFAULT_POLICY, Inflated, RxTally, TopicPolicy, balance
from sdrlinkd.link.receive.ages import Ages
from sdrlinkd.link.receive.delivered import CDR_HEADER_SIZE, DELIVERED, Delivered
from sdrlinkd.link.receive.neighbors import Neighbor
from sdrlinkd.link.receive.observer import InboxObserver
from sdrlinkd.wire import (
    BROADCAST,
    CONTROL_TOPIC_ID,
    Beacon,
    ControlEntries,
    Entry,
    Parity,
    Pdu,
    Reassembly,
    ReassemblyLimits,
    Receipt,
    Record,
    Registry,
    RegistryDigest,
    Stamp,
    identity,
    lasting_identity,
    parse,
    read_control_entries,
)

_NO_CONTROL = ControlEntries([], 0, 0)


class Inbox:
    """Checks, duplicate suppression, reassembly and the RX ledger of one node."""

    def __init__(
        self,
        params: LinkParams,
        reassembly: ReassemblyParams,
        registry: Registry,
        own_id: int,
        hears_self: bool,
        observer: InboxObserver,
        inflated: Inflated,
        max_expanded: int,
    ) -> None:
        self._pdu_size = params.pdu_size
        self._hop_limit = params.hop_limit
        self._n_topics = len(registry)
        self._own_id = own_id
        self._hears_self = hears_self
        self._observer = observer
        self._inflated = inflated
        self._max_expanded = max_expanded
        self.fragments_repaired = 0
        self.policies: dict[int, TopicPolicy] = {}
        self._has_control = registry.has_control
        limits = ReassemblyLimits(
            reassembly.timeout_s, reassembly.source_bytes, reassembly.total_bytes
        )
        self.reassembly = Reassembly(limits)
        self._ages = Ages(reassembly.timeout_s)
        self.neighbors: dict[int, Neighbor] = {}
        self.tallies: dict[tuple[int, int], RxTally] = {}
        self.pdus_heard = 0
        self.pdus_used = 0
        self.pdus_dropped: Counter[str] = Counter()
        self.control_bad = 0
        """Control entries that could not be read, rx_control_bad."""

    def hear(
        self, data: bytes, at: float, snr_db: float | None, now: float, ended_at: float
    ) -> list[Delivered]:
        """Take a PDU whose burst's preamble arrived at `at`; the messages it completed."""
        self.pdus_heard += 1
        try:
            pdu = parse(data, self._pdu_size)
        except PduError as error:
            return self._drop(error.reason)
        control = read_control_entries(pdu) if self._has_control else _NO_CONTROL
        records = control.records
        is_relayed = pdu.hop < self._hop_limit
        stamps = [record for record in records if isinstance(record, Stamp)]
        if pdu.src != self._own_id or is_relayed:
            self._observer.pdu_from(pdu, stamps, at, is_relayed)
        if pdu.src == self._own_id and not self._hears_self:
            return self._drop("rx_own")
        neighbor = self.neighbors.get(pdu.src) or self._new_neighbor(pdu.src, at)
        neighbor.heard_at(at)
        _, seq, crc = lasting_identity(data) if stamps else identity(data)
        if not neighbor.track.heard(seq, crc):
            neighbor.duplicates += 1
            return self._drop("rx_dup")
        neighbor.heard += 1
        self.control_bad += control.n_bad
        neighbor.hops_left = pdu.hop
        if not is_relayed:
            neighbor.note_snr(snr_db)
        for stamp in stamps:
            self._ages.stamp(pdu.src, stamp, at)
        is_sent_on = self._observer.sends_on(pdu, data, at)
        if pdu.dst not in (BROADCAST, self._own_id) and not self._hears_self:
            return self._drop("rx_relayed" if is_sent_on else "rx_not_for_us")
        for record in records:
            if isinstance(record, Beacon):
                if not is_relayed:
                    self._observer.record_from(pdu.src, record, at)
                if neighbor.take_beacon(record):
                    neighbor.track.restart(seq, crc)
                    self._observer.newcomer(pdu.src, at)
            elif isinstance(record, RegistryDigest):
                neighbor.digest = record
            elif isinstance(record, Receipt):
                if pdu.dst == self._own_id or record.node == self._own_id:
                    self._observer.record_from(pdu.src, record, at)
            elif not is_relayed and not isinstance(record, Parity | Stamp):
                self._observer.record_from(pdu.src, record, at)
        repaired = self._repaired(pdu.src, records, at) if records else []
        if self.reassembly.lost:
            # Parity needs room, too.
            self._note_lost(now)
        entries = [*pdu.entries, *repaired] if repaired else pdu.entries
        if len(entries) == control.n_entries:
            return self._drop("rx_control" if control.n_bad < len(entries) else "rx_control_bad")
        self.pdus_used += 1
        return self._take_entries(pdu, entries, neighbor, at, now, ended_at)

    def fresh_until(self, pdu: Pdu) -> float:
        """When all its messages will be too old; inf where that is not known."""
        until = -inf
        for entry in pdu.entries:
            topic_id = entry.topic_id
            if topic_id == CONTROL_TOPIC_ID and self._has_control:
                continue
            origin_at = self._ages.look(pdu.src, topic_id, entry.entry_id).at
            if origin_at is None:
                return inf
            lifespan_s = self.policies.get(topic_id, DEFAULT_POLICY).own_lifespan_s
            until = max(until, origin_at + lifespan_s)
        return until if until > -inf else inf

    def expire(self, now: float) -> None:
        """Give up what has waited too long."""
        self.reassembly.expire(now)
        self._note_lost(now)
        self._ages.expire(now, self.reassembly.holds)

    def audit(self) -> list[str]:
        """What does not add up in the RX ledgers; empty when all does."""
        dropped: Counter[str] = Counter()
        for tally in self.tallies.values():
            dropped.update(tally.dropped)
        return balance(
            "rx pdus", self.pdus_heard, {"used": self.pdus_used, **self.pdus_dropped}
        ) + balance(
            "rx messages",
            self.reassembly.started,
            {
                "delivered": sum(tally.delivered for tally in self.tallies.values()),
                "held": self.reassembly.held,
                **dropped,
            },
        )

    def _drop(self, reason: str) -> list[Delivered]:
        self.pdus_dropped[reason] += 1
        return []

    def _new_neighbor(self, src: int, at: float) -> Neighbor:
        self._observer.newcomer(src, at)
        neighbor = self.neighbors[src] = Neighbor(src)
        return neighbor

    def _repaired(self, src: int, records: list[Record], at: float) -> list[Entry]:
        """Fragments that were missing, where these records bring the parity that tells them."""
        partials = {}
        for record in records:
            if isinstance(record, Parity) and is_sound(record):
                partial = self.reassembly.hold(src, record, at)
                if partial is not None:
                    partials[record.topic_id, record.entry_id] = partial
        entries = [
            Entry(*ids, number, partial.total, part)
            for ids, partial in partials.items()
            for number, part in missing_fragments(partial).items()
        ]
        self.fragments_repaired += len(entries)
        return entries

    def _take_entries(
        self,
        pdu: Pdu,
        entries: Sequence[Entry],
        neighbor: Neighbor,
        at: float,
        now: float,
        ended_at: float,
    ) -> list[Delivered]:
        src = pdu.src
        reassembly = self.reassembly
        delivered = []
        for entry in entries:
            topic_id = entry.topic_id
            if topic_id == CONTROL_TOPIC_ID and self._has_control:
                continue
            payload = reassembly.add(src, entry, at)
            if payload is None:
                continue
            tally = self.tallies.get((src, topic_id)) or self._tally(src, topic_id)
            origin = self._ages.take(src, topic_id, entry.entry_id)
            payload, reason = self._verdict(topic_id, payload, pdu.compressed, origin.at, now)
            if origin.asks:
                age_s = None if origin.at is None else now - origin.at
                ended = reason or DELIVERED
                self._observer.ended(src, topic_id, entry.entry_id, ended, age_s, now)
            if reason is not None:
                tally.dropped[reason] += 1
                continue
            tally.delivered += 1
            tally.delivered_bytes += len(payload)
            delivered.append(
                Delivered(
                    src, topic_id, payload, tally.delivered, neighbor.track.lost,
                    origin.at, at, pdu.hop,
                    neighbor.snr_db, reassembly.began_at, ended_at,
                )
            )  # fmt: skip
        if reassembly.lost:
            self._note_lost(now)
        return delivered

    def _verdict(
        self,
        topic_id: int,
        payload: bytes,
        is_compressed: bool,
        origin_at: float | None,
        now: float,
    ) -> tuple[bytes, str | None]:
        """(the message as it was submitted, why it is not handed over or None)."""
        if topic_id >= self._n_topics:
            return payload, "rx_unknown_topic"
        policy = self.policies.get(topic_id, DEFAULT_POLICY)
        reason = None
        if is_compressed:
            most = policy.max_bytes or self._max_expanded
            payload, reason = self._inflated.expand(payload, most)
        if reason is None:
            reason = _refusal(payload, policy, origin_at, now)
        # Without a control channel nobody can know.
        if reason == "rx_no_age" and not self._has_control:
            reason = None
        return payload, reason

    def _note_lost(self, now: float) -> None:
        for src, topic_id, entry_id, reason in self.reassembly.take_lost():
            self._tally(src, topic_id).dropped[reason] += 1
            if self._ages.take(src, topic_id, entry_id).asks:
                self._observer.ended(src, topic_id, entry_id, reason, None, now)

    def _tally(self, src: int, topic_id: int) -> RxTally:
        return self.tallies.setdefault((src, topic_id), RxTally())


def _refusal(
    payload: bytes, policy: TopicPolicy, origin_at: float | None, now: float
) -> str | None:
    """Why a whole message is not handed over."""
    if len(payload) < CDR_HEADER_SIZE:
        return "rx_bad_cdr"
    if policy.max_bytes and len(payload) > policy.max_bytes:
        return "rx_size_cap"
    if policy.own_lifespan_s < inf:
        if origin_at is None:
            return "rx_no_age" if policy.stamp else None
        if now - origin_at > policy.own_lifespan_s:
            return "rx_expired"
    return None
