"""CONTACT: our number, whom we have heard, and when to say so (wire document, 6.11)."""

import math

from sdrlinkd.sealing.peers import PROOF_S, Peers
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
LATELY_S = 60.0
"""Time in s without a PDU of a robot after which it is not named any more."""
SOON_S = 1.0
"""Time in s within which our CONTACT follows those of a robot that says its own often."""
_FARTHEST = (1 << 31) - 1
_MOST = (0xFF - CONTACT_OVERHEAD + TLV_HEADER_SIZE) // MET_SIZE


class Contacts:
    """Makes our CONTACT records; `number` is drawn at random at each start.

    Its last octets tell whose machine it is (`machine`), if that is known.
    """

    def __init__(self, number: bytes, machine: bytes = b"") -> None:
        self.number = number[: len(number) - len(machine)] + machine
        self._machine = machine
        self.due_at = 0.0
        """When the next CONTACT is due, in s."""
        self._period_s = PATIENCE_S
        self._turn = 0
        self._hurried_at = -math.inf

    @property
    def prefix(self) -> bytes:
        """What others repeat of our number."""
        return self.number[:CONTACT_PREFIX_SIZE]

    def is_copy(self, number: bytes | None) -> bool:
        """Whether the robot with `number` has our machine's id, and runs on another machine."""
        if not self._machine or number is None:
            return False
        other = number[-len(self._machine) :]
        return other != self._machine and other[:-1] == self._machine[:-1]

    def met_somebody(self, now: float) -> None:
        """Say it soon and often again, as a robot is heard that is new, or not proven any more."""
        self._period_s = PATIENCE_S
        self.due_at = min(self.due_at, now)

    def hurry(self, now: float) -> None:
        """Say it soon, as a robot says its own often, and so may lack our answer."""
        if self.due_at > now + SOON_S and now - self._hurried_at > LONGEST_PERIOD_S:
            self._hurried_at = now
            self.met_somebody(now)

    def record(self, now: float, room: int, peers: Peers, offset_s: float) -> Contact:
        """The CONTACT that is due at `now`, of at most `room` octets.

        `offset_s` is our key time minus the clock of the leads.
        """
        known = [
            Met(src, peer.number[:CONTACT_PREFIX_SIZE], ticks)
            for src, peer in peers
            if peer.number is not None
            # What is older would be wrong by the drift of the clocks.
            and now - peer.least.added_at < LATELY_S
            and abs(ticks := math.ceil((peer.least.value + offset_s) / AHEAD_UNIT_S)) <= _FARTHEST
        ]
        most = max(0, min((room - CONTACT_OVERHEAD) // MET_SIZE, _MOST))
        met = known
        if len(known) > most:
            first = self._turn % len(known)
            met = (known[first:] + known[:first])[:most]
            self._turn += most
        # All robots are named several times while a proof lasts.
        longest_s = PROOF_S / (3 * -(-len(known) // max(most, 1)) or 1)
        self.due_at = now + PATIENCE_S + self._period_s
        self._period_s = min(2 * self._period_s, LONGEST_PERIOD_S - PATIENCE_S, longest_s)
        return Contact(self.number, tuple(met))
