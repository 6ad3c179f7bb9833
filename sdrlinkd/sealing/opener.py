"""Opens the PDUs of others: keys, numbers, proofs and delays (wire document, 11.4 and 11.5)."""

import struct
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.sealing.contacts import SOON_S, Contacts
from sdrlinkd.sealing.held_keys import HeldKeys
from sdrlinkd.sealing.numbers import Numbers
from sdrlinkd.sealing.params import SecurityParams
from sdrlinkd.sealing.peers import Peer, Peers, Proof
from sdrlinkd.sealing.resuming import Recalling, Resuming
from sdrlinkd.sealing.strangers import Strangers
from sdrlinkd.wire import (
    AHEAD_UNIT_S,
    BROADCAST,
    CONTROL_TOPIC_ID,
    HEADER_SIZE,
    HELD_UNIT_S,
    HOP,
    TICKS_PER_S,
    Contact,
    FoundNumbers,
    KeyTold,
    LostNumbers,
    Pdu,
    Record,
    RecordType,
    aged,
    crc16,
    parse,
    parse_sealed,
    read_control_entries,
)

UNCERTAIN = 4
"""Least limit of undetected delays, in uncertainties of the radio's times."""
JUST_STARTED_S = 2.0
"""Time in s after a start in which PDUs of before are no attack."""
_make = tuple.__new__
"""Makes a named tuple in half the time that its own constructor takes."""
_CONTACT_MARK, _KEY_MARK = bytes((RecordType.CONTACT,)), bytes((RecordType.KEY,))
_LOST_MARK, _FOUND_MARK = bytes((RecordType.LOST,)), bytes((RecordType.FOUND,))


class Opened(NamedTuple):
    """A PDU that opened: its inner PDU, with the times inside as if it had not been delayed.

    `lead_s` is the time of its arrival minus the T in it. Until its source is proven, the PDU
    must wait.
    """

    inner: bytes
    src: int
    ticks: int
    lead_s: float
    held_s: float
    is_proven: bool


