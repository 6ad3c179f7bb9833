"""Polls a daemon, also across its restarts."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn, Self, TypeVar

from rich.console import RenderableType
from rich.live import Live
from rich.text import Text

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import connect
from sdrlinkd.client import ControlClient, NoDaemonError, runtime_dir
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import screen_console

T = TypeVar("T")
WATCH_PERIOD_S = 0.5
PATIENCE_S = 2.0
"""Longest wait for an answer in s; a slower daemon counts as away."""


class Follower:
    """A client that polls one daemon, also after it was away."""

    def __init__(self, directory: str | os.PathLike[str] | None) -> None:
        self.directory: Path = runtime_dir(directory)
        self._control: ControlClient | None = None
        self._away_since: float | None = None

    def look(self) -> Snapshot | None:
        """The daemon's present snapshot; None if it does not answer. Raises RefusedError."""
        try:
            snapshot = self._with_client(ask_status)
        except NoDaemonError:
            if self._away_since is None:
                self._away_since = time.monotonic()
            return None
        self._away_since = None
        return snapshot

    def ask(self, verb: str, arguments: dict[str, Any] | None = None) -> Any:  # noqa: ANN401
        """The daemon's answer to `verb`. Raises NoDaemonError and RefusedError."""
        return self._with_client(lambda control: control.ask(verb, arguments))

    def _with_client(self, ask: Callable[[ControlClient], T]) -> T:
        if self._control is None:
            self._control = connect(self.directory, PATIENCE_S)
        try:
            return ask(self._control)
        except NoDaemonError:
            # A new connection shows at once whether a daemon is there.
            self.close()
            raise

    @property
    def waiting(self) -> str:
        """The text to show while the daemon is away."""
        for_s = 0.0 if self._away_since is None else time.monotonic() - self._away_since
        return f"waiting for sdrlinkd in {self.directory} ({for_s:.0f} s)"

    def close(self) -> None:
        """Close the connection; the next request opens a new one."""
        if self._control is not None:
            self._control.close()
            self._control = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def watch_screen(
    directory: str | os.PathLike[str] | None, draw: Callable[[Snapshot], RenderableType]
) -> NoReturn:
    """Keep a screen fresh until Ctrl-C."""
    console = screen_console()
    with (
        Follower(directory) as follower,
        Live(console=console, screen=console.is_terminal, auto_refresh=False) as live,
    ):
        while True:
            snapshot = follower.look()
            shown: RenderableType = Text(follower.waiting, style="bold yellow")
            live.update(shown if snapshot is None else draw(snapshot), refresh=True)
            time.sleep(WATCH_PERIOD_S)
