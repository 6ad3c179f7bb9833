"""The counterpart of sealing for a robot without keys: everything is in the clear."""

from collections.abc import Callable
from math import inf

from sdrlinkd.errors import PduError
from sdrlinkd.reports import SecurityReport
from sdrlinkd.sealing.opener import Opened, told_in_clear
from sdrlinkd.sealing.strangers import Strangers
from sdrlinkd.wire import Contact, FoundNumbers, KeyTold, LostNumbers, parse_sealed, postponed


class ClearOpener:
    """Takes PDUs in the clear, and notes sealed ones; its methods are those of `Opener`."""

    delivers_unproven = True

    def __init__(self, pdu_size: int) -> None:
        self._pdu_size = pdu_size
        self.strangers = Strangers(None)

    def set_uncertainty(self, stamp_s: float) -> None:
        """Nothing depends on the times of bursts."""

    def open(self, data: bytes, at: float, later_s: float = 0.0) -> Opened:  # noqa: ARG002  # as in Opener
        """Note a sealed PDU, which never opens. Raises PduError with the ledger's reason."""
        pdu = parse_sealed(data, self._pdu_size)
        self.strangers.closed(pdu.src, pdu.kid, at)
        raise PduError("rx_flags", "sealed (E=1), and this node has no keys")

    def is_late(self, src: int, at: float, lead_s: float, held_s: float) -> bool:  # noqa: ARG002  # as in Opener
        """Whether a PDU was delayed by more than it says: nothing tells."""
        return False

    def refuses_clear(self, data: bytes, now: float) -> bool:
        """Whether a PDU in the clear is refused: never; a KEY record in it is noted."""
        told = told_in_clear(data, self._pdu_size)
        if isinstance(told, KeyTold):
            self.strangers.tells(data[1], told, now)
        return False


class InTheClear:
    """Leaves PDUs as they are. Its methods are those of `Sealing`."""

    is_on = is_lost = False
    halted = ""
    contact_due_at = clear_due_at = inf

    def __init__(self, pdu_size: int, has_control: bool) -> None:
        self.inner_size = pdu_size
        self._has_control = has_control
        self.opener = ClearOpener(pdu_size)

    def may_send(self, start: float, seq: int, n: int) -> bool:  # noqa: ARG002  # as in Sealing
        """Whether a burst at `start` can hold `n` PDUs of ours: always."""
        return True

    def seal(self, inner: bytes, start: float) -> bytes:  # noqa: ARG002  # as in Sealing
        """The PDU as it is."""
        return inner

    def later(
        self,
        pdu: bytes,
        inner: bytes,
        by_us: int,
        start: float,  # noqa: ARG002  # as in Sealing
        next_seq: Callable[[], int],  # noqa: ARG002  # as in Sealing
    ) -> tuple[bytes, bytes]:
        """(PDU, nothing) that did not leave, for a burst `by_us` µs later."""
        return (postponed(pdu, by_us) if self._has_control and by_us > 0 else pdu), inner

    def begin_anew(self) -> None:
        """Nothing depends on a clock."""

    def contact(self, now: float, room: int) -> tuple[Contact, float]:
        """No CONTACT is ever due. Raises ValueError."""
        raise ValueError(f"a CONTACT of {room} octets at {now} s, in the clear")

    def further_key(self) -> KeyTold | None:
        """The KEY record of a key to which this robot can change: none."""

    def told_in_clear(self, now: float) -> KeyTold | LostNumbers:
        """No record is ever due. Raises ValueError."""
        raise ValueError(f"a KEY record at {now} s, without a key")

    def found(self, now: float) -> list[FoundNumbers]:  # noqa: ARG002  # as in Sealing
        """There is nothing to tell about the numbers of others."""
        return []

    def look(self, now: float) -> None:
        """There are no keys to change."""

    def notices(self, now: float) -> list[str]:
        """A sentence on each robot that seals its PDUs."""
        return self.opener.strangers.notices(now)

    def report(self, now: float) -> SecurityReport:
        """The report: nothing is sealed."""
        return SecurityReport(strangers=self.opener.strangers.notices(now))
