"""Who wants to know more of what is heard than messages."""

from typing import Protocol

from sdrlinkd.wire import Pdu, Record, Stamp


class InboxObserver(Protocol):
    """The inbox tells it."""

    def pdu_from(self, pdu: Pdu, stamps: list[Stamp], at: float, is_relayed: bool) -> None:
        """A good PDU, for whomever, that is not our own voice; its burst's preamble came at `at`.

        `is_relayed`: not its source has sent it.
        """

    def newcomer(self, src: int, at: float) -> None:
        """A robot is heard for the first time, or has started anew."""

    def sends_on(self, pdu: Pdu, data: bytes, at: float) -> bool:
        """Whether this node forwards the PDU; heard for the first time."""

    def record_from(self, src: int, record: Record, at: float) -> None:
        """A control record."""

    def ended(
        self, src: int, topic_id: int, entry_id: int, reason: str, age_s: float | None, now: float
    ) -> None:
        """A message whose sender wants to know it was delivered, or dropped for that reason."""
