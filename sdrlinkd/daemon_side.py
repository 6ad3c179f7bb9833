"""The daemon beside a gateway or a bridge: its messages, and what it says of itself."""

import asyncio
import logging
from collections.abc import Callable, Sequence
from typing import Any

from sdrlinkd.asking import Asker
from sdrlinkd.client import (
    UNKNOWN_TOPIC,
    AsyncPublisher,
    AsyncSubscriber,
    EnvelopeMismatchError,
    Message,
    MessageRefusedError,
    NoDaemonError,
)
from sdrlinkd.errors import UserError
from sdrlinkd.reports import NeighborReport, Snapshot

POLL_S = 0.5
ANSWER_S = 2.0

_log = logging.getLogger(__name__)


class DaemonSide:
    """Follows the daemon at `directory` (None: where clients look), also across its restarts."""

    def __init__(self, directory: str | None) -> None:
        self._directory = directory
        self._asker = Asker(directory, ANSWER_S)
        self.snapshot: Snapshot | None = None
        """The daemon's last report; None while it does not answer."""

    @property
    def neighbors(self) -> list[NeighborReport]:
        """The other robots in its last report."""
        heard = [] if self.snapshot is None else self.snapshot.link.neighbors
        return [each for each in heard if not each.is_self]

    async def listen(self, take: Callable[[Message], None], topics: Sequence[str] = ()) -> None:
        """Call `take` for each message from the air; waits for the daemon if it is away.

        `topics`: names on the bus, or prefixes with `*`; none: all.

        Raises UserError.
        """
        is_told = False
        while True:
            try:
                async with AsyncSubscriber(*topics, runtime_dir=self._directory) as heard:
                    _log.info("listening to the daemon at %s", heard.directory)
                    is_told = False
                    while True:
                        take(await heard.receive())
            except NoDaemonError as error:
                if not is_told:
                    _log.warning("%s; waiting for it", error)
                is_told = True
                await asyncio.sleep(POLL_S)
            except EnvelopeMismatchError as error:
                raise UserError(str(error)) from None

    async def look(self, see: Callable[[Snapshot | None], None]) -> None:
        """Call `see` with the daemon's report twice a second.

        With None while it is away, or of another version.
        """
        while True:
            self.snapshot = await self._asker.snapshot()
            see(self.snapshot)
            await asyncio.sleep(POLL_S)

    async def ask(self, verb: str, arguments: dict[str, Any] | None = None) -> Any:  # noqa: ANN401
        """The daemon's answer to `verb`. Raises RefusedError and NoDaemonError."""
        return await self._asker.ask(verb, arguments)

    def close(self) -> None:
        """Ask no more."""
        self._asker.close()

    def publisher(self) -> AsyncPublisher:
        """What publishes on the daemon's bus, also across its restarts. Raises UserError."""
        try:
            return AsyncPublisher(runtime_dir=self._directory)
        except NoDaemonError as error:
            raise UserError(str(error)) from None

    async def publish(
        self,
        out: AsyncPublisher,
        name: str,
        cdr: bytes,
        kind: str,
        **wishes: Any,  # noqa: ANN401
    ) -> str | bool | None:
        """Publish a message of type `kind` by `out`, with the options of `AsyncPublisher.send`.

        A topic that the daemon does not know, as after its restart, is declared first, unless
        `kind` is empty. Raises MessageRefusedError, RefusedError and NoDaemonError.
        """
        try:
            return await out.send(name, cdr, type=kind or None, **wishes)
        except MessageRefusedError as error:
            if error.reason != UNKNOWN_TOPIC or not kind:
                raise
        await self.ask("declare", {"name": name, "type": kind})
        return await out.send(name, cdr, type=kind, **wishes)
