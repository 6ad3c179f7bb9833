"""What sealing must remember over a restart, and when to write it to disk."""

from collections.abc import Mapping
from typing import NamedTuple

from sdrlinkd.sealing.held_keys import HeldKeys
from sdrlinkd.sealing.numbers import Numbers
from sdrlinkd.sealing.peers import Peers


class Remembered(NamedTuple):
    """What is on disk: floors by fingerprint, and the newest T of each source, by fingerprint."""

    floors: Mapping[bytes, int] = {}
    newest: Mapping[bytes, Mapping[int, int]] = {}
    in_use: bytes = b""
    """Fingerprint of the key that sealed last."""


class Memory:
    """Says what must be written to disk; the caller writes, and reports how that went."""

    def __init__(
        self, remembered: Remembered, keys: HeldKeys, numbers: Numbers, peers: Peers
    ) -> None:
        self._remembered = remembered
        self._keys = keys
        self._numbers = numbers
        self._peers = peers
        self._failed = ""
        self._is_out = False

    @property
    def problem(self) -> str:
        """Why no number may be used any more, as a sentence; empty: all is well."""
        return self._failed if self._is_out else ""

    @property
    def has_failed(self) -> bool:
        """Whether the last attempt to write has failed."""
        return bool(self._failed)

    def wanted(self, now: float) -> Remembered | None:
        """What should be written at `now`; None: what is on disk suffices."""
        self._is_out = self._numbers.is_out(now)
        floor, on_disk = self._numbers.wanted_floor(now), self._remembered
        is_known = on_disk.in_use == self._keys.own.key.fingerprint and all(
            key.fingerprint in on_disk.floors for key in self._keys.all
        )
        if floor is None and is_known:
            return None
        return self._present(self._numbers.floor if floor is None else floor)

    def written(self, remembered: Remembered) -> None:
        """Note what is on disk now."""
        self._remembered = remembered
        self._failed = ""
        self._keys.note_ready(remembered.floors.keys())
        self._numbers.move_floor(remembered.floors[self._keys.own.key.fingerprint])

    def not_written(self, why: str) -> None:
        """Note that nothing could be written."""
        self._failed = f"the numbers of sealed PDUs cannot be written to disk: {why}"

    def at_stop(self) -> Remembered:
        """What should be written when the daemon stops: the floor as it is, and the newest T."""
        return self._present(self._numbers.floor)

    def _present(self, floor: int) -> Remembered:
        newest = dict(self._remembered.newest)
        for key in self._keys.all:
            known = dict(newest.get(key.fingerprint, {}))
            for src, ticks in self._peers.newest(key.kid).items():
                known[src] = max(known.get(src, 0), ticks)
            newest[key.fingerprint] = known
        floors = {key.fingerprint: floor for key in self._keys.all}
        in_use = self._keys.own.key.fingerprint
        return Remembered({**self._remembered.floors, **floors}, newest, in_use)


def floor_of(remembered: Remembered, keys: HeldKeys) -> int:
    """The highest floor of the keys held: T counts on when the key changes."""
    return max(remembered.floors.get(key.fingerprint, 0) for key in keys.all)
