"""What becomes of messages: the only place where one takes a step of its life."""

from collections.abc import Iterable
from typing import ClassVar

from sdrlinkd.link.queue.message import Fate, IllegalStepError, Outgoing, Step


class Lives:
    """Takes messages from step to step, and counts each in its topic's tally."""

    is_strict: ClassVar[bool] = False
    """An illegal step raises, as in tests; else it is counted."""

    def __init__(self) -> None:
        self.in_flight: set[Outgoing] = set()
        """Begun, and neither sent nor dropped yet."""
        self.dropped_asking: list[tuple[Outgoing, str]] = []
        """Dropped, and why, where the producer wants to know; whoever tells takes them out."""
        self.illegal_steps = 0
        """Steps that STEPS does not have: bugs of ours, survived."""

    def begin(self, message: Outgoing) -> None:
        """The first fragment of `message` is about to be made."""
        if self._step(message, Step.BEGIN):
            self.in_flight.add(message)

    def left(self, carried: Iterable[Iterable[Outgoing]]) -> None:
        """Settle what `carried` lists: for each PDU that left, the messages with a part in it."""
        for messages in carried:
            for message in messages:
                message.confirm()
                if (
                    message.fate is Fate.IN_FLIGHT
                    and not message.unconfirmed
                    and message.is_through
                    and self._step(message, Step.LEAVE)
                ):
                    self.in_flight.discard(message)
                    message.tally.send(len(message.payload))

    def failed(self, carried: Iterable[Iterable[Outgoing]]) -> list[Outgoing]:
        """Drop what `carried` lists, as its PDUs did not leave; those of which more was to come."""
        unfinished: list[Outgoing] = []
        for messages in carried:
            for message in messages:
                message.confirm()
                if message.fate is Fate.IN_FLIGHT:
                    self.drop(message, "tx_radio_failed")
                    if message.lane.current is message:
                        unfinished.append(message)
        return unfinished

    def drop(self, message: Outgoing, reason: str) -> None:
        """End `message` under a reason of the ledger; the caller takes it out of its lane."""
        if self._step(message, Step.DROP):
            self.in_flight.discard(message)
            message.tally.drop(reason)
            if message.receipt:
                self.dropped_asking.append((message, reason))

    def drop_in_flight(self, reason: str) -> None:
        """Drop all that is begun and not settled."""
        for message in list(self.in_flight):
            self.drop(message, reason)

    def _step(self, message: Outgoing, step: Step) -> bool:
        try:
            message.step(step)
        except IllegalStepError:
            if self.is_strict:
                raise
            self.illegal_steps += 1
            return False
        return True
