"""A whole message from the air."""

from typing import NamedTuple

from sdrlinkd.link.receive.latency import Parts

CDR_HEADER_SIZE = 4
DELIVERED = "delivered"
"""What became of it, beside the reasons of the ledger for which messages are dropped."""


class Delivered(NamedTuple):
    """A whole message from the air.

    `number` runs per (source, topic) from 1; `lost_pdus` are those known missing from the source
    so far; `origin_at` is when it was submitted, in the receiver's own time (absent when no STAMP
    came), so its age at any moment is that moment less `origin_at`. Its first fragment came in a
    burst whose preamble was at `began_at`, the last fragment in one at `heard_at`, whose last
    sample of interest was there at `ended_at`.
    """

    src: int
    topic_id: int
    payload: bytes
    number: int
    lost_pdus: int
    origin_at: float | None
    heard_at: float
    hops_left: int
    snr_db: float | None
    began_at: float = 0.0
    ended_at: float = 0.0

    def parts(self, now: float) -> Parts:
        """Of its age at `now`; for messages that had a STAMP."""
        origin_at = self.began_at if self.origin_at is None else self.origin_at
        return Parts(
            self.began_at - origin_at,
            self.heard_at - self.began_at,
            self.ended_at - self.heard_at,
            now - self.ended_at,
        )
