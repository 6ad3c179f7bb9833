"""Access to a bus from a test's process: faults in, counters out."""

import fcntl
import mmap
import os
import struct
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

# From layout.h: the order of Control's words, and their position.
FIELDS = (
    *("unplugged", "unplugs", "stall", "lose", "underflow", "time_error", "crash", "hang"),
    *("owner", "plugged", "mode", "on_from_ns", "on_until_ns"),
    *("sent", "bursts", "underflows", "late", "received", "lost", "overflows", "opened"),
)
HEADER = 4096
UNITS = 16
UNIT = 16818176
SIZE = HEADER + UNITS * UNIT

MODE_TX = 2
FLOCK = "hhqqi4x"


@dataclass(frozen=True)
class Stats:
    """Totals of a unit since its bus began, in samples or counts."""

    sent: int
    bursts: int
    underflows: int
    late: int
    received: int
    lost: int
    overflows: int
    opened: int
    is_open: bool
    is_transmitting: bool


class Bus:
    """The shared memory of the bus `name`, created if absent, and removed when a `with` ends."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._path = Path(f"/dev/shm/soapy-loopback-{name}")
        self._file = self._path.open("a+b")
        if self._file.seek(0, os.SEEK_END) != SIZE:
            self._file.truncate(0)
            self._file.truncate(SIZE)
        self._map = mmap.mmap(self._file.fileno(), SIZE)
        self._words = memoryview(self._map).cast("q")

    def inject(self, unit: int, fault: str) -> None:
        """Inject a fault as README.md names it: "unplug", "overflow=5000", …"""
        name, _, number = fault.partition("=")
        count = int(number or 1)
        if name == "unplug":
            self._set(unit, "unplugs", self._get(unit, "unplugs") + 1)
            self._set(unit, "unplugged", 1)
        elif name == "replug":
            self._set(unit, "unplugged", 0)
        elif name == "overflow":
            self._set(unit, "lose", int(number or 10000))
        elif name in ("underflow", "time_error", "stall", "crash", "hang"):
            self._set(unit, name, count)
        else:
            raise ValueError(name)

    def stats(self, unit: int) -> Stats:
        """Current counters of a unit."""
        word = {name: self._get(unit, name) for name in FIELDS}
        now_ns = time.monotonic_ns()
        on = word["mode"] == MODE_TX or word["on_from_ns"] <= now_ns < word["on_until_ns"]
        counters = ("sent", "bursts", "underflows", "late", "received", "lost", "overflows")
        return Stats(
            *(word[name] for name in counters),
            opened=word["opened"],
            is_open=self._is_locked(unit),
            is_transmitting=on,
        )

    def close(self) -> None:
        """Remove the bus; open devices keep their memory."""
        self._words.release()
        self._map.close()
        self._file.close()
        self._path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _is_locked(self, unit: int) -> bool:
        ask = struct.pack(FLOCK, fcntl.F_WRLCK, os.SEEK_SET, unit, 1, 0)
        answer = fcntl.fcntl(self._file, fcntl.F_OFD_GETLK, ask)
        return struct.unpack(FLOCK, answer)[0] != fcntl.F_UNLCK

    def _at(self, unit: int, name: str) -> int:
        if not 0 <= unit < UNITS:
            raise ValueError(unit)
        return (HEADER + unit * UNIT) // 8 + FIELDS.index(name)

    def _get(self, unit: int, name: str) -> int:
        return self._words[self._at(unit, name)]

    def _set(self, unit: int, name: str, value: int) -> None:
        self._words[self._at(unit, name)] = value
