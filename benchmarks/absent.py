"""Reports in one line what cannot be measured here; the other measurements go on.

Peers' ends import this with other interpreters than ours, so it uses the standard library only.
"""

import subprocess
import sys
from typing import Self

from sdrlinkd.process import ProcessError

_told: dict[str, str] = {}


class PeerError(Exception):
    """A peer cannot be measured; the message names it and the reason."""


# Not installed, ended, silent, or unreadable; any other exception is a bug of ours.
FAILURES = (PeerError, ProcessError, OSError, subprocess.SubprocessError, ValueError)


class attempt:  # noqa: N801  # it reads as a verb
    """A `with` block that reports a failure as that of `what`, and continues after the block."""

    def __init__(self, what: str) -> None:
        self._what = what
        self.failed = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> bool:
        self.failed = isinstance(error, FAILURES)
        if self.failed:
            tell(self._what, error)
        return self.failed


def tell(what: str, reason: object) -> None:
    """Print in one line, once, why `what` is not measured."""
    line = " ".join(str(reason).split()) or type(reason).__name__
    line = line.removeprefix(f"{what}: ")
    if _told.get(what) != line:
        _told[what] = line
        sys.stderr.write(f"not measured: {what}: {line}\n")


def forget() -> None:
    """Forget what was reported, so that it is reported again."""
    _told.clear()


def told() -> dict[str, str]:
    """Everything reported so far: what was not measured, and why."""
    return dict(_told)
