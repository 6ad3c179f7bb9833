"""PDUs that are repeated in one burst, and the records that announce them."""

from dataclasses import dataclass, field
from math import ceil, inf
from typing import NamedTuple

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.repeat.kept import Kept
from sdrlinkd.wire import MAX_HELD_REPEAT, REPEAT_SIZE, REPEAT_UNIT_S, Repeat


@dataclass(slots=True)
class Wanted:
    """A PDU that waits to be sent again, and why."""

    kept: Kept
    due_at: float
    askers: set[int] = field(default_factory=set)
    """Who asked; nobody if the PDU is sent twice unasked."""
    announced_at: float = -inf
    """When a REPEAT of a burst of its own announced it."""
    n_announced: int = 0
    cost_s: float = 0.0
    """Airtime spent on it."""


class RepeatGroup(NamedTuple):
    """PDUs to be repeated in one burst, the first choice first: of one source, class and MCS."""

    kept: list[Kept]
    qos: Qos
    mcs: int
    is_relayed: bool
    announced: int = 0
    """How many of them, the first ones, a REPEAT of an earlier burst announces."""

    def first(self, n: int) -> "RepeatGroup":
        """The first `n` of them, in the order of their numbers."""
        return self._replace(kept=sorted(self.kept[:n], key=lambda kept: kept.number))

    def alive(self, start: float) -> "RepeatGroup":
        """Those that hold a message that is worth sending at `start`."""
        return self._replace(kept=[kept for kept in self.kept if kept.worth_until() > start])

    def told(self, start: float, room: int) -> tuple[list[Repeat], "RepeatGroup"]:
        """(REPEAT records for a burst at `start`, of at most `room` octets, what they name)."""
        runs: list[list[Kept]] = []
        for kept in self.kept:
            last = runs[-1][-1] if runs else None
            if last and (last.number + 1, last.first_at) == (kept.number, kept.first_at):
                runs[-1].append(kept)
            elif (len(runs) + 1) * REPEAT_SIZE <= room:
                runs.append([kept])
            else:
                break
        records = [
            Repeat(run[0].src, run[0].number, _held(start - run[0].first_at), len(run))
            for run in runs
        ]
        return records, self.first(sum(map(len, runs)))


def _held(held_s: float) -> int:
    """A time in s in the unit of REPEAT, rounded up, so that ages are never too low."""
    return min(max(0, ceil(held_s / REPEAT_UNIT_S)), MAX_HELD_REPEAT)
