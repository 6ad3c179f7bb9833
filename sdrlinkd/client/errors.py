"""Errors that the client raises."""

from pathlib import Path

from sdrlinkd.client.paths import CONTROL_SOCKET, is_open

UNKNOWN_TOPIC = "tx_unknown_topic"
"""The ledger's name for a message of a topic that the daemon does not know."""


class NoDaemonError(ConnectionError):
    """No sdrlinkd answers in the runtime directory.

    `is_busy`: there is one, but it takes too long.
    """

    def __init__(self, words: str, *, is_busy: bool = False) -> None:
        super().__init__(words)
        self.is_busy = is_busy


class MessageRefusedError(ValueError):
    """The daemon does not accept a message; the text says what was given and what is allowed.

    `reason` is the ledger's name for the error (bus document, section 6.1).
    """

    def __init__(self, reason: str, words: str) -> None:
        super().__init__(words)
        self.reason = reason


class EnvelopeMismatchError(ValueError):
    """A message from the daemon does not follow version 1 of the envelope."""


def prepared(runtime_dir: object) -> NoDaemonError:
    """The error for a runtime directory that another user may have prepared."""
    return NoDaemonError(
        f"{runtime_dir} belongs to another user, in a folder where anybody may write: who answers "
        "there is not to be trusted; name the daemon's directory"
    )


def no_daemon(runtime_dir: Path) -> NoDaemonError:
    """The error for a runtime directory where nobody answers: no daemon, or one that is busy."""
    if is_open(runtime_dir / CONTROL_SOCKET):
        return NoDaemonError(
            f"the sdrlinkd in {runtime_dir} does not answer in time: its computer is busy, or it "
            "was stopped; try again",
            is_busy=True,
        )
    return NoDaemonError(
        f"no sdrlinkd answers in {runtime_dir}; start one (sdrlinkd --config FILE), or name its "
        "directory with SDRLINKD_RUNTIME_DIR; only members of its group may open a service's"
    )


def restarted(runtime_dir: object) -> NoDaemonError:
    """The error for a daemon that restarted before it had received everything sent."""
    return NoDaemonError(
        f"the sdrlinkd in {runtime_dir} has restarted; the last messages may be lost"
    )
