"""Receipts that a producer waits for: every message that asked is answered, come what may."""

import secrets
from collections import deque
from dataclasses import dataclass

from sdrlinkd.client.announced import BROADCAST
from sdrlinkd.client.messages import RECEIPT_PREFIX, Receipt

DAEMON_GONE = "daemon_gone"
"""Why nothing is known of a message that a daemon took with it."""


@dataclass(frozen=True, slots=True)
class _Asked:
    topic: str
    dst: int
    boot: str


class AwaitedReceipts:
    """Messages that were sent with a wish for a receipt, and the receipts that came."""

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
        """Whether a receipt from the daemon is there to be taken."""
        return bool(self._came)

    def new_id(self) -> str:
        """A new name for the next message that wants a receipt."""
        self._count += 1
        return f"{self._token}.{self._count}"

    def expect(self, id_: str, topic: str, dst: int | None, boot: str) -> None:
        """Note that message `id_` was handed to the daemon of that boot."""
        self._open[id_] = _Asked(topic, BROADCAST if dst is None else dst, boot)

    def take(self, receipt: Receipt) -> None:
        """Take a receipt from the daemon; one for a message that was given up tells nothing new."""
        if receipt.id in self._open:
            self._came.append(receipt)
            if not receipt.left:
                del self._open[receipt.id]

    def next(self, boot: str) -> Receipt | None:
        """The receipt that came first, or one for a message that a daemon of another boot had."""
        if self._came:
            return self._came.popleft()
        for id_, asked in self._open.items():
            if asked.boot == boot:
                break
            del self._open[id_]
            return Receipt(id_, asked.topic, asked.dst, "unknown", DAEMON_GONE)
        return None
