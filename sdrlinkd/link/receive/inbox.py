"""The receive side of the link, from PDUs heard to complete messages."""

from collections.abc import Sequence

from sdrlinkd.errors import PduError
from sdrlinkd.link.packing import is_sound, missing_fragments
from sdrlinkd.link.params import LinkParams, ReassemblyParams
from sdrlinkd.link.qos import CLASSES
from sdrlinkd.link.receive.acceptance import Acceptance
from sdrlinkd.link.receive.ages import Ages
from sdrlinkd.link.receive.completion import Completion
from sdrlinkd.link.receive.door import Admitted
from sdrlinkd.link.receive.events import Ended, Event, Newcomer, PduHeard, PduPlaced
from sdrlinkd.link.receive.heard_records import HeardRecords
from sdrlinkd.link.receive.naming import LARGE, name_of
from sdrlinkd.link.receive.neighbors import Neighbor, Neighbors
from sdrlinkd.link.receive.pdu_read import PduRead, PduReader
from sdrlinkd.link.receive.recorded import OwnPdus, RecentCommands
from sdrlinkd.link.receive.relaying import Relaying
from sdrlinkd.link.receive.repeated import RepeatedPdus
from sdrlinkd.link.receive.rx_ledger import Held, RxLedger
from sdrlinkd.link.receive.undeclared import Whole
from sdrlinkd.link.routes import Routes
from sdrlinkd.link.topics import HeardTopics
from sdrlinkd.wire import (
    BROADCAST,
    CONTROL_TOPIC_ID,
    PARTS,
    SEQ,
    Beacon,
    Clock,
    Entry,
    Parity,
    Pdu,
    Reassembly,
    ReassemblyLimits,
    Record,
    Registry,
    Repeat,
    identity,
    lasting_identity,
    parse_part,
)

OLDEST_S = 10.0
"""Largest time in s that is added to the ages in a PDU of unknown origin."""


