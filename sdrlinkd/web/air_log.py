"""What stations tell of the air, for as long as somebody looks."""

from collections import deque
from collections.abc import Iterator
from typing import Any, NamedTuple

import msgspec

KEPT_S = 12.0
MOST_BURSTS = 6000


class Bar(NamedTuple):
    """A burst: times in ms since 1970."""

    number: int
    robot: int | None
    at_ms: float
    length_ms: float
    mcs: int
    qos: str
    n_pdus: int
    n_good: int
    ending: str
    is_own: bool
    """Whether the robot's own daemon told of it, rather than one that heard it."""


class _Burst(msgspec.Struct, frozen=True):
    at: int
    us: float
    mcs: int
    n: int
    end: str
    ok: int = 0
    s: int | None = None
    q: str = ""


class _Told(msgspec.Struct, frozen=True):
    own: list[_Burst] = []
    heard: list[_Burst] = []
    rate: float = 0.0
    mean: bytes = b""
    peak: bytes = b""
    pts: bytes = b""
    mod: str = ""
    bad: int = 0
    lines: list[float] = []


_decode = msgspec.msgpack.Decoder(_Told).decode


class AirLog:
    """The bursts of the last seconds that one station told of, and the latest look at its band."""

    def __init__(self) -> None:
        self._bars: deque[Bar] = deque(maxlen=MOST_BURSTS)
        self._n = 0
        self.band: dict[str, Any] = {}
        """Rate in Hz, levels in dBFS, points of the last burst, unreadable headers, lines in Hz."""
        self.n_looks = 0
        """How often the band was looked at."""

    def take(self, packed: bytes, robot: int) -> None:
        """Take what the daemon of `robot` told (bus document, 4.5).

        What cannot be read is ignored: it is another version's.
        """
        try:
            told = _decode(packed)
        except msgspec.MsgspecError:
            return
        for each in told.own:
            self._add(each, robot, each.n if each.end == "sent" else 0, is_own=True)
        for each in told.heard:
            self._add(each, each.s, each.ok, is_own=False)
        if told.peak:
            self.n_looks += 1
            self.band = {
                "rate": told.rate,
                "mean": _signed(told.mean),
                "peak": _signed(told.peak),
                "points": _signed(told.pts),
                "modulation": told.mod,
                "unreadable": told.bad,
                "lines": told.lines,
            }

    def since(self, number: int) -> Iterator[Bar]:
        """The bursts after that of a number."""
        return (bar for bar in self._bars if bar.number > number)

    def forget_before(self, at_ms: float) -> None:
        """Forget the bursts that are too old to be shown."""
        while self._bars and self._bars[0].at_ms < at_ms:
            self._bars.popleft()

    def _add(self, told: _Burst, robot: int | None, n_good: int, *, is_own: bool) -> None:
        self._n += 1
        self._bars.append(
            Bar(
                self._n, robot, told.at / 1e6, told.us / 1e3, told.mcs, told.q, told.n, n_good,
                told.end, is_own,
            )
        )  # fmt: skip


def _signed(octets: bytes) -> list[int]:
    return memoryview(octets).cast("b").tolist()
