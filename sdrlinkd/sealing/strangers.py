"""Robots whose PDUs do not open, or come in the clear: what people should know about them."""

from dataclasses import dataclass
from math import inf

from sdrlinkd.sealing.held_keys import HeldKeys
from sdrlinkd.sealing.words import words_of
from sdrlinkd.wire import KeyTold

TELL_S = 5.0
"""Least time in s between two KEY records."""
FORGET_S = 30.0
MOST_NOTICES = 8
_MENDS = "compare `sdrlinkctl key show` at both, and install one key: sdrlinkctl key install"


@dataclass(slots=True)
class _Stranger:
    kid: int = -1
    closed_at: float = -inf
    """When a sealed PDU of it last did not open."""
    clear_at: float = -inf
    """When a PDU of it in the clear was last refused."""
    late_at: float = -inf
    """When a PDU of it last was delayed by more than it says."""
    old_at: float = -inf
    """When a PDU of it last had an old number."""
    lost_at: float = -inf
    """When it last said that it has lost its numbers."""
    told: KeyTold | None = None
    told_at: float = -inf


class Strangers:
    """Notes whose PDUs do not open; `keys` are those held here, None if we do not seal."""

    def __init__(self, keys: HeldKeys | None) -> None:
        self._keys = keys
        self.by_src: dict[int, _Stranger] = {}
        self._told_at = self._closed_at = -inf

    def closed(self, src: int, kid: int, now: float) -> None:
        """Note that a sealed PDU of robot `src` does not open."""
        stranger = self._of(src)
        stranger.kid, stranger.closed_at = kid, now
        self._closed_at = now

    def clear(self, src: int, now: float) -> None:
        """Note that a PDU of robot `src` in the clear was refused."""
        self._of(src).clear_at = now

    def late(self, src: int, now: float) -> None:
        """Note that a PDU of robot `src` was delayed by more than it says."""
        self._of(src).late_at = now

    def old(self, src: int, now: float) -> None:
        """Note that a PDU of robot `src` has an old number."""
        self._of(src).old_at = now

    def lost(self, src: int, now: float) -> None:
        """Note that robot `src` says that it has lost its numbers."""
        self._of(src).lost_at = now

    def tells(self, src: int, told: KeyTold, now: float) -> None:
        """Note a KEY record of robot `src` in the clear."""
        stranger = self._of(src)
        stranger.told, stranger.told_at = told, now

    def opened(self, src: int) -> None:
        """Forget that PDUs of robot `src` do not open, as one does."""
        stranger = self.by_src.get(src)
        if stranger is not None:
            stranger.closed_at = stranger.told_at = stranger.clear_at = stranger.lost_at = -inf

    @property
    def key_due_at(self) -> float:
        """When to tell our key in the clear; infinity unless a PDU did not open since."""
        if self._keys is None or self._closed_at <= self._told_at:
            return inf
        return max(self._closed_at, self._told_at + TELL_S)

    def key_told(self, now: float) -> None:
        """Note that our key was told at `now`."""
        self._told_at = now

    def notices(self, now: float) -> list[str]:
        """A sentence on each robot whose PDUs do not open, or are refused as they are clear."""
        found = []
        for src, each in sorted(self.by_src.items()):
            told = each.told if now - each.told_at < FORGET_S else None
            if now - each.closed_at < FORGET_S or (told is not None and self._differs(told)):
                found.append(self._does_not_open(src, each, now))
            elif now - each.lost_at < FORGET_S:
                found.append(
                    f"robot {src} has lost the numbers of its key, and sends nothing sealed until "
                    "it has others"
                )
            elif now - each.clear_at < FORGET_S:
                found.append(
                    f"robot {src} is heard, but sends in the clear: give it the team's key, or "
                    'set security.clear = "accept" here'
                )
            elif now - each.old_at < FORGET_S:
                found.append(
                    f"PDUs of robot {src} have old numbers: recordings are played, or the robot "
                    "has lost those of its key; then make the next one: sdrlinkctl key rotate"
                )
            elif now - each.late_at < FORGET_S:
                found.append(
                    f"PDUs of robot {src} come later than they say: they are held back and "
                    "played, or security.late_s is too small for relays and slots"
                )
        return found[:MOST_NOTICES]

    def _does_not_open(self, src: int, stranger: _Stranger, now: float) -> str:
        if self._keys is None:
            return (
                f"robot {src} is heard, but seals its PDUs, and this robot has no key: set "
                "security.mode here, and install the team's key: sdrlinkctl key install"
            )
        own_keys = self._keys.by_kid
        told = stranger.told if now - stranger.told_at < FORGET_S else None
        if told is None:
            ours = ", ".join(str(kid) for kid in sorted(own_keys))
            if stranger.kid not in own_keys:
                return (
                    f"robot {src} is heard, but uses key {stranger.kid}, which is not installed "
                    f"here (installed: {ours}); {_MENDS}"
                )
            return (
                f"robot {src} is heard, but its PDUs do not open with key {stranger.kid}; {_MENDS}"
            )
        held = own_keys.get(told.kid)
        own = None if held is None else self._keys.told(held.key)
        if own is None or own.fingerprint != told.fingerprint:
            ours = "none" if own is None else f"{words_of(own.fingerprint)} …"
            return (
                f"robot {src} is heard, but uses another key {told.kid} "
                f"({words_of(told.fingerprint)} …; ours: {ours}); {_MENDS}"
            )
        if own.is_auth != told.is_auth:
            modes = {False: "seal", True: "auth"}
            return (
                f"robot {src} is heard, but uses the mode {modes[told.is_auth]}, and this robot "
                f"{modes[own.is_auth]}: give both the same security.mode"
            )
        return (
            f"robot {src} is heard, but its PDUs do not open although it has our key {told.kid}: "
            "they are damaged or forged"
        )

    def _differs(self, told: KeyTold) -> bool:
        held = self._keys.by_kid.get(told.kid) if self._keys is not None else None
        return held is None or self._keys is None or self._keys.told(held.key) != told

    def _of(self, src: int) -> _Stranger:
        return self.by_src.setdefault(src, _Stranger())
