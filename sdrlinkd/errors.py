"""Every error of sdrlinkd, by who is to blame.

    SdrlinkError
    ├── UserError            what a person or a file gave us; exit code 2, never a traceback
    │   ├── ConfigError      a key of the configuration
    │   ├── RegistryError    a line of the topic registry
    │   ├── BusError         sockets, runtime directory, a second instance, no daemon
    │   └── BagError         a recording that cannot be read
    ├── LinkAbsentError      what carries the PDUs is not there now; it is tried again
    ├── LinkRefusedError     it is there and does not take its settings
    ├── CdrError             bytes that are no message of their type, as any program may send
    ├── PduError             bytes a peer put on the air; counted by `reason`, never logged as ours
    └── EnvelopeError        a bus message that breaks the envelope; counted, the next one works

Anything else that is raised is a bug of ours. One such bug has a name: IllegalStepError.
"""


class SdrlinkError(Exception):
    """Root of all errors that are not bugs."""


class UserError(SdrlinkError):
    """Bad input from a person; the message names what was given and what is allowed."""


class ConfigError(UserError):
    """A configuration key that cannot be used; the message cites key, given and allowed."""


class RegistryError(UserError):
    """A topic registry that cannot be used; the message cites file and line."""


class BusError(UserError):
    """The local bus cannot be opened or reached."""


class BagError(UserError):
    """A recording that cannot be read, or only in part."""


class LinkAbsentError(SdrlinkError):
    """A radio, hub or flowgraph that is not there now, and may come."""


class LinkRefusedError(SdrlinkError):
    """A radio or hub that refuses its settings; the message cites key, given and allowed."""


class CdrError(SdrlinkError):
    """A payload that is no message of its type; the message says why not."""


class PduError(SdrlinkError):
    """A received PDU that must not be used.

    `reason` is the ledger's name for it (`rx_crc`, `rx_entry`, …); the message says more.
    """

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason = reason
        self.detail = detail


class EnvelopeError(SdrlinkError):
    """A bus message whose frames do not form an envelope (bus document, section 3)."""


class IllegalStepError(Exception):
    """A step that a state machine's table does not have: a bug of ours."""
