"""Sealing as one object: seals our PDUs, and holds all that opening those of others needs."""

from collections.abc import Callable, Sequence

from sdrlinkd.reports import SecurityReport
from sdrlinkd.sealing.contacts import PATIENCE_S, Contacts
from sdrlinkd.sealing.held_keys import HeldKeys
from sdrlinkd.sealing.keys import Key
from sdrlinkd.sealing.numbers import Numbers
from sdrlinkd.sealing.opener import Opener
from sdrlinkd.sealing.params import SecurityParams
from sdrlinkd.sealing.peers import Peers
from sdrlinkd.sealing.remembered import Memory, Remembered, floor_of
from sdrlinkd.sealing.strangers import Strangers
from sdrlinkd.wire import (
    CONTACT_NUMBER_SIZE,
    N_TICKS,
    SEAL_OVERHEAD,
    TICKS_PER_S,
    Contact,
    KeyTold,
    delayed,
    depends_on_start,
    postponed,
    with_seq,
)

DAY_S = 86400.0
USED_UP_DAYS = 30.0
"""Days before the end of a key from which a person is told."""
FORGOTTEN_S = 60.0
"""Time in s after which a robot is left out of the report."""


class Sealing:
    """Seals our PDUs, and opens those of others. Times are on the link's clock, in s.

    `remembered` is what was on disk at the start, and `draw` gives random octets.
    """

    is_on = True

    def __init__(
        self,
        own_id: int,
        pdu_size: int,
        params: SecurityParams,
        keys: Sequence[Key],
        remembered: Remembered,
        draw: Callable[[int], bytes],
        *,
        hears_self: bool = False,
    ) -> None:
        self.inner_size = pdu_size - SEAL_OVERHEAD
        self._own_id = own_id
        self._params = params
        self._remembered = remembered
        self._keys = HeldKeys(keys, params.mode, remembered.in_use)
        self._numbers = Numbers(floor_of(remembered, self._keys))
        self._peers = Peers(self._oldest)
        self._contacts = Contacts(draw(CONTACT_NUMBER_SIZE))
        self._strangers = Strangers(self._keys)
        known_before = frozenset(src for each in remembered.newest.values() for src in each)
        self.opener = Opener(
            own_id, pdu_size, params, self._keys, self._numbers, self._peers, self._contacts,
            self._strangers, known_before, hears_self,
        )  # fmt: skip
        self.memory = Memory(remembered, self._keys, self._numbers, self._peers)
        self._waits = 0
        self._is_used_up = False

    @property
    def halted(self) -> str:
        """Why nothing is sent any more, as a sentence; empty: all is well."""
        if self.opener.has_double:
            return (
                f"another robot has our id {self._own_id} and our key: give it an id of its own, "
                "then restart both"
            )
        if self._is_used_up:
            kid = self._keys.own.key.kid
            return f"key {kid} is used up: make the next one with sdrlinkctl key rotate"
        return self.memory.problem

    def may_send(self, start: float, seq: int, n: int) -> bool:
        """Whether a burst at `start` can hold `n` PDUs of ours from `seq` on."""
        if self._numbers.is_used_up(start):
            self._is_used_up = True
        if self.halted:
            return False
        fits = self._numbers.fits(start, seq, n)
        self._waits += not fits
        return fits

    def seal(self, inner: bytes, start: float) -> bytes:
        """The sealed PDU of an inner one in a burst at `start`, if `may_send` allowed it."""
        ticks = self._numbers.take(start, inner[3])
        if ticks is None:
            raise ValueError(f"no number for PDU {inner[3]} at {start}")
        return self._keys.own.seal(inner, ticks)

    def later(
        self, pdu: bytes, inner: bytes, by_us: int, start: float, next_seq: Callable[[], int]
    ) -> tuple[bytes, bytes]:
        """(PDU, inner PDU) that did not leave, for a burst `by_us` µs later, at `start`.

        `inner` is empty if the PDU is not ours. A PDU whose content depends on the start is made
        anew with the sequence number that `next_seq` gives: sealed under its old number, its
        content must never change.
        """
        if not inner or not depends_on_start(inner) or self.halted:
            return delayed(pdu, by_us), inner
        inner = with_seq(postponed(inner, by_us), next_seq())
        return self.seal(inner, start), inner

    def begin_anew(self) -> None:
        """Go on with another clock."""
        self._numbers.begin_anew()
        for _, peer in self._peers:
            peer.restart()

    def contact(self, now: float, room: int) -> tuple[Contact, float]:
        """(our CONTACT at `now`, of at most `room` octets, when it gets a PDU of its own)."""
        return self._contacts.record(now, room, self._peers), now + PATIENCE_S

    @property
    def contact_due_at(self) -> float:
        """When the next CONTACT is due."""
        return self._contacts.due_at

    @property
    def key_due_at(self) -> float:
        """When to tell our key in the clear."""
        return self._strangers.key_due_at

    def further_key(self) -> KeyTold | None:
        """The KEY record, to be sealed, of a key to which this robot can change."""
        key = self._keys.rotation.further
        return None if key is None else self._keys.told(key)

    def clear_key(self, now: float) -> KeyTold:
        """The KEY record to be told in the clear at `now`, as PDUs of others do not open."""
        self._strangers.key_told(now)
        return self._keys.told(self._keys.own.key)

    def install(self, keys: Sequence[Key]) -> None:
        """Hold other keys from now on; the one in use stays until the others have the next one."""
        self._keys.install(keys)
        self._numbers.leap_beyond(floor_of(self._remembered, self._keys))

    def look(self, now: float) -> None:
        """Change to the next key if it is time."""
        heard_at = {src: peer.heard_at for src, peer in self._peers if src != self._own_id}
        self._keys.look(now, heard_at)

    def notices(self, now: float) -> list[str]:
        """What a person should know, in sentences."""
        found = self._strangers.notices(now)
        if self.opener.delivers_unproven:
            found.append(
                "messages of robots that have not proven to be alive are handed over, so they may "
                'be recordings (security.unproven = "deliver")'
            )
        days = self._days_left(now)
        if days < USED_UP_DAYS:
            found.append(
                f"key {self._keys.own.key.kid} can be used for {days:.0f} more days: make the next "
                "one with sdrlinkctl key rotate"
            )
        return found

    def report(self, now: float) -> SecurityReport:
        """The report on sealing at `now`."""
        heard = {
            src: peer.is_proven(now)
            for src, peer in self._peers
            if src != self._own_id and now - peer.heard_at < FORGOTTEN_S
        }
        own = self._keys.own.key
        return SecurityReport(
            mode=self._params.mode,
            clear=self._params.clear,
            unproven=self._params.unproven,
            kid=own.kid,
            fingerprint=own.fingerprint.hex(),
            further_kids=[key.kid for key in self._keys.all if key != own],
            proven=sorted(src for src, is_proven in heard.items() if is_proven),
            not_proven=sorted(src for src, is_proven in heard.items() if not is_proven),
            key_days_left=self._days_left(now),
            waits=self._waits,
            halted=self.halted,
        )

    def _days_left(self, now: float) -> float:
        return max(0.0, N_TICKS / TICKS_PER_S - self._numbers.clock(now)) / DAY_S

    def _oldest(self, src: int, kid: int) -> int:
        """The least T that is taken of a source that was heard in an earlier life."""
        held = self._keys.by_kid.get(kid)
        newest = self._remembered.newest.get(held.key.fingerprint, {}) if held else {}
        return newest.get(src, 0)
