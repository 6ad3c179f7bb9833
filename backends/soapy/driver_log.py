"""Output of drivers: kept off the daemon's screen; its end is reported when a driver fails."""

import os
import threading

DEBUG = "SDRLINKD_DEBUG"
"""Environment variable that shows all output of drivers."""
_PIECE = 4096
_JOIN_S = 0.5


class DriverLog:
    """A pipe for a process's output, read by its own thread until the process has ended."""

    def __init__(self) -> None:
        self._last = ""
        self._shown = bool(os.environ.get(DEBUG))
        self._read_fd, self._write_fd = os.pipe()
        self._thread = threading.Thread(target=self._read, daemon=True)

    @property
    def fd(self) -> int | None:
        """The descriptor for the process to write to; None: the same as ours."""
        return None if self._shown else self._write_fd

    def begin(self) -> None:
        """Start to read; the process now has its end of the pipe."""
        os.close(self._write_fd)
        self._thread.start()

    def last_line(self) -> str:
        """The last line that the ended process printed, or empty."""
        self._thread.join(_JOIN_S)
        return self._last

    def _read(self) -> None:
        rest = ""
        while piece := os.read(self._read_fd, _PIECE):
            *lines, rest = (rest + piece.decode(errors="replace")).split("\n")
            self._note(lines)
            # Some drivers print single letters and never a newline.
            rest = rest[-_PIECE:]
        self._note([rest])
        os.close(self._read_fd)

    def _note(self, lines: list[str]) -> None:
        self._last = next((line.strip() for line in reversed(lines) if line.strip()), self._last)
