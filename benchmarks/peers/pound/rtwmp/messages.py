"""A node's messages: those that wait, and those that come in parts."""

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.peers.pound.rtwmp.frames import Ack, Message, Part


@dataclass
class Waiting:
    """A message in the queue, and its first part that is not confirmed."""

    message: Message
    parts: int
    next_part: int = 0


class Queue:
    """Messages that a node has to send, at most `depth`."""

    def __init__(self, depth: int, part_octets: int) -> None:
        self._depth, self._part_octets = depth, part_octets
        self._waiting: list[Waiting] = []

    def __len__(self) -> int:
        return len(self._waiting)

    def push(self, message: Message) -> bool:
        """Append a message; False if the queue is full."""
        if len(self._waiting) >= self._depth:
            return False
        self._waiting.append(Waiting(message, message.parts(self._part_octets)))
        return True

    def head(self, can_reach: Callable[[int], bool]) -> Waiting | None:
        """The most important message, of equal ones the oldest; none that cannot be reached."""
        best: Waiting | None = None
        for each in self._waiting:
            if best is not None and _rank(each) >= _rank(best):
                continue
            if can_reach(each.message.dst):
                best = each
        return best

    def part(self, of: Waiting) -> Part:
        """The next part of a message."""
        at = of.next_part * self._part_octets
        octets = min(self._part_octets, of.message.octets - at)
        return Part(of.message, of.next_part, octets, frozenset())

    def confirm(self, ack: Ack) -> None:
        """Note that a part has come; a message goes with its last."""
        for each in self._waiting:
            if (each.message.number, each.next_part) == (ack.number, ack.part):
                each.next_part += 1
                if each.next_part == each.parts:
                    self._waiting.remove(each)
                return


def _rank(each: Waiting) -> tuple[int, float]:
    return -each.message.priority, each.message.at


class Joins:
    """Messages that come in parts, some more than once."""

    def __init__(self, part_octets: int) -> None:
        self._part_octets = part_octets
        self._parts: dict[tuple[int, int], set[int]] = {}

    def feed(self, part: Part) -> Message | None:
        """The message that this part completes, if any."""
        message = part.message
        have = self._parts.setdefault((message.src, message.number), set())
        if part.part in have:
            return None
        have.add(part.part)
        return message if len(have) == message.parts(self._part_octets) else None
