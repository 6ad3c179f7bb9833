"""Opens the PDUs of others: keys, numbers, proofs and delays (wire document, 11.4 and 11.5)."""

from binascii import crc_hqx
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.sealing.contacts import Contacts
from sdrlinkd.sealing.held_keys import HeldKeys
from sdrlinkd.sealing.numbers import Numbers
from sdrlinkd.sealing.params import SecurityParams
from sdrlinkd.sealing.peers import Peer, Peers, Proof
from sdrlinkd.sealing.strangers import Strangers
from sdrlinkd.wire import (
    AHEAD_UNIT_S,
    BROADCAST,
    SEAL_OVERHEAD,
    TICKS_PER_S,
    Contact,
    KeyTold,
    Pdu,
    Record,
    RecordType,
    aged,
    parse,
    parse_sealed,
    read_control_entries,
)

UNCERTAIN = 4
"""Least limit of undetected delays, in uncertainties of the radio's times."""
_CONTACT_MARK, _KEY_MARK = bytes((RecordType.CONTACT,)), bytes((RecordType.KEY,))


class Opened(NamedTuple):
    """A PDU that opened: its inner PDU, with the times inside as if it had not been delayed.

    `lead_s` is our key time at its arrival minus the T in it. Until its source is proven, the PDU
    must wait.
    """

    inner: bytes
    src: int
    lead_s: float
    held_s: float
    is_proven: bool


class Opener:
    """Opens sealed PDUs, and decides on those in the clear. Times are on the link's clock, in s.

    `remembers` says whether a sealed PDU of a robot was opened in an earlier life.
    """

    def __init__(
        self, own_id: int, pdu_size: int, params: SecurityParams, keys: HeldKeys, numbers: Numbers,
        peers: Peers, contacts: Contacts, strangers: Strangers, known_before: frozenset[int],
        hears_self: bool,
    ) -> None:  # fmt: skip
        self._own_id = own_id
        self._pdu_size = pdu_size
        self._params = params
        self._keys = keys
        self._numbers = numbers
        self._peers = peers
        self._contacts = contacts
        self._strangers = strangers
        self._known_before = known_before
        self._hears_self = hears_self
        self._limit_s = params.late_s
        self.has_double = False
        """Whether another robot was heard that has our id and key."""

    @property
    def delivers_unproven(self) -> bool:
        """Whether messages of robots that are not proven reach the bus."""
        return self._params.unproven == "deliver"

    def set_uncertainty(self, stamp_s: float) -> None:
        """Set the largest error of the times at which bursts come, in s."""
        self._limit_s = max(self._params.late_s, UNCERTAIN * stamp_s)

    def open(self, data: bytes, at: float) -> Opened:
        """Open a sealed PDU whose burst came at `at`. Raises PduError with the ledger's reason."""
        pdu = parse_sealed(data, self._pdu_size)
        src, ciphers = pdu.src, self._keys.by_kid.get(pdu.kid)
        if ciphers is None:
            raise self._closed("sec_unknown_kid", src, pdu.dst, pdu.kid, at)
        peer = self._peers.of(src)
        window = peer.window(pdu.kid)
        reason = window.judge(pdu.ticks, pdu.seq)
        if reason:
            raise PduError(reason, f"number {pdu.ticks}, {pdu.seq} of robot {src}")
        text = ciphers.open(pdu)
        if text is None:
            raise self._closed("sec_bad_tag", src, pdu.dst, pdu.kid, at)
        inner = pdu.inner(text)
        is_own = src == self._own_id
        if is_own and self._numbers.is_foreign(pdu.ticks, pdu.seq):
            self.has_double = True
        lead_s = self._numbers.clock(at) - pdu.ticks / TICKS_PER_S
        if peer.has_restarted(lead_s):
            peer.restart()
        if peer.lapse(at):
            self._contacts.met_somebody(at)
        peer.least.add(lead_s, at)
        self._strangers.opened(src)
        self._keys.rotation.opened(src, pdu.kid, at)
        if not is_own and (_CONTACT_MARK in text or _KEY_MARK in text):
            self._take_records(src, inner, lead_s, pdu.held_s, at)
        hears_itself = is_own and self._hears_self
        if not hears_itself and self.is_late(src, lead_s, pdu.held_s, at):
            raise PduError("sec_late", f"held {pdu.held_s:g} s, robot {src}")
        window.take(pdu.ticks, pdu.seq)
        peer.heard_at = at
        if pdu.held:
            inner = aged(inner, round(1e6 * pdu.held_s))
        return Opened(inner, src, lead_s, pdu.held_s, hears_itself or peer.is_proven(at))

    def is_late(self, src: int, lead_s: float, held_s: float, now: float) -> bool:
        """Whether a PDU of robot `src` was delayed by more, or by less, than it says.

        Of a source that is not proven, only the relation to its other PDUs is known.
        """
        peer = self._peers.of(src)
        least_s, most_s = peer.excess_s(lead_s, held_s)
        if least_s < -self._limit_s:
            return True
        return most_s > self._limit_s and (peer.is_proven(now) or self.delivers_unproven)

    def is_proven(self, src: int, now: float) -> bool:
        """Whether robot `src` has proven to be alive."""
        return self._peers.of(src).is_proven(now)

    def refuses_clear(self, data: bytes, now: float) -> bool:
        """Whether an intact PDU in the clear is refused; a KEY record in it is noted."""
        if len(data) != self._pdu_size or crc_hqx(data, 0):
            return False
        src = data[1]
        key = clear_key_in(data, self._pdu_size)
        if key is not None:
            self._strangers.tells(src, key, now)
            return True
        is_known = src in self._known_before or self._peers.was_opened(src)
        if self._params.clear == "accept" and not is_known:
            return False
        self._strangers.clear(src, now)
        return True

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
        try:
            records = read_control_entries(parse(inner, self._pdu_size - SEAL_OVERHEAD)).records
        except PduError:
            return
        for record in records:
            if isinstance(record, Contact):
                self._take_contact(self._peers.of(src), record, lead_s, held_s, at)
            elif isinstance(record, KeyTold):
                self._keys.rotation.told(src, record)

    def _take_contact(
        self, peer: Peer, contact: Contact, lead_s: float, held_s: float, at: float
    ) -> None:
        if contact.number != peer.number:
            if peer.number is not None:
                peer.restart()
                peer.least.add(lead_s, at)
            peer.number = contact.number
            self._contacts.met_somebody(at)
        for node, number, ticks in contact.met:
            if node == self._own_id and number == self._contacts.prefix:
                ahead_s = ticks * AHEAD_UNIT_S
                if abs(lead_s + ahead_s - held_s) <= self._limit_s:
                    peer.prove(Proof(ahead_s, at))


def clear_key_in(data: bytes, pdu_size: int) -> KeyTold | None:
    """The KEY record in a PDU in the clear, if there is one."""
    if _KEY_MARK not in data:
        return None
    try:
        pdu: Pdu = parse(data, pdu_size)
    except PduError:
        return None
    records: list[Record] = read_control_entries(pdu).records
    return next((each for each in records if isinstance(each, KeyTold)), None)
