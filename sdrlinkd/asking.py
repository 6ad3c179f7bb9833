"""Asks a daemon beside this program for its snapshot."""

from pathlib import Path

import msgspec

from sdrlinkd.client import ControlClient, NoDaemonError, RefusedError
from sdrlinkd.reports import Snapshot

PATIENCE_S = 1.0
_decode = msgspec.msgpack.Decoder(Snapshot).decode


def ask_status(control: ControlClient) -> Snapshot:
    """The daemon's snapshot.

    Raises NoDaemonError, RefusedError, and msgspec.ValidationError if it is of another version.
    """
    return _decode(control.ask_packed("status"))


def snapshot_at(directory: Path | str | None, patience_s: float = PATIENCE_S) -> Snapshot | None:
    """The snapshot of the daemon whose sockets are in `directory` (None: where clients look).

    None if it does not answer within `patience_s`, or is of another version.
    """
    try:
        with ControlClient(directory, patience_s) as control:
            return ask_status(control)
    except (NoDaemonError, RefusedError, msgspec.ValidationError):
        return None
