"""Sealing as one object: seals our PDUs, and holds all that opening those of others needs."""

from collections.abc import Callable, Sequence
from math import ceil, inf

from sdrlinkd.reports import SecurityReport
from sdrlinkd.sealing.contacts import PATIENCE_S, Contacts
from sdrlinkd.sealing.held_keys import HeldKeys
from sdrlinkd.sealing.keys import Key
from sdrlinkd.sealing.numbers import LEAP_S, Numbers
from sdrlinkd.sealing.opener import Opener
from sdrlinkd.sealing.params import SecurityParams
from sdrlinkd.sealing.peers import Peers
from sdrlinkd.sealing.remembered import Memory, Remembered
from sdrlinkd.sealing.resuming import (
    DAY_S,
    LAST_QUARTER,
    PACE,
    Ages,
    Recalling,
    Resuming,
    is_ahead,
    most_ticks,
)
from sdrlinkd.sealing.strangers import Strangers
from sdrlinkd.wire import (
    CONTACT_NUMBER_SIZE,
    N_TICKS,
    SEAL_OVERHEAD,
    TICKS_PER_S,
    Contact,
    FoundNumbers,
    KeyTold,
    LostNumbers,
    delayed,
    depends_on_start,
    is_sealed,
    postponed,
    with_seq,
)

USED_UP_DAYS = 30.0
"""Days before the end of a key from which a person is told."""
RECENT_S, PROVES_S = 10.0, 5.0
"""A robot heard in the last RECENT_S should be proven PROVES_S after it was heard first."""
SLOW_S = 1.0
"""Time in s for which the disk may be busy before a person is told."""
FORGOTTEN_S = 60.0
"""Time in s after which a robot is left out of the report."""


