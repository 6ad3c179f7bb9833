"""How long messages that do not fill a PDU wait for more (paper section 4.3, Flush Timeout)."""

from math import inf
from typing import Literal

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outbox

NOW = "now"
FlushTime = Literal["now"] | float
BEGUN_PART = 0.5
"""Share of the receivers' reassembly timeout for which the rest of a message may wait here."""


def flush_told(flush_s: FlushTime) -> str:
    """The meaning of the setting `flush_s`, as one line of text."""
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
    """Decides whether the messages in `outbox` wait until they fill a PDU of `size` bytes.

    Urgent and latency messages and messages with a lifespan never wait. The rest of a message waits
    for only part of `patience_s`, after which receivers would give it up.
    """

    def __init__(self, flush_s: FlushTime, outbox: Outbox, size: int, patience_s: float) -> None:
        self._outbox = outbox
        self.size = size
        self._begun_s = BEGUN_PART * patience_s
        self.is_on = flush_s != NOW
        """Whether messages ever wait."""
        # 0.0 means, as in the paper, that the wait does not end by time.
        self._longest_s = float(flush_s or inf) if flush_s != NOW else 0.0

    def end(self) -> None:
        """From now on, let no message wait."""
        self.is_on = False

    def must_wait(self, now: float) -> bool:
        """Whether the messages in the outbox, which must not be empty, wait for more."""
        return (
            self.is_on and now < self.due_at() and self._outbox.pending_bytes(self.size) < self.size
        )

    def due_at(self) -> float:
        """Time at which the messages are sent without more; infinity: never by time."""
        outbox = self._outbox
        if outbox.levels[0].qos <= Qos.LATENCY or outbox.has_lifespans():
            return -inf
        return min(outbox.oldest_arrival() + self._longest_s, outbox.first_begun() + self._begun_s)
