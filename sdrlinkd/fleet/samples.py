"""What comes over a Zenoh session, and what goes back."""

from collections.abc import Callable
from typing import NamedTuple


class Sample(NamedTuple):
    """What came for a subscription."""

    key: str
    payload: bytes
    attachment: bytes | None
    encoding: str = ""


class Question(NamedTuple):
    """A query that carries something, and may be answered later. Only one answer is sent."""

    payload: bytes
    attachment: bytes | None
    reply: Callable[[bytes, bytes | None], None]
    """Answers with a payload and an attachment."""
    drop: Callable[[], None]
    """Ends it without an answer."""


class Answer(NamedTuple):
    """An answer to a query."""

    key: str
    payload: bytes
    attachment: bytes | None = None


class Putter:
    """Puts values at one key; `end` takes down what was declared for that."""

    def __init__(self, put: Callable[[bytes, bytes | None], bool], end: Callable[[], None]) -> None:
        self._put = put
        self.end = end

    def __call__(self, payload: bytes, attachment: bytes | None) -> bool:
        """Put a value; False if too many puts wait."""
        return self._put(payload, attachment)
