"""CONTACT: our number, whom we have heard, and when to say so (wire document, 6.11)."""

import math

from sdrlinkd.sealing.peers import Peers
from sdrlinkd.wire import (
    AHEAD_UNIT_S,
    CONTACT_OVERHEAD,
    CONTACT_PREFIX_SIZE,
    MET_SIZE,
    TLV_HEADER_SIZE,
    Contact,
    Met,
)

PATIENCE_S = 0.2
"""Time in s for which a CONTACT waits for spare room, and the first period."""
LONGEST_PERIOD_S = 5.0
_FARTHEST = (1 << 31) - 1
_MOST = (0xFF - CONTACT_OVERHEAD + TLV_HEADER_SIZE) // MET_SIZE


class Contacts:
    """Makes our CONTACT records; `number` is drawn at random at each start."""

    def __init__(self, number: bytes) -> None:
        self.number = number
        self.due_at = 0.0
        """When the next CONTACT is due, in s."""
        self._period_s = PATIENCE_S
        self._turn = 0

    @property
    def prefix(self) -> bytes:
        """What others repeat of our number."""
        return self.number[:CONTACT_PREFIX_SIZE]

    def met_somebody(self, now: float) -> None:
        """Say it soon and often again, as a robot is heard that is new, or not proven any more."""
        self._period_s = PATIENCE_S
        self.due_at = min(self.due_at, now)

    def record(self, now: float, room: int, peers: Peers) -> Contact:
        """The CONTACT that is due at `now`, of at most `room` octets."""
        self.due_at = now + PATIENCE_S + self._period_s
        self._period_s = min(2 * self._period_s, LONGEST_PERIOD_S - PATIENCE_S)
        met = [
            Met(src, peer.number[:CONTACT_PREFIX_SIZE], ticks)
            for src, peer in peers
            if peer.number is not None
            and math.isfinite(peer.least.value)
            and abs(ticks := math.ceil(peer.least.value / AHEAD_UNIT_S)) <= _FARTHEST
        ]
        most = max(0, min((room - CONTACT_OVERHEAD) // MET_SIZE, _MOST))
        if len(met) > most:
            first = self._turn % len(met)
            met = (met[first:] + met[:first])[:most]
            self._turn += most
        return Contact(self.number, tuple(met))
