"""Selects fields of a snapshot by name: `link.topics.odom.sent`, `neighbors.2.snr_db`."""

import csv
import sys
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any

import msgspec

from sdrlinkd.errors import UserError
from sdrlinkd.reports import Snapshot

SHORT = ("link",)
"""Sections that may be omitted at the start of a field's name."""
USUAL = (
    "taken_at_unix_ns", "verdict.level", "carrier.state", "carrier.level_dbfs",
    "carrier.clipped_pct", "link.air_sent_pct", "link.air_heard_pct", "link.tx.accepted",
    "link.tx.sent", "link.tx.queued", "link.tx.queued_bytes", "link.rx.pdus_heard",
    "link.rx.started", "link.rx.delivered",
)  # fmt: skip
"""Fields that --csv prints by default."""


def fields_of(snapshot: Snapshot, names: Sequence[str]) -> list[Any]:
    """The values of the fields `names`. Raises UserError that lists the existing fields."""
    whole = msgspec.to_builtins(snapshot, str_keys=True)
    return [_field(whole, name) for name in names]


def as_text(value: object) -> str:
    """A value as text: empty for null, JSON for values with parts."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    return msgspec.json.encode(value).decode()


class CsvLines:
    """Prints each snapshot as one line with the fields `names`, after a first line of names."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names
        self._writer = csv.writer(sys.stdout, lineterminator="\n")
        self._has_begun = False

    def __call__(self, snapshot: Snapshot) -> None:
        values = fields_of(snapshot, self._names)
        if not self._has_begun:
            self._writer.writerow(self._names)
            self._has_begun = True
        self._writer.writerow([as_text(value) for value in values])


def paths(value: object, at: str = "") -> Iterator[str]:
    """Names of all single values in `value`, for shell completion."""
    if isinstance(value, dict | list):
        if at and isinstance(value, list):
            yield at
        for key, each in _parts(value).items():
            yield from paths(each, f"{at}.{key}" if at else key)
    else:
        yield at


def _field(whole: dict[str, Any], name: str) -> object:
    steps = name.split(".")
    for section in SHORT:
        if steps[0] not in whole and steps[0] in whole[section]:
            steps = [section, *steps]
    value: Any = whole
    for at, step in enumerate(steps):
        found = _step(value, step)
        if found is None:
            raise UserError(_unknown(name, step, ".".join(steps[:at]), value))
        (value,) = found
    return value


def _step(value: object, step: str) -> tuple[object] | None:
    """The part of `value` named `step`, in a tuple because it may be None; None if missing."""
    parts = _parts(value)
    if step in parts:
        return (parts[step],)
    if isinstance(value, list) and step.isdigit() and not _is_by_robot(value):
        return (value[int(step)],) if int(step) < len(value) else None
    # The last part of a topic's name suffices if it is unique.
    ends = [each for key, each in parts.items() if key.rsplit("/", 1)[-1] == step]
    return (ends[0],) if len(ends) == 1 else None


def _parts(value: object) -> dict[str, Any]:
    """The parts of a value by key; parts of a list by topic name or robot id, or else by index."""
    if isinstance(value, dict):
        return value
    if not isinstance(value, list):
        return {}
    if _is_by_robot(value):
        return {str(each["src"]): each for each in value}
    return {_called(each) or str(at): each for at, each in enumerate(value)}


def _called(each: object) -> str:
    if not isinstance(each, dict):
        return ""
    name: str = each.get("republished_as") or each.get("name", "")
    return name


def _is_by_robot(value: list[Any]) -> bool:
    return bool(value) and isinstance(value[0], dict) and "hops_left" in value[0]


def _unknown(name: str, step: str, before: str, value: object) -> str:
    known = list(_parts(value))
    where = f"in {before}" if before else "in the snapshot"
    if not known:
        return f"--field {name}: no fields {where}"
    close = get_close_matches(step, [*known, *(key.rsplit("/", 1)[-1] for key in known)], n=1)
    hint = f"; did you mean {close[0]}?" if close else ""
    return f"--field {name}: no {step} {where}{hint}; allowed: {', '.join(known)}"
