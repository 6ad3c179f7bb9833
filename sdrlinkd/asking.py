"""Asks a daemon beside this program, once or again and again."""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from sdrlinkd.client import ControlClient, NoDaemonError, RefusedError
from sdrlinkd.reports import Snapshot

T = TypeVar("T")
PATIENCE_S = 1.0
_decode = msgspec.msgpack.Decoder(Snapshot).decode


def ask_status(control: ControlClient) -> Snapshot:
    """The daemon's snapshot.

    Raises NoDaemonError, RefusedError, and msgspec.ValidationError if it is of another version.
    """
    return _decode(control.ask_packed("status"))


def snapshot_at(directory: Path | str | None, patience_s: float = PATIENCE_S) -> Snapshot | None:
    """The snapshot of the daemon whose sockets are in `directory` (None: where clients look).

    None if it does not answer within `patience_s`, or is of another version.
    """
    try:
        with ControlClient(directory, patience_s) as control:
            return ask_status(control)
    except (NoDaemonError, RefusedError, msgspec.ValidationError):
        return None


class Asker:
    """Asks one daemon from an event loop, over one connection, which is made anew where it fails.

    `directory`: where the daemon's sockets are; None: where clients look.
    """

    def __init__(self, directory: Path | str | None, patience_s: float) -> None:
        self._directory = directory
        self._patience_s = patience_s
        # A ZeroMQ socket is for one thread.
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="ask")
        self._control: ControlClient | None = None

    async def ask(self, verb: str, arguments: dict[str, Any] | None = None) -> Any:  # noqa: ANN401
        """The daemon's answer to `verb`. Raises NoDaemonError and RefusedError."""
        return await self._do(lambda: self._client().ask(verb, arguments))

    async def snapshot(self) -> Snapshot | None:
        """The daemon's snapshot; None while it is away, or of another version."""
        try:
            return await self._do(lambda: ask_status(self._client()))
        except (NoDaemonError, RefusedError, msgspec.ValidationError):
            return None

    def close(self) -> None:
        """Close the connection, once the last answer has come."""
        self._thread.submit(self._hang_up)
        self._thread.shutdown(wait=False)

    async def _do(self, ask: Callable[[], T]) -> T:
        def asked() -> T:
            try:
                return ask()
            except NoDaemonError:
                # A new connection shows at once whether a daemon is there.
                self._hang_up()
                raise

        return await asyncio.get_running_loop().run_in_executor(self._thread, asked)

    def _client(self) -> ControlClient:
        if self._control is None:
            self._control = ControlClient(self._directory, self._patience_s)
        return self._control

    def _hang_up(self) -> None:
        if self._control is not None:
            self._control.close()
            self._control = None
