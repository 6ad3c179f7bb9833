"""Events that a received PDU causes in the link, besides complete messages."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from sdrlinkd.link.receive.delivered import Delivered
from sdrlinkd.link.routes import PduToRelay
from sdrlinkd.wire import Pdu, Record, Stamp

if TYPE_CHECKING:
    from sdrlinkd.link.receive.pdu_read import PduRead


class Signal(NamedTuple):
    """The signal of a burst: SNR in dB, and Doppler of its echoes in Hz; None: not known."""

    snr_db: float | None = None
    doppler_hz: float | None = None


class PduHeard(NamedTuple):
    """A valid PDU from another robot, for any destination; its burst's preamble came at `at`.

    `is_relayed`: a robot other than its source has sent it.
    """

    pdu: Pdu
    stamps: list[Stamp]
    at: float
    is_relayed: bool
    signal: Signal


class RecordHeard(NamedTuple):
    """A control record from `src` came at `at` that other parts of the link need."""

    src: int
    record: Record
    at: float


class Newcomer(NamedTuple):
    """A robot was heard for the first time, or has restarted."""

    src: int
    at: float


class Ended(NamedTuple):
    """A message whose sender wants a receipt was delivered, or dropped; `reason` says which.

    `age_s` is its age at that moment in s, None if no STAMP came.
    """

    src: int
    topic_id: int
    entry_id: int
    reason: str
    age_s: float | None
    at: float


class PduPlaced(NamedTuple):
    """A PDU that was not heard before, and its number among those of its source.

    It came at `at`, and showed that the numbers `skipped` are missing. `is_wanted`: it is for this
    robot, or to be relayed.
    """

    read: "PduRead"
    number: int
    skipped: Sequence[int]
    is_wanted: bool
    at: float
    is_ours: bool = True
    """Whether it is for this robot, too, not only to be forwarded."""


Event = Delivered | PduHeard | RecordHeard | Newcomer | Ended | PduPlaced | PduToRelay
