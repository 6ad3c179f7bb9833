"""The base of the asyncio clients."""

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import zmq.asyncio

from sdrlinkd.client.blocking_socket import LINGER_MS
from sdrlinkd.client.errors import prepared
from sdrlinkd.client.paths import is_prepared

if TYPE_CHECKING:
    from typing_extensions import Self


class AsyncSocket:
    """A ZeroMQ socket in its own context, closed by `async with`."""

    def __init__(self, kind: int, runtime_dir: Path, timeout_s: float) -> None:
        if is_prepared(runtime_dir):
            raise prepared(runtime_dir)
        self.runtime_dir = runtime_dir
        self._timeout_s = timeout_s
        self._context = zmq.asyncio.Context()
        self._socket = self._context.socket(kind)

    @property
    def directory(self) -> Path:
        """Alias of `runtime_dir`, as in the constructor."""
        return self.runtime_dir

    async def close(self) -> None:
        """Close the sockets; messages sent have 200 ms to leave."""
        self._context.destroy(LINGER_MS)

    async def __aenter__(self) -> "Self":
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()
