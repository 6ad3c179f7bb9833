"""The life cycle of outgoing messages; all their state changes happen here."""

from collections.abc import Iterable
from typing import ClassVar

from sdrlinkd.errors import IllegalStepError
from sdrlinkd.link.queue.fate import Fate, Step
from sdrlinkd.link.queue.message import Outgoing


class Lives:
    """Moves messages through their states, and counts each outcome in the topic's tally."""

    is_strict: ClassVar[bool] = False
    """Whether an illegal step raises IllegalStepError, as in tests, or is only counted."""

    def __init__(self) -> None:
        self.in_flight: set[Outgoing] = set()
        """Messages begun, and neither sent nor dropped yet."""
        self._dropped_asking: list[tuple[Outgoing, str]] = []
        self.illegal_steps = 0
        """Steps that STEPS does not contain: bugs of ours that were survived."""

    def begin(self, message: Outgoing) -> None:
        """Note that the first fragment of `message` is about to be composed."""
        if message.step(Step.BEGIN):
            self.in_flight.add(message)
        else:
            self._refuse(message, Step.BEGIN)

    def left(self, carried: Iterable[Iterable[Outgoing]]) -> None:
        """Settle a burst that left; `carried` lists the messages with a part in each PDU."""
        for messages in carried:
            for message in messages:
                message.confirm(has_left=True)
                if (
                    message.fate is Fate.IN_FLIGHT
                    and not message.unconfirmed
                    and message.is_through
                    and message.step(Step.LEAVE)
                ):
                    self.in_flight.discard(message)
                    message.tally.send(len(message.payload))

    def failed(self, carried: Iterable[Iterable[Outgoing]], reason: str) -> list[Outgoing]:
        """Drop the messages in `carried`, whose PDUs did not leave, under a reason of the ledger.

        Returns the messages that had more fragments to send.
        """
        unfinished: list[Outgoing] = []
        for messages in carried:
            for message in messages:
                message.confirm(has_left=False)
                if message.fate is Fate.IN_FLIGHT:
                    self.drop(message, reason)
                    if message.lane.current is message:
                        unfinished.append(message)
        return unfinished

    def drop(self, message: Outgoing, reason: str) -> None:
        """Drop `message` under a reason of the ledger; the caller removes it from its lane."""
        if not message.step(Step.DROP):
            self._refuse(message, Step.DROP)
            return
        self.in_flight.discard(message)
        message.tally.drop(reason)
        if message.receipt:
            self._dropped_asking.append((message, reason))

    def drop_in_flight(self, reason: str) -> None:
        """Drop all messages that are in flight."""
        for message in list(self.in_flight):
            self.drop(message, reason)

    def take_dropped_asking(self) -> list[tuple[Outgoing, str]]:
        """Messages dropped since the last call whose producers want receipts, with the reasons."""
        dropped = self._dropped_asking
        if dropped:
            self._dropped_asking = []
        return dropped

    def _refuse(self, message: Outgoing, step: Step) -> None:
        """Count a step that STEPS does not contain, or raise IllegalStepError."""
        if self.is_strict:
            raise IllegalStepError(f"{step.name} where a message is {message.fate.name}")
        self.illegal_steps += 1
