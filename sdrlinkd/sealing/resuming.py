"""What a robot does that has lost the numbers of its key, and how others help it.

It must never use a number twice, and does not know which ones it has used. So it asks, in the
clear: nobody could open what it would seal. Who holds the key answers, sealed, with the newest T
heard of it, and with the age of the key. By these it knows what it cannot have used (wire document,
11.6).
"""

from collections.abc import Callable
from math import ceil, inf

from sdrlinkd.sealing.keys import Key
from sdrlinkd.sealing.numbers import MOST_BROUGHT, Numbers
from sdrlinkd.sealing.peers import SILENT_S
from sdrlinkd.wire import (
    CONTACT_NUMBER_SIZE,
    KEY_PREFIX_SIZE,
    N_TICKS,
    TICKS_PER_S,
    FoundNumbers,
    LostNumbers,
)

DAY_S = 86400.0
LISTEN_S = SILENT_S
"""Time in s for which answers are awaited. No robot is believed after such a silence, so nothing of
the life before counts as proof for this one; and clocks may be wrong by as much."""
ASK_S, LATER_S = 1.0, 5.0
"""Time in s between two questions while answers are awaited, and afterwards."""
AHEAD_S, PACE = 4 * DAY_S, 1.25
"""A robot that knows the age of the key goes on at AHEAD_S, in s, and PACE times that age.

Its key time counts the time in use, and leaps at each start. So it stays below this while the robot
starts less than once in six minutes on average. What it brought from another key comes on top."""
LAST_QUARTER = 3 * N_TICKS // 4
"""T above which a robot goes on that does not know the age. There, it meets no numbers of a life
that began by the age, and that nobody heard."""
UNHEARD_S = DAY_S
"""Key time in s that it may have used there since others heard it last."""
PARTS = 4
"""It begins anywhere in one of so many parts of what is left there: by chance, as it may have begun
there before, and nobody may have heard that."""
STILL_S = 600.0
"""Time in s for which answers are awaited after a start by the age: it may be too low."""
ANSWER_S = 0.5
"""Least time in s between two answers to others."""
MOST_ANSWERS = 4


def most_ticks(key: Key, age_s: float) -> int:
    """The T that no robot has reached with a key that was made `age_s` ago."""
    brought = MOST_BROUGHT if key.follows else 0
    return min(brought + ceil((AHEAD_S + PACE * max(age_s, 0.0)) * TICKS_PER_S), N_TICKS)


class Ages:
    """When keys were made, on the link's clock, as far as this host's clock is to be trusted."""

    def __init__(self) -> None:
        self._made_at: dict[bytes, float] = {}

    def tell(self, ages_s: dict[bytes, float], now: float) -> None:
        """Note the ages of keys in s at `now`, by fingerprint; keys that are missing have none."""
        self._made_at = {key: now - age_s for key, age_s in ages_s.items() if age_s >= 0}

    def age_s(self, key: Key, now: float) -> float | None:
        """The age of a key in s; None if it is not known."""
        made_at = self._made_at.get(key.fingerprint)
        return None if made_at is None else now - made_at


class Resuming:
    """Finds the T above which `key` may be used again; `number` is drawn at random."""

    def __init__(self, key: Key, draw: Callable[[int], bytes], now: float) -> None:
        self._key = key
        self._draw = draw
        self._number = draw(CONTACT_NUMBER_SIZE)
        self._until = inf
        """When answers need not be awaited any more, from the first question on."""
        self.due_at = now
        """When to ask, in s."""
        self._has_asked = self.is_answered = False
        self._heard = 0
        self._made_at = inf
        """When the key was made, by what others say, on the link's clock."""

    def ask(self, now: float) -> LostNumbers:
        """The question to be sent at `now`."""
        if not self._has_asked:
            self._has_asked, self._until = True, now + LISTEN_S
        self.due_at = now + (ASK_S if now < self._until else LATER_S)
        return LostNumbers(self._key.kid, self._key.fingerprint[:KEY_PREFIX_SIZE], self._number)

    def answered(self, found: FoundNumbers, at: float) -> None:
        """Note what another robot has answered."""
        if found.number != self._number or found.kid != self._key.kid:
            return
        self.is_answered = True
        self._heard = max(self._heard, found.newest)
        if found.age is not None:
            self._made_at = min(self._made_at, at - found.age / TICKS_PER_S)

    def floor(self, now: float, age_s: float | None) -> int | None:
        """The T above which no number was used; None if it is not known, or not yet.

        `age_s` is the age of the key in s by this host's clock.
        """
        if now < self._until:
            return None
        known_s = max(-inf if age_s is None else age_s, now - self._made_at)
        if known_s > -inf and self._heard < LAST_QUARTER:
            by_age = most_ticks(self._key, known_s)
            if self._heard < by_age:
                # The last quarter is for those who do not know the age.
                return by_age if by_age < LAST_QUARTER else N_TICKS
        return self._anywhere() if self._heard else None

    def is_above(self, newest: int) -> bool:
        """Whether others have heard a T of this robot above `newest`, its own."""
        return self._heard > newest

    def is_over(self, now: float) -> bool:
        """Whether no more answers are awaited."""
        return self.is_answered or now > self._until + STILL_S

    def _anywhere(self) -> int:
        """A T in the last quarter, above all that was heard and a day of use."""
        least = max(self._heard, LAST_QUARTER) + round(UNHEARD_S * TICKS_PER_S)
        room = max(0, N_TICKS - least) // PARTS
        return min(least + room * int.from_bytes(self._draw(4)) // (1 << 32), N_TICKS)

    def words(self, now: float) -> str:
        """Why nothing is sealed at `now`, as sentences; empty if nothing was to be sent."""
        if not self._has_asked:
            # Who only receives needs no numbers.
            return ""
        lost = f"the numbers of key {self._key.kid} are lost here"
        if now < self._until:
            return (
                f"{lost}, or it was never installed (then: sdrlinkctl key install --new); the "
                f"other robots are asked for {ceil(self._until - now)} more seconds"
            )
        who = "has heard this robot use it" if self.is_answered else "answers"
        return (
            f"{lost}, no robot {who}, and its age is not known. If this robot never used it: "
            "sdrlinkctl key install --new. Otherwise bring a robot that has heard it into reach, "
            "or make the next key: sdrlinkctl key rotate"
        )


class Recalling:
    """Answers robots that have lost their numbers; `draw` gives random octets."""

    def __init__(self, draw: Callable[[int], bytes]) -> None:
        self._draw = draw
        self._asked: list[tuple[int, LostNumbers]] = []
        self._answered_at = -inf

    def asked(self, src: int, lost: LostNumbers) -> None:
        """Note a question of robot `src`.

        Anybody can ask, so there are few places; that of another one is taken at random.
        """
        if (src, lost) in self._asked:
            return
        if len(self._asked) < MOST_ANSWERS:
            self._asked.append((src, lost))
        else:
            self._asked[self._draw(1)[0] % MOST_ANSWERS] = src, lost

    def due(self, now: float) -> list[tuple[int, LostNumbers]]:
        """(robot, its question) of those to answer at `now`."""
        if not self._asked or now < self._answered_at + ANSWER_S:
            return []
        self._answered_at = now
        asked, self._asked = self._asked, []
        return asked


def is_ahead(numbers: Numbers, key: Key, age_s: float, now: float) -> bool:
    """Whether the key time is ahead of what a robot without state would expect of it."""
    ticks = numbers.clock(now) * TICKS_PER_S if numbers.has_begun else numbers.newest
    return ticks > most_ticks(key, age_s)
