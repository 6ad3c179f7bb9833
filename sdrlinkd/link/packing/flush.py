"""How long what fills no PDU waits for more (paper section 4.3, Flush Timeout)."""

from math import inf
from typing import Literal

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outbox

NOW = "now"
FlushTime = Literal["now"] | float
BEGUN_PART = 0.5
"""Of the time that receivers wait for the rest of a message, so much may pass here."""


def flush_told(flush_s: FlushTime) -> str:
    """What the setting means, in a line."""
    if flush_s == NOW:
        return f'link.flush_s = "{NOW}": a partly filled PDU is sent as soon as the radio is free'
    how_long = f"for more, up to {flush_s:g} s"
    if float(flush_s) in (0.0, inf):
        how_long = "until it is full, however long that takes" + " (the paper's 0.0)" * (
            flush_s == 0
        )
    return (
        f"link.flush_s = {float(flush_s)}: a partly filled PDU waits {how_long}; "
        "urgent, latency and messages with a lifespan do not wait"
    )


class Flush:
    """Whether what is in `outbox` waits. `size`: bytes that fill a PDU with one entry.

    Nobody waits for: urgent and latency, messages with a lifespan, and the rest of a message that
    receivers would give up after `patience_s`.
    """

    def __init__(self, flush_s: FlushTime, outbox: Outbox, size: int, patience_s: float) -> None:
        self._outbox = outbox
        self._size = size
        self._begun_s = BEGUN_PART * patience_s
        self.is_on = flush_s != NOW
        """Whether anything ever waits."""
        # The paper's 0.0: never by time.
        self._longest_s = float(flush_s or inf) if flush_s != NOW else 0.0

    def end(self) -> None:
        """Let nothing wait from now on."""
        self.is_on = False

    def must_wait(self, now: float) -> bool:
        """Whether all that is there waits for more; the outbox is not empty."""
        return (
            self.is_on
            and now < self.due_at()
            and self._outbox.pending_bytes(self._size) < self._size
        )

    def due_at(self) -> float:
        """When it goes even so; infinity: never by time."""
        outbox = self._outbox
        if outbox.levels[0].qos <= Qos.LATENCY or outbox.has_lifespans():
            return -inf
        return min(outbox.oldest_arrival() + self._longest_s, outbox.first_begun() + self._begun_s)
