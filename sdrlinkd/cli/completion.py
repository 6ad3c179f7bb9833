"""Shell completions: names that the running daemon knows, and allowed values."""

from collections.abc import Callable

import msgspec
import typer

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import connect
from sdrlinkd.cli.fields import SHORT, paths
from sdrlinkd.client import NoDaemonError, RefusedError
from sdrlinkd.errors import UserError
from sdrlinkd.reports import Snapshot

PATIENCE_S = 1.0
"""Longest wait in s for the daemon after a press of TAB."""


def one_of(*values: str) -> Callable[[str], list[str]]:
    """A completion that offers the `values` that begin with the typed text."""

    def complete(incomplete: str) -> list[str]:
        return _begun(values, incomplete)

    return complete


def topic_names(context: typer.Context, incomplete: str) -> list[str]:
    """Names of topics that the daemon sends and that begin with `incomplete`."""
    snapshot = _snapshot(context)
    return _begun([each.name for each in snapshot.link.topics] if snapshot else (), incomplete)


def heard_names(context: typer.Context, incomplete: str) -> list[str]:
    """Bus names of topics that the daemon receives and that begin with `incomplete`."""
    snapshot = _snapshot(context)
    heard = snapshot.link.received if snapshot else ()
    return _begun([each.republished_as or each.name for each in heard], incomplete)


def robot_names(context: typer.Context, incomplete: str) -> list[str]:
    """Ids of the robots that the daemon hears, and 255 for all robots."""
    snapshot = _snapshot(context)
    heard = snapshot.link.neighbors if snapshot else ()
    return _begun([*(str(each.src) for each in heard if not each.is_self), "255"], incomplete)


def field_names(context: typer.Context, incomplete: str) -> list[str]:
    """Names of the snapshot's fields, completed section by section."""
    snapshot = _snapshot(context)
    if snapshot is None:
        return []
    whole = msgspec.to_builtins(snapshot, str_keys=True)
    first, depth = incomplete.split(".")[0], incomplete.count(".") + 1
    short = [whole[each] for each in SHORT if first and first not in whole]
    known = [path for part in (whole, *short) for path in paths(part)]
    steps = {".".join(path.split(".")[:depth]) for path in known if path.startswith(incomplete)}
    return sorted(steps)


def _begun(values: "tuple[str, ...] | list[str]", incomplete: str) -> list[str]:
    return [value for value in values if value.startswith(incomplete)]


def _snapshot(context: typer.Context) -> Snapshot | None:
    try:
        with connect(context.params.get("runtime_dir"), PATIENCE_S) as control:
            return ask_status(control)
    except (NoDaemonError, RefusedError, UserError, OSError):
        return None