class Opener:
    """Opens sealed PDUs, and decides on those in the clear. Times are on the link's clock, in s.

    `known_before` are the robots of which a sealed PDU was opened in an earlier life.
    """

    def __init__(
        self, own_id: int, pdu_size: int, params: SecurityParams, keys: HeldKeys, numbers: Numbers,
        peers: Peers, contacts: Contacts, strangers: Strangers, recalling: Recalling,
        known_before: frozenset[int], hears_self: bool,
    ) -> None:  # fmt: skip
        self._own_id = own_id
        self._pdu_size = pdu_size
        self._params = params
        self._keys = keys
        self._numbers = numbers
        self._peers = peers
        self._contacts = contacts
        self._strangers = strangers
        self.recalling = recalling
        """Who answers others about their numbers."""
        self.resuming: Resuming | None = None
        """Who takes answers about our numbers; None: they are known."""
        self._known_before = known_before
        self._hears_self = hears_self
        self._limit_s = params.late_s
        self._takes_all = params.unproven == "deliver"
        self.has_double = False
        """Whether another robot was heard that has our id and key."""

    @property
    def delivers_unproven(self) -> bool:
        """Whether messages of robots that are not proven reach the bus."""
        return self._takes_all

    def set_uncertainty(self, stamp_s: float) -> None:
        """Set the largest error of the times at which bursts come, in s."""
        self._limit_s = max(self._params.late_s, UNCERTAIN * stamp_s)

    def open(self, data: bytes, at: float, later_s: float = 0.0) -> Opened:
        """Open a sealed PDU whose burst came at `at`. Raises PduError with the ledger's reason.

        `later_s`: the time for which its source says that it has been on its way, as it repeats it.
        """
        pdu = parse_sealed(data, self._pdu_size)
        _, _, src, dst, seq, hop, kid, ticks, held = pdu
        ciphers = self._keys.by_kid.get(kid)
        if ciphers is None:
            raise self._closed("sec_unknown_kid", src, dst, kid, at)
        peer = self._peers.by_src.get(src) or self._peers.of(src)
        window = peer.windows.get(kid) or peer.window(kid)
        reason = window.judge(ticks, seq)
        if reason:
            if reason == "sec_replay":
                self._strangers.old(src, at)
            raise PduError(reason, f"number {ticks}, {seq} of robot {src}")
        inner = ciphers.open(pdu)
        if inner is None:
            raise self._closed("sec_bad_tag", src, dst, kid, at)
        is_own = src == self._own_id
        lead_s = at - ticks / TICKS_PER_S
        held_s = held * HELD_UNIT_S + later_s
        if peer.note(lead_s, at, kid, self._limit_s):
            # Our proof may have lapsed there, too.
            self._contacts.met_somebody(at)
        if self._strangers.by_src:
            self._strangers.opened(src)
        if self._keys.is_changing:
            self._keys.rotation.opened(src, kid, at)
        if is_own:
            self._look_for_double(kid, ticks, seq)
            if not self._hears_self:
                raise PduError("rx_own", "our own source id")
        elif hop & 0x0F > 1 or inner[HEADER_SIZE] >> 4 == CONTROL_TOPIC_ID:
            self._take_records(src, inner, lead_s, held_s, at)
        is_proven = is_own or peer.proof is not None
        own_age_s = at - self._peers.began
        if not is_own and peer.is_late(
            lead_s, held_s, self._limit_s, own_age_s, is_proven or self._takes_all
        ):
            if own_age_s > JUST_STARTED_S:
                self._strangers.late(src, at)
            raise PduError("sec_late", f"held {held_s:g} s, robot {src}")
        window.take(ticks, seq)
        peer.heard_at = at
        if held_s:
            inner = _aged(inner, held_s)
        return _make(Opened, (inner, src, ticks, lead_s, held_s, is_proven))

    def is_late(self, src: int, at: float, lead_s: float, held_s: float) -> bool:
        """Whether a PDU of robot `src`, which is proven now, was delayed by more than it says, or
        may have been sent before this robot started.
        """
        own_age_s = at - self._peers.began
        peer = self._peers.of(src)
        return peer.is_late(lead_s, held_s, self._limit_s, own_age_s, True)

    def refuses_clear(self, data: bytes, now: float) -> bool:
        """Whether an intact PDU in the clear is refused; KEY and LOST records in it are noted."""
        if len(data) != self._pdu_size or crc16(data):
            return False
        src = data[1]
        record = told_in_clear(data, self._pdu_size)
        if record is not None:
            if isinstance(record, KeyTold):
                self._strangers.tells(src, record, now)
            elif src != self._own_id:
                self._strangers.lost(src, now)
                self.recalling.asked(src, record)
            return True
        is_known = src in self._known_before or self._peers.was_opened(src)
        if self._params.clear == "accept" and not is_known:
            return False
        self._strangers.clear(src, now)
        return True

    def _look_for_double(self, kid: int, ticks: int, seq: int) -> None:
        """Note whether a PDU under our own id is another robot's.

        Under the key before, it may be a recording of ours.
        """
        if kid == self._keys.own.key.kid and self._numbers.is_foreign(ticks, seq):
            self.has_double = True

    def _closed(self, reason: str, src: int, dst: int, kid: int, at: float) -> PduError:
        if dst not in (BROADCAST, self._own_id):
            # It may be sealed with a key of two other robots.
            return PduError("rx_not_for_us", f"for robot {dst}, and does not open here")
        self._strangers.closed(src, kid, at)
        return PduError(reason, f"key {kid}, robot {src}")

    def _take_records(
        self, src: int, inner: bytes, lead_s: float, held_s: float, at: float
    ) -> None:
        """Use the CONTACT and KEY records in an inner PDU, if there are some."""
        is_asking = self.resuming is not None and _FOUND_MARK in inner
        if not (_CONTACT_MARK in inner or _KEY_MARK in inner or is_asking):
            return
        if not _has_records(inner):
            return
        try:
            records = read_control_entries(parse(inner, len(inner), is_intact=True)).records
        except PduError:
            return
        for record in records:
            if isinstance(record, Contact):
                self._take_contact(self._peers.of(src), record, lead_s, held_s, at)
            elif isinstance(record, KeyTold):
                self._keys.rotation.told(src, record)
            elif isinstance(record, FoundNumbers) and record.node == self._own_id and self.resuming:
                self.resuming.answered(record, at)

    def _take_contact(
        self, peer: Peer, contact: Contact, lead_s: float, held_s: float, at: float
    ) -> None:
        if at - peer.contact_at < SOON_S:
            self._contacts.hurry(at)
        peer.contact_at = at
        if contact.number != peer.number:
            if peer.number is not None:
                peer.restart()
                peer.least.add(lead_s, at)
            peer.number = contact.number
            self._contacts.met_somebody(at)
        for node, number, ticks in contact.met:
            if node == self._own_id and number == self._contacts.prefix:
                ahead_s = ticks * AHEAD_UNIT_S + self._numbers.offset(at)
                if abs(lead_s + ahead_s - held_s) <= self._limit_s:
                    peer.prove(Proof(ahead_s, at))


def _aged(inner: bytes, held_s: float) -> bytes:
    """An inner PDU with the times inside as if it had not been delayed. Raises PduError."""
    try:
        return aged(inner, round(1e6 * held_s))
    except (IndexError, struct.error):
        raise PduError("rx_entry", "entries that contradict themselves") from None


def _has_records(inner: bytes) -> bool:
    """Whether a PDU has a control entry."""
    n = inner[HOP] & 0x0F
    return "f" in inner[HEADER_SIZE : HEADER_SIZE + (n + 1) // 2].hex()


def told_in_clear(data: bytes, pdu_size: int) -> KeyTold | LostNumbers | None:
    """The KEY or LOST record in a PDU in the clear, if there is one."""
    if _KEY_MARK not in data and _LOST_MARK not in data:
        return None
    try:
        pdu: Pdu = parse(data, pdu_size)
    except PduError:
        return None
    records: list[Record] = read_control_entries(pdu).records
    return next((each for each in records if isinstance(each, KeyTold | LostNumbers)), None)
