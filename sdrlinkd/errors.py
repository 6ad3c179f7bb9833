"""Every error of sdrlinkd, by its cause.

    SdrlinkError
    ├── UserError            what a person or a file gave us; exit code 2, never a traceback
    │   ├── ConfigError      a key of the configuration
    │   ├── RegistryError    a line of the topic registry
    │   ├── DeclarationError a topic that a producer declares
    │   ├── BusError         sockets, runtime directory, a second instance, no daemon
    │   └── BagError         a recording that cannot be read
    ├── LinkAbsentError      the PDU link is absent now; the daemon retries
    ├── LinkRefusedError     the PDU link is present and refuses its settings
    ├── CdrError             bytes that are not a message of their type; any program may send them
    ├── PduError             bad bytes from a peer; counted by `reason`, not logged as our error
    └── EnvelopeError        a bus message that breaks the envelope; counted and skipped

Any other exception is a bug of ours. One such bug has a class of its own: IllegalStepError.
"""

import contextlib
from collections.abc import Iterable, Iterator
from difflib import get_close_matches


class SdrlinkError(Exception):
    """Base class of all errors that are not bugs."""


class UserError(SdrlinkError):
    """Bad input from a person; the message names what was given and what is allowed."""


@contextlib.contextmanager
def ungrouped() -> Iterator[None]:
    """Raises a UserError by itself that ended a task group, which wraps even a single error."""
    try:
        yield
    except BaseExceptionGroup as group:
        mistakes, others = group.split(UserError)
        if mistakes is None or others is not None:
            raise
        error: BaseException = mistakes
        while isinstance(error, BaseExceptionGroup):
            error = error.exceptions[0]
        raise error from None


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """`; did you mean …?` with the closest name, or the only one that begins so, or has it."""
    names = list(known)
    close = get_close_matches(given, names, n=1)
    text = given.lower()
    beginning = [name for name in names if text and name.lower().startswith(text)]
    holding = beginning or [name for name in names if text and text in name.lower()]
    found = close[0] if close else holding[0] if len(holding) == 1 else ""
    return f"; did you mean {found}?" if found else ""


class ConfigError(UserError):
    """A configuration key that cannot be used; the message cites key, given and allowed."""


class RegistryError(UserError):
    """A topic registry that cannot be used; the message cites file and line."""


class DeclarationError(UserError):
    """A topic that cannot be declared; the message cites key, given and allowed."""


class BusError(UserError):
    """The local bus cannot be opened or reached."""


class BagError(UserError):
    """A recording that cannot be read, or only partly."""


class LinkAbsentError(SdrlinkError):
    """A radio, hub or flowgraph that is absent now and may appear later."""


class LinkRefusedError(SdrlinkError):
    """A radio or hub that refuses its settings; the message cites key, given and allowed."""


class CdrError(SdrlinkError):
    """A payload that is not a message of its type; the error text says why."""


class PduError(SdrlinkError):
    """A received PDU that must not be used.

    `reason` is the ledger's reason (`rx_crc`, `rx_entry`, …); the error text has the details.
    """

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason = reason
        self.detail = detail


class EnvelopeError(SdrlinkError):
    """A bus message whose frames do not form an envelope (bus document, section 3)."""


class IllegalStepError(Exception):
    """A state machine was asked for a step that its table does not have, which is a bug of ours."""
