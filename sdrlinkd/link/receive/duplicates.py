"""The duplicate filter, which also counts lost PDUs."""

from collections import deque
from collections.abc import Sequence
from math import inf

from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import PDU_NUMBERS, nearest_number

WINDOW = 128
KEEP_S = 1.0
"""Time in s for which a PDU is known again; repeated ones come up to this late."""
STEP_AHEAD, OVERTAKEN, LATELY_S = 32, 96, 0.25
"""Most that a PDU is ahead which a relay sent, `LATELY_S` or less after another one, if it may also
be a late one: in the order of its class, and where more urgent ones overtake."""
REORDERED = 64
"""How far behind the newest one a PDU may be that was sent before the first one heard."""
NOTHING: Sequence[int] = range(0)
MOST_PER_S = 20_000
"""More PDUs than any source sends in a second."""


class SequenceTrack:
    """The PDUs of one source: duplicates, and known losses.

    Two PDUs are the same if PDU number and CRC-32 (with the hop nibble taken as zero) are equal.
    PDUs bring only the lowest octet of their number. A step of n, up to 127 ahead, means that n − 1
    PDUs are lost, unless the source tells another number. An older number that was missing is a
    late arrival. A relay sends urgent PDUs first, so what it forwards may be up to 224 behind. Any
    other older number means that the sender restarted, or was away for longer than an octet can
    tell; the next number that it tells decides.

    A restarted sender may also continue with a number that looks like a step ahead. Only its boot
    id tells: `restart` takes back the largest step since `goes_on` last confirmed the old one.
    """

    __slots__ = (
        "_anchor", "_doubted", "_doubtful", "_heard", "_leap", "_newest_at", "_order", "_reached",
        "_seen", "_settled", "_told_at", "fills", "is_numbered", "newest", "number", "restarts",
        "skipped",
    )  # fmt: skip

    def __init__(self) -> None:
        self.newest = -1
        """The highest number heard; its lowest octet is true, and all of it if `is_numbered`."""
        self.is_numbered = False
        """Whether the source has told a number."""
        self.number = -1
        """Number of the PDU heard last."""
        self.skipped: Sequence[int] = NOTHING
        """The numbers of which it showed that they are missing."""
        self.fills = False
        """Whether it was missing before."""
        self.restarts = 0
        """How often the source seems to have restarted."""
        # By number: what distinguishes the PDU from others with its sequence number, when it came,
        # and the earliest time at which it may have come first; in the order of arrival. That time
        # is −inf if a relay brought the PDU, as relays do not tell how long they had it.
        self._seen: dict[int, tuple[int, float, float]] = {}
        self._order: deque[int] = deque()
        self._told_at = self._newest_at = -inf
        # Losses before `_anchor`, the first number of the present life; PDUs heard after it; and
        # numbers after it of which it is not known whether they were ever used.
        self._settled = 0
        self._anchor = 0
        self._heard = 0
        self._doubtful = 0
        # The most losses that one step has shown since the source's boot id was last confirmed.
        self._leap = 0
        # What the last told number that was not believed would add to all numbers.
        self._doubted: int | None = None
        # The highest number that a relay has sent, by class.
        self._reached: dict[Qos, int] = {}

    @property
    def lost(self) -> int:
        """How many PDUs were lost so far."""
        after = self.newest - self._anchor - self._heard - self._doubtful
        return self._settled + max(0, after)

    def heard(
        self, seq: int, crc: int, at: float = 0.0, told: int | None = None, *,
        is_sealed: bool = False, forwarded: Qos | None = None, first_at: float | None = None,
    ) -> bool:  # fmt: skip
        """Note a PDU that came at `at`; False if it is a duplicate.

        `told`: its PDU number, if that was told. `first_at`: when it would have come at first, if
        it is repeated. In place of its CRC, a sealed PDU has its T, which no other PDU with its
        sequence number has.
        """
        self.skipped, self.fills = NOTHING, False
        if first_at is None and forwarded is not None:
            first_at = -inf
        if self._order:
            self._forget(at)
            reach = WINDOW if forwarded is None and not is_sealed else inf
            reach = reach if told is None or is_sealed else 0
            if self._is_known(seq, crc, reach):
                return False
        if self.newest < 0:
            self._begin(seq if told is None else told, crc, at, first_at, is_told=told is not None)
            return True
        number = self._placed(seq, at, forwarded)
        if told is not None:
            number = self._aligned(number, told, at)
        step = number - self.newest
        if step > 0:
            if not self.skipped:
                self.skipped = range(self.newest + 1, number)
            if self._doubtful and told is not None:
                # It is the life of before, so what was skipped is lost.
                self._doubtful = 0
                self.restarts -= 1
            self._leap = max(self._leap, step - 1)
            self.newest = number
            self._newest_at = at
            self._heard += 1
        elif number in self._seen and told is not None and self._seen[number][0] == crc:
            return False
        elif number in self._seen or (
            told is None and forwarded is None and not self._may_be_late(number)
        ):
            self._jump(seq, crc, at, first_at)
            return True
        else:
            self.fills = True
            self._heard += number > self._anchor
        self._note(number, crc, at, first_at)
        if forwarded is not None:
            self._reached[forwarded] = max(number, self._reached.get(forwarded, number))
        return True

    def lacks(self, told: int) -> bool:
        """Whether the PDU with a told number is missing, as far as is known."""
        behind = (self.newest - told) % PDU_NUMBERS
        return 0 < behind < MOST_PER_S and self.newest - behind not in self._seen

    def first_at(self, number: int, at: float) -> float:
        """When PDU `number`, which came at `at`, may have been sent first: that of the PDU before.

        −inf: none of the 128 before it was heard from the source itself. A burst with a newer PDU
        brings no older ones.
        """
        if at == self._newest_at or number == self.newest:
            return at
        for each in range(number - 1, number - WINDOW, -1):
            known = self._seen.get(each)
            if known is not None and known[2] > -inf:
                return known[2]
        return -inf

    def goes_on(self) -> None:
        """Note that the source has not restarted so far: all steps ahead were losses."""
        self._leap = 0

    def restart(
        self, seq: int, crc: int, at: float = 0.0, told: int | None = None, *,
        is_forwarded: bool = False,
    ) -> None:  # fmt: skip
        """Start over with a source that counts from a new number, and forget what was heard."""
        self.restarts += not self._doubtful
        self._settled = max(0, self.lost - self._leap)
        first_at = -inf if is_forwarded else None
        self._begin(seq if told is None else told, crc, at, first_at, is_told=told is not None)

    def begin_anew(self) -> None:
        """Go on with another clock; what was heard lately is forgotten."""
        self._seen.clear()
        self._order.clear()
        self._told_at = self._newest_at = -inf

    def distrust(self) -> None:
        """Note that nothing is known of the times of other PDUs in the latest burst."""
        self._newest_at = -inf

    def _begin(
        self, number: int, crc: int, at: float, first_at: float | None, *, is_told: bool
    ) -> None:
        self.newest = self._anchor = number
        self.is_numbered = is_told
        self._told_at = at
        self._heard = self._doubtful = self._leap = 0
        self._reached.clear()
        self._seen.clear()
        self._order.clear()
        self._note(number, crc, at, first_at)

    def _jump(self, seq: int, crc: int, at: float, first_at: float | None) -> None:
        """Go on with a number that is in use: the source restarted, or was away for long."""
        ahead = (seq - self.newest) & 0xFF or 256
        self.restarts += not self._doubtful
        self._doubtful += ahead - 1
        self.newest += ahead
        self._heard += 1
        self._note(self.newest, crc, at, first_at)

    def _placed(self, seq: int, at: float, forwarded: Qos | None) -> int:
        """The number of a PDU by its sequence number.

        A relay sends the PDUs of each class in order. So one that is older than others of its class
        is a repeated one. The least urgent ones do not overtake.
        """
        ahead = (seq - self.newest) & 0xFF
        number, late = self.newest + ahead, self.newest + ahead - 256
        if forwarded is None or not STEP_AHEAD <= ahead < WINDOW:
            return number if ahead < WINDOW else late
        if late in self._seen or at - self._newest_at > LATELY_S:
            return number
        is_repeated = late <= self._reached.get(forwarded, -1)
        overtakes = (
            is_repeated
            and forwarded is not max(self._reached, default=forwarded)
            and ahead < OVERTAKEN
        )
        return number if overtakes else late

    def _aligned(self, number: int, told: int, at: float) -> int:
        """The number of a PDU, which is `number` by its sequence number and `told` by its source.

        One that no source could have reached since its last PDU is not believed, unless the next
        one that is told agrees with it. Then what was believed before was false.
        """
        if not self.is_numbered:
            self._shift(nearest_number(told, number & 0xFF) - number)
            self.is_numbered, self._told_at = True, at
            number = nearest_number(told, number & 0xFF)
            lowest = max(min(self._seen), number - WINDOW)
            self.skipped = [each for each in range(lowest, number) if each not in self._seen]
            return number
        off = (told - self.newest + PDU_NUMBERS // 2) % PDU_NUMBERS - PDU_NUMBERS // 2
        believed = self.newest + off
        if not -MOST_PER_S * KEEP_S < off <= 256 + MOST_PER_S * (at - self._told_at):
            before, self._doubted = self._doubted, believed - number
            if before != self._doubted:
                return number
            self._shift(before)
            self._told_at = at
            return believed
        self._doubted = None
        if off >= 0:
            self._told_at = at
        return believed

    def _shift(self, by: int) -> None:
        """Renumber everything, as the true number of a PDU is known."""
        self.newest += by
        self._anchor += by
        self._seen = {number + by: each for number, each in self._seen.items()}
        self._reached = {qos: number + by for qos, number in self._reached.items()}
        self._order = deque(number + by for number in self._order)

    def _may_be_late(self, number: int) -> bool:
        """Whether a PDU before the newest one may have been missing until now."""
        lowest = self._order[0] if self._order else self.newest
        return number >= lowest or self.newest - number < REORDERED

    def _is_known(self, seq: int, crc: int, reach: float) -> bool:
        """Whether the PDU was heard among the last `reach` ones.

        Without T, its source may send a PDU with the same content every 256 PDUs. Relays may send
        one again that is far behind.
        """
        number = self.newest - ((self.newest - seq) & 0xFF)
        # Numbers come nearly in order, so what came first is nearly the lowest.
        lowest = max(self._order[0] - WINDOW, self.newest - reach)
        while number >= lowest:
            known = self._seen.get(number)
            if known is not None and known[0] == crc:
                return True
            number -= 256
        return False

    def _note(self, number: int, crc: int, at: float, first_at: float | None = None) -> None:
        self.number = number
        since = self.first_at(number, at) if first_at is None else first_at
        self._seen[number] = crc, at, since
        self._order.append(number)

    def _forget(self, at: float) -> None:
        order, seen = self._order, self._seen
        while len(order) > WINDOW and seen[order[0]][1] < at - KEEP_S:
            del seen[order.popleft()]
