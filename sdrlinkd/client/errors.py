"""What can go wrong for a program on the robot."""


class NoDaemonError(ConnectionError):
    """No sdrlinkd listens in the runtime directory."""


class MessageRefusedError(ValueError):
    """A message that the daemon does not take; the text says what was given and what is allowed.

    `reason` is the ledger's name for it (bus document, section 6.1).
    """

    def __init__(self, reason: str, words: str) -> None:
        super().__init__(words)
        self.reason = reason


class EnvelopeMismatchError(ValueError):
    """What arrived is not an envelope of version 1."""


def no_daemon(runtime_dir: object) -> NoDaemonError:
    """The error for a runtime directory without a daemon."""
    return NoDaemonError(
        f"no sdrlinkd answers in {runtime_dir}; start one (sdrlinkd --config FILE), or name its "
        "directory with SDRLINKD_RUNTIME_DIR; only members of its group may open a service's"
    )


def restarted(runtime_dir: object) -> NoDaemonError:
    """The error for a daemon that went while something was on its way to it."""
    return NoDaemonError(
        f"the sdrlinkd in {runtime_dir} has restarted; the last messages may be lost"
    )
