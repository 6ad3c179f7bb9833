"""A burst of PDUs, and its outcome."""

from collections.abc import Iterator
from enum import Enum
from typing import NamedTuple, Self

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outgoing
from sdrlinkd.link.repeat import RepeatGroup


class Burst(NamedTuple):
    """PDUs that leave together, and the messages of which each holds an entry.

    The burst leaves at `start`, in s on the link's clock, and not after `latest`.
    """

    pdus: list[bytes]
    carried: list[list[Outgoing]]
    classes: list[Qos]
    """The most urgent class inside each PDU."""
    mcs: int = 0
    qos: Qos = Qos.DEFAULT
    start: float = 0.0
    latest: float = float("inf")
    airtime_s: float = 0.0
    number: int = 0
    """Running number of the burst, in order of composition."""
    first_start: float = 0.0
    """The first planned start; `start` is later after a retry."""
    n_records: int = 0
    """Number of PDUs that hold only control records."""
    ready_at: float = 0.0
    """Time from which the radio could have taken the burst."""
    clock: int | None = None
    """Number of the CLOCK record inside, if any."""
    n_timed: int = 0
    """How many PDUs, the first ones, may tell times up to `start`, such as ages; see
    `wire.postponed`. Repeated PDUs stay as they are."""
    inner: list[bytes] = []  # noqa: RUF012  # never changed
    """The inner PDUs of sealed ones, empty for those of other robots; none if nothing is sealed."""
    numbers: list[int] = []  # noqa: RUF012  # never changed
    """The PDU number of each PDU of ours, without its wrapping around."""
    planned_start: float | None = None
    """When it was to leave at last; times inside are those of then."""
    repeated: RepeatGroup | None = None
    """The PDUs inside that are repeated, if this is why the burst leaves."""

    @classmethod
    def of_pulse(cls, start: float, length_s: float, qos: Qos, number: int) -> Self:
        """A pulse of energy, without PDUs, for something of class `qos`."""
        return cls(
            [], [], [], 0, qos, start, start, length_s, number, first_start=start, ready_at=start
        )

    @property
    def is_pulse(self) -> bool:
        """Whether it is a pulse of energy, without PDUs."""
        return not self.pdus

    def numbered(self) -> Iterator[tuple[bytes, int, bool]]:
        """(octets, PDU number, whether it is bare) of each PDU that has messages or is relayed, as
        far as the number is known.
        """
        if self.repeated is not None:
            yield from ((kept.octets, kept.number, False) for kept in self.repeated.kept)
            return
        for octets, messages, own in zip(self.pdus, self.carried, self.numbers, strict=False):
            if messages:
                number = messages[0].pdu_number if messages[0].is_whole else own
                if number is not None:
                    yield octets, number, messages[0].is_bare

    def is_in_vain(self, now: float) -> bool:
        """Whether no message inside is worth sending any longer, and there are some."""
        inside = [message for messages in self.carried for message in messages]
        return bool(inside) and all(message.worth_until <= now for message in inside)


class Outcome(Enum):
    """Outcome of a burst, as the radio reports it after the last sample."""

    SENT = "sent"
    LATE = "late"
    UNDERFLOW = "underflow"
    LOST = "lost"
