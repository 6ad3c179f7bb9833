"""What one antenna receives from the others, and when it is deaf."""

from typing import NamedTuple

from backends.air import Timeline
from backends.base import Samples
from phy import Path


class Piece(NamedTuple):
    """The next `n` samples of a node: None for silence; `is_deaf`: the node does not hear them."""

    n: int
    samples: Samples | None
    is_deaf: bool


class Ear:
    """An endless line of samples at one antenna, which is read once from beginning to end.

    Bursts that arrive at the same time add up.
    """

    def __init__(self) -> None:
        self._timeline = Timeline()
        self._deaf: list[tuple[int, int]] = []
        self.next_index = 0
        """Index of the first sample that has not been taken."""

    def add(self, index: int, samples: Samples, path: Path) -> None:
        """Let a burst arrive at `index`, through `path`."""
        self._timeline.add(index, samples, path)

    def be_deaf(self, begin: int, end: int) -> None:
        """Hear nothing in `begin … end`."""
        self._deaf.append((begin, end))

    def take(self, end: int) -> list[Piece]:
        """Take what is received before `end`, in pieces."""
        pieces: list[Piece] = []
        while self.next_index < end:
            first = self.next_index
            is_deaf, upto = self._next_stretch(first, end)
            heard = self._timeline.take(first, upto - first)
            pieces.append(Piece(upto - first, None if is_deaf else heard, is_deaf))
            self.next_index = upto
        self._deaf = [each for each in self._deaf if each[1] > self.next_index]
        return pieces

    def _next_stretch(self, first: int, end: int) -> tuple[bool, int]:
        """(whether the antenna is deaf at `first`, where that changes; at most `end`)."""
        now = [upto for begin, upto in self._deaf if begin <= first < upto]
        if now:
            return True, min(max(now), end)
        return False, min([begin for begin, _ in self._deaf if begin > first] + [end])
