"""Which key seals, while a team changes from one key to the next.

All robots first get the next key, one after the other. Each says so, and goes on with the old key
until all robots that it hears have the next one, or for a limited time: a robot that was lost or
stolen must not delay the others for ever.
"""

from collections.abc import Mapping, Sequence
from math import inf

from sdrlinkd.sealing.keys import Key
from sdrlinkd.wire import KeyTold

PRESENT_S = 10.0
"""Time in s without a PDU after which a robot is not waited for."""
LONGEST_S = 600.0
"""Longest time in s for which others are waited for, and for which the old key still opens."""
QUIET_S = 60.0
"""Time in s without a PDU under the old key after which it does not open any more."""


class Rotation:
    """The keys that open, and the one that seals; `in_use` is the fingerprint of the last one."""

    def __init__(self, keys: Sequence[Key], in_use: bytes) -> None:
        self.retired: set[bytes] = set()
        """Fingerprints of the keys that do not open any more."""
        self.keys = list(keys)
        """The keys that open PDUs, the next one last."""
        self.own = next((key for key in keys if key.fingerprint == in_use), self.keys[0])
        """The key that seals."""
        self._have_next: set[int] = set()
        self._since: float | None = None
        self._old_at = -inf

    @property
    def further(self) -> Key | None:
        """The key to which we change next; None: we use it already."""
        return None if self.keys[-1] == self.own else self.keys[-1]

    def install(self, keys: Sequence[Key]) -> None:
        """Take other keys; the one that seals stays if it is among them."""
        self.keys = list(keys)
        own = self.own.fingerprint
        self.own = next((key for key in keys if key.fingerprint == own), self.keys[0])
        self._have_next.clear()
        self._since = None

    def told(self, src: int, record: KeyTold) -> None:
        """Note that robot `src` says that it holds a key."""
        further = self.further
        if further is not None and further.fingerprint.startswith(record.fingerprint):
            self._have_next.add(src)

    def opened(self, src: int, kid: int, at: float) -> None:
        """Note that a PDU of robot `src` opened with key `kid` at `at`."""
        further = self.further
        if further is not None and kid == further.kid:
            self._have_next.add(src)
        elif further is None and kid != self.own.kid:
            self._old_at = at

    def look(self, now: float, heard_at: Mapping[int, float]) -> bool:
        """Change keys if it is time; returns whether something changed.

        `heard_at` says when each other robot was heard, by id.
        """
        if len(self.keys) == 1:
            return False
        if self._since is None:
            self._since = now
        further, waited_s = self.further, now - self._since
        if further is None:
            if waited_s < LONGEST_S and now - max(self._old_at, self._since) < QUIET_S:
                return False
            self.retired |= {key.fingerprint for key in self.keys if key != self.own}
            self.keys = [self.own]
            return True
        present = {src for src, at in heard_at.items() if now - at < PRESENT_S}
        if waited_s < LONGEST_S and not (present and present <= self._have_next):
            return False
        self.own, self._since = further, now
        return True
