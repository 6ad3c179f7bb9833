"""Receipts that a producer waits for: every message that asks for one gets one, in any case."""

import secrets
from collections import deque
from dataclasses import dataclass

from sdrlinkd.client.announced import BROADCAST
from sdrlinkd.client.messages import RECEIPT_PREFIX, Receipt

DAEMON_GONE = "daemon_gone"
"""Reason of the receipt for a message whose daemon has ended or does not answer."""


@dataclass(frozen=True, slots=True)
class _Asked:
    topic: str
    dst: int
    boot: str


class AwaitedReceipts:
    """Messages that await a receipt, and the receipts that have arrived."""

    def __init__(self) -> None:
        self._token = secrets.token_hex(4)
        self._count = 0
        self._open: dict[str, _Asked] = {}
        self._came: deque[Receipt] = deque()
        self.prefix = RECEIPT_PREFIX + self._token.encode()

    def __bool__(self) -> bool:
        return bool(self._came or self._open)

    @property
    def has_come(self) -> bool:
        """Whether a receipt from the daemon is ready to be taken."""
        return bool(self._came)

    def new_id(self) -> str:
        """A new id for the next message that asks for a receipt."""
        self._count += 1
        return f"{self._token}.{self._count}"

    def expect(self, id_: str, topic: str, dst: int | None, boot: str) -> None:
        """Note that message `id_` was handed to the daemon with boot id `boot`."""
        self._open[id_] = _Asked(topic, BROADCAST if dst is None else dst, boot)

    def take(self, receipt: Receipt) -> None:
        """Take a receipt from the daemon, and ignore one for a message that was given up."""
        if receipt.id in self._open:
            self._came.append(receipt)
            if not receipt.left:
                del self._open[receipt.id]

    def next(self, boot: str) -> Receipt | None:
        """The oldest receipt, or else one for a message lost with a daemon other than `boot`."""
        if self._came:
            return self._came.popleft()
        for id_, asked in self._open.items():
            if asked.boot == boot:
                break
            del self._open[id_]
            return Receipt(id_, asked.topic, asked.dst, "unknown", DAEMON_GONE)
        return None
