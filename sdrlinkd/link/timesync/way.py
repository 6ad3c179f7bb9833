"""One direction's samples: those that are believed, and those held back until it is clear."""

from collections import deque
from typing import NamedTuple

import numpy as np

from sdrlinkd.link.timesync.side import Side

WINDOW_S = 60.0
STEP_S = 5e-4
"""Amount in s from which a sudden move is a step of the clock; less may be a jump of its rate."""
RUNNING, AMONG = 3, 8
"""A clock has moved if RUNNING of the last AMONG samples of a direction contradict the others.
With fewer, they are bad stamps, unless the rule of PAIR applies."""
PAIR, LATELY, OPPOSITE = 2, 25, 4
"""A clock has also moved if PAIR of the last LATELY samples contradict, and at least OPPOSITE
samples of the other direction came meanwhile, none of which refutes them."""


class Held(NamedTuple):
    """A sample held back: its delay is too short by `early_s`, as the others have it."""

    x: float
    v: float
    early_s: float


class Way:
    """The samples of one direction; `sign` is 1.0 if they are above the line, -1.0 if below."""

    def __init__(self, sign: float) -> None:
        self.sign = sign
        self.side = Side(WINDOW_S)
        self._recent: deque[Held | None] = deque(maxlen=LATELY)

    @property
    def held(self) -> list[Held]:
        """The samples of late that are held back, the oldest first."""
        return [each for each in self._recent if each is not None]

    @property
    def doubt_s(self) -> float:
        """By how much the last samples would move the line, if they are right and it is no step."""
        early_s = (each.early_s for each in self.held)
        return 2 * max((each for each in early_s if each <= STEP_S), default=0.0)

    def take(self, x: float, v: float, slope: float) -> None:
        """Believe a sample."""
        self._recent.append(None)
        self.side.add(x, v, slope)

    def hold(self, held: Held) -> None:
        """Hold a sample back."""
        self._recent.append(held)

    def refute(self, x: float, delay_s: float) -> None:
        """Drop what is held back, as a later sample of the other direction took only `delay_s`.

        Had the clock moved, that sample would seem to have taken at least as long as the others
        seem early.
        """
        for i, each in enumerate(self._recent):
            if each is not None and each.x <= x and each.early_s > delay_s:
                self._recent[i] = None

    def has_moved(self, other: Side) -> bool:
        """Whether so many samples contradict the others that the clock must have moved."""
        held = self.held
        latest = list(self._recent)[-AMONG:]
        if len(latest) - latest.count(None) >= RUNNING:
            return True
        return len(held) >= PAIR and int(np.sum(other.x >= held[0].x)) >= OPPOSITE

    def clear(self) -> None:
        """Forget all samples."""
        self.side.clear()
        self.clear_held()

    def clear_held(self) -> None:
        """Forget what was held back."""
        self._recent.clear()
