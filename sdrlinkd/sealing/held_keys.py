"""The keys held, and the ciphers that follow from them."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from sdrlinkd.sealing.keys import Key
from sdrlinkd.sealing.rotation import Rotation
from sdrlinkd.wire import KEY_PREFIX_SIZE, KeyTold

if TYPE_CHECKING:
    from sdrlinkd.sealing.ciphers import Ciphers


class HeldKeys:
    """The keys by kid, and the one that seals; `in_use` is the fingerprint of that before."""

    def __init__(self, keys: Sequence[Key], mode: str, in_use: bytes) -> None:
        self.mode = mode
        self.rotation = Rotation(keys, in_use)
        self.by_kid: dict[int, Ciphers] = {}
        self._take()

    @property
    def all(self) -> list[Key]:
        """All keys that open PDUs."""
        return self.rotation.keys

    def install(self, keys: Sequence[Key]) -> None:
        """Hold other keys from now on; the one that seals stays if it is among them."""
        self.rotation.install(keys)
        self._take()

    def look(self, now: float, heard_at: Mapping[int, float]) -> bool:
        """Change to the next key if it is time; returns whether another key seals now.

        `heard_at`: when each other robot was heard.
        """
        before = self.own.key
        if self.rotation.look(now, heard_at):
            self._take()
        return self.own.key != before

    def told(self, key: Key) -> KeyTold:
        """The KEY record of a key."""
        return KeyTold(key.kid, self.mode == "auth", key.fingerprint[:KEY_PREFIX_SIZE])

    def _take(self) -> None:
        # A robot without keys does not need the library, which takes memory and time to load.
        from sdrlinkd.sealing.ciphers import Ciphers

        known = {each.key: each for each in self.by_kid.values()} if self.by_kid else {}
        self.by_kid = {}
        for key in self.rotation.keys:
            self.by_kid[key.kid] = known.get(key) or Ciphers(key, self.mode)
        self.is_changing = len(self.by_kid) > 1
        """Whether there is a key besides the one that seals."""
        self.own = self.by_kid[self.rotation.own.kid]
        """The key that seals."""