class Sealing:
    """Seals our PDUs, and opens those of others. Times are on the link's clock, in s.

    `remembered` is what was on disk at the start, and `draw` gives random octets. `machine` is
    what tells this machine from others, in its first octets by its id and in the last by its start.
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
        machine: bytes = b"",
    ) -> None:
        self.inner_size = pdu_size - SEAL_OVERHEAD
        self._own_id = own_id
        self._params = params
        self._keys = HeldKeys(keys, params.mode, remembered.in_use)
        self._numbers = Numbers(remembered.floors.get(self._keys.own.key.fingerprint))
        self._peers = Peers(self._oldest)
        self._contacts = Contacts(draw(CONTACT_NUMBER_SIZE), machine)
        self._strangers = Strangers(self._keys)
        self._draw = draw
        self._recalling = Recalling(draw)
        self._ages = Ages()
        self.opener = Opener(
            own_id, pdu_size, params, self._keys, self._numbers, self._peers, self._contacts,
            self._strangers, self._recalling, remembered.known, hears_self,
        )  # fmt: skip
        self.memory = Memory(remembered, self._keys, self._numbers, self._peers)
        self._waits = 0
        self._is_used_up = self._is_out = False
        self._out_since = inf
        """Since when no number is left that is on disk."""
        self._lost_words = ""

    @property
    def halted(self) -> str:
        """Why nothing is sent any more, as a sentence; empty: all is well."""
        if self.opener.has_double:
            return (
                f"another robot has our id {self._own_id} and our key: give it an id of its own, "
                "then restart both"
            )
        if self._lost_words:
            return self._lost_words
        if self._is_used_up:
            kid = self._keys.own.key.kid
            return f"key {kid} is used up: make the next one with sdrlinkctl key rotate"
        if self._is_out:
            return self.memory.failed or "the disk does not take the numbers of sealed PDUs in time"
        return ""

    def may_send(self, start: float, seq: int, n: int) -> bool:
        """Whether a burst at `start` can hold `n` PDUs of ours from `seq` on."""
        if self._numbers.is_lost or self._is_early(start):
            return False
        if not self._numbers.has_begun:
            self._lost_words = ""
        self._is_used_up = self._numbers.is_used_up(start)
        if not self._numbers.is_out(start):
            self._out_since = inf
        elif self._out_since == inf:
            self._out_since = start
        # With another key, the disk has a moment to take its floor.
        out_s = start - self._out_since
        self._is_out = out_s >= 0 and (bool(self.memory.failed) or out_s > SLOW_S)
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
        if not is_sealed(pdu):
            return postponed(pdu, by_us), inner
        if not inner or not depends_on_start(inner):
            return delayed(pdu, by_us), inner
        seq = next_seq()
        if not self.may_send(start, seq, 1):
            # Others do not use what depends on the start, as they see that it was delayed.
            return delayed(pdu, by_us), inner
        inner = with_seq(postponed(inner, by_us), seq)
        return self.seal(inner, start), inner

    def begin_anew(self) -> None:
        """Go on with another clock."""
        self._numbers.begin_anew()
        self._peers.restart()
        self._ages.tell({}, 0.0)
        self._recalling = self.opener.recalling = Recalling(self._draw)
        self.opener.resuming, self._lost_words = None, ""

    def contact(self, now: float, room: int) -> tuple[Contact, float]:
        """(our CONTACT at `now`, of at most `room` octets, when it gets a PDU of its own)."""
        offset_s = self._numbers.offset(now)
        return self._contacts.record(now, room, self._peers, offset_s), now + PATIENCE_S

    @property
    def contact_due_at(self) -> float:
        """When the next CONTACT is due."""
        return inf if self._numbers.is_lost else self._contacts.due_at

    @property
    def is_lost(self) -> bool:
        """Whether the numbers of the key in use are lost, so that nothing is sealed."""
        return self._numbers.is_lost

    @property
    def clear_due_at(self) -> float:
        """When to tell something in the clear: our key, or that our numbers are lost."""
        resuming = self.opener.resuming
        due_at = inf if resuming is None else resuming.due_at
        return min(due_at, self._strangers.key_due_at)

    def further_key(self) -> KeyTold | None:
        """The KEY record, to be sealed, of a key to which this robot can change."""
        key = self._keys.rotation.further
        return None if key is None else self._keys.told(key)

    def told_in_clear(self, now: float) -> KeyTold | LostNumbers:
        """The record to be told in the clear at `now`.

        It is KEY, as PDUs of others do not open, or LOST.
        """
        resuming = self.opener.resuming
        if resuming is not None and resuming.due_at <= now:
            return resuming.ask(now)
        self._strangers.key_told(now)
        return self._keys.told(self._keys.own.key)

    def found(self, now: float) -> list[FoundNumbers]:
        """What to tell robots at `now` that have lost their numbers."""
        if self._numbers.is_lost:
            return []
        found = []
        for src, lost in self._recalling.due(now):
            held = self._keys.by_kid.get(lost.kid)
            if held is None or not held.key.fingerprint.startswith(lost.fingerprint):
                continue
            newest = max(self._oldest(src, lost.kid), self._peers.newest(lost.kid).get(src, 0))
            age_s = self._ages.age_s(held.key, now)
            age = None if age_s is None else min(ceil(age_s * TICKS_PER_S), N_TICKS)
            found.append(FoundNumbers(src, lost.number, lost.kid, newest, age))
        return found

    def tell_ages(self, ages_s: dict[bytes, float], now: float) -> None:
        """Note the ages of keys in s at `now`, by fingerprint, if the host's clock is trusted."""
        self._ages.tell(ages_s, now)

    def install(self, keys: Sequence[Key], loaded: Remembered) -> None:
        """Hold other keys from now on; the one in use stays until the others have the next one.

        `loaded` is what is on disk about them.
        """
        held = {key.kid: key.fingerprint for key in self._keys.all}
        before = self._keys.own.key
        self._keys.install(keys)
        for key in keys:
            if held.get(key.kid, key.fingerprint) != key.fingerprint:
                self._peers.change_key(key.kid)
        self.memory.add(loaded)
        own = self._keys.own.key.fingerprint
        if own != before.fingerprint or (self._numbers.is_lost and own in loaded.floors):
            self._changed()

    def look(self, now: float) -> None:
        """Change to the next key, or go on with lost numbers, if it is time.

        The first look is the start of this life.
        """
        self._peers.begin(now)
        heard_at = {src: peer.heard_at for src, peer in self._peers if src != self._own_id}
        if self._keys.look(now, heard_at):
            self._changed()
        if self._numbers.is_lost or self.opener.resuming is not None:
            self._resume(now)

    def _resume(self, now: float) -> None:
        """Ask for lost numbers, and go on once it is known which ones were used.

        Who goes on by the age of the key alone looks for answers a while longer.
        """
        numbers, key, resuming = self._numbers, self._keys.own.key, self.opener.resuming
        if resuming is None:
            resuming = self.opener.resuming = Resuming(key, self._draw, now)
        if numbers.is_lost or resuming.is_above(numbers.newest):
            floor = resuming.floor(now, self._ages.age_s(key, now))
            if floor is not None:
                numbers.resume(floor)
                self.memory.resumed(key.fingerprint)
                self._contacts.met_somebody(now)
        self._lost_words = resuming.words(now) if numbers.is_lost else ""
        if not numbers.is_lost and resuming.is_over(now):
            self.opener.resuming = None

    def _is_early(self, start: float) -> bool:
        """Whether a start came so soon after others that, by the age of the key alone, a robot that
        has lost its numbers would not be above ours.

        A host's clock that is set back makes the robot wait for longer, until it is set right, or
        not trusted any more: then there is no age, and nothing to wait for.
        """
        numbers, key = self._numbers, self._keys.own.key
        if numbers.has_begun or key.fingerprint not in self.memory.on_disk.resumed:
            return False
        age_s = self._ages.age_s(key, start)
        if age_s is None or numbers.newest >= LAST_QUARTER:
            return False
        early_s = (numbers.newest - most_ticks(key, age_s)) / TICKS_PER_S - LEAP_S
        if early_s <= 0:
            return False
        self._lost_words = (
            f"the numbers of key {key.kid} were lost, and the daemon has started again soon: it "
            f"seals again in {ceil(early_s / PACE)} s"
        )
        return True

    def _changed(self) -> None:
        """Go on with another key; nothing leaves before its floor is on disk."""
        floor = self.memory.on_disk.floors.get(self._keys.own.key.fingerprint)
        self._numbers.change_key(floor)
        self.opener.resuming, self._lost_words = None, ""

    def notices(self, now: float) -> list[str]:
        """What a person should know, in sentences."""
        found = self._strangers.notices(now)
        if self.opener.delivers_unproven:
            found.append(
                "messages of robots that have not proven to be alive are handed over, so they may "
                'be recordings (security.unproven = "deliver")'
            )
        if self._params.clear == "accept":
            found.append(
                "PDUs in the clear are accepted from robots that were never heard to seal, so "
                'anybody can send as one of these (security.clear = "accept")'
            )
        found += [
            f"robot {src} has our key and has not proven to be alive: does it hear us?"
            for src, peer in self._peers
            if src != self._own_id
            # Without numbers, nothing of ours can be heard.
            and not self._numbers.is_lost
            and now - peer.heard_at < RECENT_S
            and not peer.is_proven(now)
            and now - peer.first_at > PROVES_S
        ]
        found += [
            f"robot {src} has the machine id of this one, so one disk is a copy of the other: give "
            "the copy an id of its own with systemd-machine-id-setup"
            for src in self._copies()
        ]
        return found if self._numbers.is_lost else found + self._key_notices(now)

    def _key_notices(self, now: float) -> list[str]:
        found, key = [], self._keys.own.key
        days = self._days_left(now)
        if days < USED_UP_DAYS:
            found.append(
                f"key {key.kid} can be used for {days:.0f} more days: make the next one with "
                "sdrlinkctl key rotate"
            )
        age_s = self._ages.age_s(key, now)
        was_lost = key.fingerprint in self.memory.on_disk.resumed
        if age_s is not None and not was_lost and is_ahead(self._numbers, key, age_s, now):
            found.append(
                f"the daemon was restarted so often that its numbers of key {key.kid} are ahead of "
                "the key's age: if this robot loses its state, make the next key"
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
            key_days_left=None if self._numbers.is_lost else self._days_left(now),
            waits=self._waits,
            halted=self.halted,
            strangers=self._strangers.notices(now),
            copies=self._copies(),
        )

    def _copies(self) -> list[int]:
        """Robots whose disk is a copy of ours, or the other way round."""
        others = [(src, peer.number) for src, peer in self._peers if src != self._own_id]
        return sorted(src for src, number in others if self._contacts.is_copy(number))

    def _days_left(self, now: float) -> float:
        return max(0.0, N_TICKS / TICKS_PER_S - self._numbers.clock(now)) / DAY_S

    def _oldest(self, src: int, kid: int) -> int:
        """The least T that is taken of a source that was heard in an earlier life."""
        held = self._keys.by_kid.get(kid)
        newest = self.memory.on_disk.newest.get(held.key.fingerprint, {}) if held else {}
        return newest.get(src, 0)
