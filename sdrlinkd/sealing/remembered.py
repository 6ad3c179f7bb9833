"""What sealing must remember over a restart, and when to write it to disk."""

from collections.abc import Mapping
from typing import NamedTuple

from sdrlinkd.sealing.held_keys import HeldKeys
from sdrlinkd.sealing.numbers import Numbers
from sdrlinkd.sealing.peers import Peers
from sdrlinkd.wire import N_TICKS


class Remembered(NamedTuple):
    """What is on disk: floors by fingerprint, and the newest T of each source, by fingerprint.

    The numbers of a key without a floor are lost; a floor of 0 says that it was never used.
    """

    floors: Mapping[bytes, int] = {}
    newest: Mapping[bytes, Mapping[int, int]] = {}
    in_use: bytes = b""
    """Fingerprint of the key that sealed last."""
    retired: frozenset[bytes] = frozenset()
    """Fingerprints of the keys that do not open any more."""
    known: frozenset[int] = frozenset()
    """Robots of which a sealed PDU was opened at any time."""
    resumed: frozenset[bytes] = frozenset()
    """Fingerprints of the keys whose numbers were lost once."""


class Memory:
    """Says what must be written to disk; the caller writes, and reports how that went."""

    def __init__(
        self, remembered: Remembered, keys: HeldKeys, numbers: Numbers, peers: Peers
    ) -> None:
        self.on_disk = remembered
        self._keys = keys
        self._numbers = numbers
        self._peers = peers
        self.failed = ""
        """Why the last attempt to write has failed, as a sentence; empty: it has not."""

    def wanted(self, now: float) -> Remembered | None:
        """What should be written at `now`; None: what is on disk suffices."""
        floor, own = self._numbers.wanted_floor(now), self._keys.own.key.fingerprint
        retired = self.on_disk.retired | self._keys.rotation.retired
        if floor is None and self.on_disk.in_use == own and self.on_disk.retired == retired:
            return None
        return self._present(self._numbers.floor if floor is None else floor)

    def written(self, remembered: Remembered) -> None:
        """Note what is on disk now; what was added while it was written stays."""
        before, self.failed = self.on_disk, ""
        floors = dict(before.floors)
        for fingerprint, floor in remembered.floors.items():
            floors[fingerprint] = max(floors.get(fingerprint, 0), floor)
        newest = {**before.newest, **remembered.newest}
        self.on_disk = remembered._replace(floors=floors, newest=newest)
        if remembered.in_use == self._keys.own.key.fingerprint:
            self._numbers.move_floor(remembered.floors.get(remembered.in_use, 0))

    def not_written(self, why: str) -> None:
        """Note that nothing could be written."""
        self.failed = f"the numbers of sealed PDUs cannot be written to disk: {why}"

    def resumed(self, fingerprint: bytes) -> None:
        """Note that the numbers of a key were lost, and go on."""
        self.on_disk = self.on_disk._replace(resumed=self.on_disk.resumed | {fingerprint})

    def add(self, loaded: Remembered) -> None:
        """Note what is on disk about keys that were installed while all runs."""
        on_disk = self.on_disk
        floors = dict(on_disk.floors)
        for fingerprint, floor in loaded.floors.items():
            floors[fingerprint] = max(floors.get(fingerprint, 0), floor)
        newest = {**loaded.newest, **on_disk.newest}
        resumed = on_disk.resumed | loaded.resumed
        self.on_disk = on_disk._replace(floors=floors, newest=newest, resumed=resumed)

    def at_stop(self) -> Remembered:
        """What should be written when the daemon stops: the floor as it is, and the newest T."""
        return self._present(self._numbers.floor)

    def _present(self, floor: int) -> Remembered:
        on_disk, own = self.on_disk, self._keys.own.key.fingerprint
        newest = dict(on_disk.newest)
        for key in self._keys.all:
            known = dict(newest.get(key.fingerprint, {}))
            for src, ticks in self._peers.newest(key.kid).items():
                known[src] = max(known.get(src, 0), ticks)
            newest[key.fingerprint] = known
        retired = on_disk.retired | self._keys.rotation.retired
        # A key that is out of use stays so, even if its numbers are lost.
        lost = self._keys.rotation.retired - on_disk.floors.keys()
        floors = {**on_disk.floors, **dict.fromkeys(lost, N_TICKS)}
        if not self._numbers.is_lost:
            # A floor is never lowered.
            floors[own] = max(floor, on_disk.floors.get(own, 0))
        heard = frozenset(src for each in newest.values() for src in each)
        return Remembered(
            floors, newest, own, retired, on_disk.known | heard, on_disk.resumed | lost
        )
