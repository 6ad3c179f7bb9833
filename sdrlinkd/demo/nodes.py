"""Daemons as child processes, and a consumer that records what one republishes."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

from sdrlinkd.asking import ask_status
from sdrlinkd.client import ControlClient, Message, NoDaemonError
from sdrlinkd.demo.hearing import Hearing
from sdrlinkd.demo.links import NODE_ID
from sdrlinkd.demo.trace import Sample, Trace
from sdrlinkd.errors import UserError
from sdrlinkd.process import Process, module
from sdrlinkd.reports import Snapshot

# Compiling the modem from scratch takes a while on a small machine.
START_TIMEOUT_S = 120.0


def daemon_process(config: Path) -> Process:
    """A daemon's process, not started yet."""
    return Process(module("sdrlinkd", "--config", config), log=config.parent / "log")


@contextlib.contextmanager
def daemon(config: Path) -> Iterator[Process]:
    """A daemon that runs within the context, which is entered once its PDU link is up."""
    process = daemon_process(config)
    try:
        process.start()
        wait_until_up(process, config.parent)
        yield process
    finally:
        process.stop()


def snapshot_of(directory: Path) -> Snapshot:
    """The snapshot of the daemon whose sockets are in `directory`."""
    with ControlClient(directory) as control:
        return ask_status(control)


def problems_of(directory: Path) -> list[str]:
    """Discrepancies in the ledger of the daemon whose sockets are in `directory`."""
    with ControlClient(directory) as control:
        problems: list[str] = control.ask("check")["problems"]
        return problems


def wait_until_up(process: Process, directory: Path) -> None:
    """Wait until the daemon's PDU link is up. Raises UserError with its log if that fails."""
    deadline = time.monotonic() + START_TIMEOUT_S
    while process.is_running and time.monotonic() < deadline:
        # The daemon answers before its modem is ready.
        with contextlib.suppress(NoDaemonError):
            pdu_link = snapshot_of(directory).carrier
            if pdu_link.state in ("up", "ended"):
                return
            if pdu_link.state in ("waiting", "refused"):
                raise UserError(f"the daemon has no link: {pdu_link.reason}")
        time.sleep(0.02)
    raise UserError(f"the daemon did not start:\n{process.log()}")


class Consumer(Hearing):
    """Records what a daemon republishes in a trace.

    `by_age`: take latencies from the messages' ages, as the samples were recorded before.
    """

    def __init__(self, directory: Path, trace: Trace, by_age: bool = False) -> None:
        self._prefix = f"/rx_robot_{NODE_ID}/"
        self._trace = trace
        self._by_age = by_age
        super().__init__(directory, self._note, self._prefix + "*")

    def _note(self, message: Message, at: float) -> None:
        name = message.topic.removeprefix(self._prefix)
        age_us = message.age_us if self._by_age else None
        age_s = None if age_us is None else age_us * 1e-6
        self._trace.received[name].append(Sample(at, message.payload, age_s))