class Inbox:
    """One node's checks, duplicate filter, reassembly and receive ledger.

    All results are returned as events, in the order in which they were found.
    """

    def __init__(
        self,
        params: LinkParams,
        reassembly: ReassemblyParams,
        registry: Registry,
        own_id: int,
        hears_self: bool,
        neighbors: Neighbors,
        routes: Routes,
        acceptance: Acceptance,
        ledger: RxLedger,
        topics: HeardTopics,
        completion: Completion,
        repeated: RepeatedPdus,
        own_pdus: OwnPdus,
        commands: RecentCommands,
        clear_size: int,
    ) -> None:
        self._own_pdus = own_pdus
        self._reader = PduReader(
            params, clear_size, has_control=registry.has_control, has_numbers=topics.has_numbers
        )
        self._repeated = repeated
        self._own_id = own_id
        self._hears_self = hears_self
        self._neighbors = neighbors
        self._routes = routes
        self._acceptance = acceptance
        self._has_control = registry.has_control
        self._topics = topics
        self._completion = completion
        self._records = HeardRecords(own_id, topics, completion)
        limits = ReassemblyLimits(
            reassembly.timeout_s, reassembly.source_bytes, reassembly.total_bytes
        )
        self._reassembly = Reassembly(limits)
        self._ages = Ages(reassembly.timeout_s)
        self._relaying = Relaying(
            routes, acceptance, topics, self._ages, has_control=registry.has_control
        )
        self._ledger = ledger
        self._commands = commands

    def hear(self, admitted: Admitted, now: float) -> list[Event]:
        """Take a PDU and return the events that follow from it."""
        if admitted.is_glance:
            return self._reader.glance(admitted)
        self._ledger.hear()
        events: list[Event] = []
        at, first_at = admitted.at, admitted.first_at
        try:
            read = self._reader.read(admitted)
        except PduError as error:
            return self._drop(error.reason, events)
        pdu, control, _, is_relayed, is_forwarded = read
        if is_forwarded:
            self._routes.forwarded(admitted.raw, at)
        stamps = read.stamps
        if not admitted.was_seen and (pdu.src != self._own_id or is_relayed):
            events.append(PduHeard(pdu, stamps, at, is_relayed, admitted.signal))
        if pdu.src == self._own_id and not self._hears_self:
            self._own_pdus.heard(admitted.raw, at)
            return self._drop("rx_own", events)
        neighbor = self._neighbors.get(pdu.src)
        if neighbor is None:
            neighbor = self._neighbors.meet(pdu.src)
            self._announce(pdu.src, at, events)
        neighbor.heard_at(at)
        key = self._key(admitted, read)
        track = neighbor.track
        told, repeated_at = read.told, None
        if admitted.number is not None:
            told, repeated_at = admitted.number, first_at
        is_known = admitted.ticks is None and self._commands.has_heard(pdu, admitted.raw, at)
        forwarded = CLASSES[pdu.qos] if is_forwarded else None
        is_new = not is_known and track.heard(
            *key[1:], at, told, is_sealed=key[0], forwarded=forwarded, first_at=repeated_at
        )
        if not is_new:
            neighbor.count_duplicate()
            return self._drop("rx_dup", events)
        neighbor.count_new(pdu.hop, is_repaired=track.fills and admitted.number is not None)
        if track.fills and not is_relayed:
            # It may be a repeated PDU whose REPEAT was lost.
            first_at = max(track.first_at(track.number, at), at - OLDEST_S)
            read = self._reader.read(admitted, at - first_at)
        records, stamps = read.records, read.stamps
        if control.n_bad:
            self._ledger.skip_records(control.n_bad)
        if not is_relayed:
            neighbor.note_snr(admitted.signal.snr_db, at)
        for stamp in stamps:
            self._ages.stamp(pdu.src, stamp, at)
        is_ours = pdu.dst in (BROADCAST, self._own_id) or self._hears_self
        to_relay = self._relaying.judge(read, admitted, first_at, track, is_ours=is_ours)
        is_relay = to_relay is not None and not to_relay.is_spare
        if track.is_numbered:
            is_wanted = is_ours or is_relay
            events.append(PduPlaced(read, track.number, track.skipped, is_wanted, at, is_ours))
        if to_relay is not None:
            events.append(to_relay)
        if not is_ours:
            if not is_relayed:
                self._records.take_wants(pdu.src, admitted, records, events)
            return self._drop("rx_relayed" if is_relay else "rx_not_for_us", events)
        for record in records:
            if isinstance(record, Beacon | Clock):
                self._take_boot_id(record.boot_id, neighbor, read, key, at, now, events)
            elif isinstance(record, Repeat) and not is_relayed and admitted.is_proven:
                self._ledger.skip_records(not self._repeated.take(record, pdu.src, track, at))
        self._records.take(pdu, admitted, neighbor, records, is_relayed, now, events)
        repaired = []
        if records:
            is_sealed = admitted.ticks is not None
            repaired = self._repaired(pdu.src, records, at, track.number, is_sealed=is_sealed)
        if self._reassembly.lost:
            # Parity takes memory, too, so older messages may have been evicted.
            self._note_lost(now, events)
        entries = [*pdu.entries, *repaired] if repaired else pdu.entries
        if len(entries) == control.n_entries:
            is_bad = control.n_bad >= len(entries)
            return self._drop("rx_control_bad" if is_bad else "rx_control", events)
        self._ledger.use()
        self._take_entries(pdu, entries, neighbor, admitted, now, events)
        return events

    def holds(self, src: int, topic_id: int, entry_id: int) -> bool:
        """Whether fragments of a message are held that lacks others."""
        return self._reassembly.holds(src, topic_id, entry_id)

    @property
    def held(self) -> Held:
        """Numbers of begun and of incomplete messages."""
        reassembly, undeclared = self._reassembly, self._completion.undeclared
        return Held(
            reassembly.started,
            reassembly.held + len(undeclared),
            reassembly.held_bytes + undeclared.n_bytes,
        )

    def expire(self, now: float) -> list[Event]:
        """Give up messages that have waited too long.

        Returns events for those whose senders want receipts.
        """
        events: list[Event] = []
        self._reassembly.expire(now)
        self._note_lost(now, events)
        self._completion.expire(now, events)
        self._ages.expire(now, self._reassembly.holds)
        return events

    def _take_boot_id(
        self, boot_id: int, neighbor: Neighbor, read: PduRead, key: tuple[bool, int, int],
        at: float, now: float, events: list[Event],
    ) -> None:  # fmt: skip
        if not neighbor.take_boot_id(boot_id, is_proven=key[0]):
            if boot_id == neighbor.boot_id:
                neighbor.track.goes_on()
            return
        neighbor.track.restart(*key[1:], at, read.told, is_forwarded=read.is_forwarded)
        self._forget(neighbor.src, now, events)
        self._announce(neighbor.src, at, events)

    @staticmethod
    def _key(admitted: Admitted, read: PduRead) -> tuple[bool, int, int]:
        """(whether T makes it unique, sequence number, T or CRC) of a PDU."""
        data = admitted.data
        if admitted.ticks is not None:
            return True, data[SEQ], admitted.ticks
        return False, *(lasting_identity(data) if read.stamps else identity(data))[1:]

    def _drop(self, reason: str, events: list[Event]) -> list[Event]:
        self._ledger.drop_pdu(reason)
        return events

    def _announce(self, src: int, at: float, events: list[Event]) -> None:
        """Add a Newcomer event for robot `src`, unless it is this robot."""
        if src != self._own_id:
            events.append(Newcomer(src, at))

    def _forget(self, src: int, now: float, events: list[Event]) -> None:
        """Forget what a robot had said and begun before its restart."""
        self._reassembly.forget(src)
        self._note_lost(now, events)
        self._completion.forget(src, now, events)
        self._topics.forget(src)

    def _repaired(
        self, src: int, records: list[Record], at: float, pdu_number: int, *, is_sealed: bool
    ) -> list[Entry]:
        """Missing fragments that can be computed now, with the parity in `records`."""
        partials = {}
        for record in records:
            if isinstance(record, Parity) and is_sound(record):
                partial = self._reassembly.hold(src, record, at, pdu_number, is_sealed=is_sealed)
                if partial is not None:
                    partials[record.topic_id, record.entry_id] = partial
        entries = [
            Entry(*ids, number, partial.total, part)
            for ids, partial in partials.items()
            for number, part in missing_fragments(partial).items()
        ]
        self._ledger.repair(len(entries))
        return entries

    def _take_entries(
        self,
        pdu: Pdu,
        entries: Sequence[Entry],
        neighbor: Neighbor,
        admitted: Admitted,
        now: float,
        events: list[Event],
    ) -> None:
        src, at = pdu.src, admitted.at
        reassembly, pdu_number = self._reassembly, neighbor.track.number
        is_sealed = admitted.ticks is not None
        for entry in entries:
            topic_id = entry.topic_id
            if topic_id == CONTROL_TOPIC_ID and self._has_control:
                continue
            payload = reassembly.add(src, entry, at, pdu_number, is_sealed=is_sealed)
            if payload is None:
                continue
            stamped = (topic_id, entry.entry_id)
            name = name_of(neighbor, entry.entry_id, reassembly.pdus)
            if topic_id == PARTS:
                part = parse_part(payload)
                joined = part and reassembly.join(src, entry.entry_id, part, at)
                if not joined:
                    continue
                topic_id, payload, entry_id, number = joined
                stamped = (PARTS, entry_id)
                name = name_of(neighbor, LARGE + number, reassembly.pdus)
            message = Whole(
                src, topic_id, payload, pdu.compressed, self._ages.take(src, *stamped), stamped, at,
                admitted.ended_at, reassembly.began_at, pdu.hop, neighbor.snr_db,
                name, admitted.is_proven, pdu.dst != BROADCAST, reassembly.is_sealed,
            )  # fmt: skip
            self._completion.take(message, now, events)
        if reassembly.lost:
            self._note_lost(now, events)

    def _note_lost(self, now: float, events: list[Event]) -> None:
        for src, topic_id, stamped, reason in self._reassembly.take_lost():
            if topic_id != PARTS:
                self._completion.drop(src, topic_id, reason)
            if self._ages.take(src, *stamped).asks:
                events.append(Ended(src, *stamped, reason, None, now))
