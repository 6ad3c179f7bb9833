"""The families of metrics, from the types of the snapshot's fields, and their samples."""

import functools
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import msgspec
from msgspec import inspect

from sdrlinkd.exporter.names import RATE, named
from sdrlinkd.manual import field_texts
from sdrlinkd.reports import ONLY_GROWS, Snapshot

LABELS = {
    "link.topics": {"topic": "name", "topic_id": "topic_id"},
    "link.received": {"robot": "src", "topic": "name", "topic_id": "topic_id"},
    "link.neighbors": {"robot": "src"},
    "link.routes.robots": {"robot": "id"},
    "link.routes.flows": {"robot": "src", "destination": "dst"},
    "link.admission.flows": {"robot": "src", "topic_id": "topic_id", "destination": "dst"},
}
"""Of each list of the snapshot: the labels of its items, and the fields that they are."""
KEY_LABELS = {
    "dropped": "reason",
    "pdus_dropped": "reason",
    "queued_by_class": "class",
    "airtime_by_class_s": "class",
    "bursts_by_mcs": "mcs",
    "counters": "event",
    "percentiles_ms": "percentile",
    "hears": "heard",
}
"""Of each map by name: the label that the name is."""
STATES = {
    "state": ("running", "draining"),
    "verdict.level": ("OK", "DEGRADED", "DOWN"),
    "carrier.state": ("opening", "up", "waiting", "refused", "down", "ended"),
    "link.neighbors.clock.state": ("unsynced", "coarse", "synced", "holdover"),
    "link.neighbors.registry": ("same", "differs", "unknown"),
    "link.security.mode": ("off", "auth", "seal"),
}
"""Texts with few values: a sample for each of them, which is 1 or 0."""
INFO = {
    "version": "version",
    "carrier.kind": "backend",
    "link.access_policy": "access_policy",
    "link.registry_digest": "registry_digest",
}
"""Texts that are labels of sdrlink_info."""
RUNTIME_DIR = "runtime_dir"
"""Label of sdrlink_up, and of sdrlink_info: so a daemon that is gone still has the robot's id."""
SKIPPED = (
    "node", "taken_at_unix_ns", "carrier.lines", "carrier.others", "verdict.protection",
)  # fmt: skip
"""The first is a label of everything; Prometheus has a time of its own; a sweep would bring labels
without end."""

Labels = tuple[tuple[str, str], ...]


class Family(NamedTuple):
    """A family of metrics: `kind` is counter, gauge or state."""

    name: str
    kind: str
    help: str
    path: tuple[str, ...]
    factor: float
    labels: tuple[str, ...]
    states: tuple[str, ...] = ()


class Sample(NamedTuple):
    """One value of a family."""

    labels: Labels
    value: float


@functools.cache
def families() -> tuple[Family, ...]:
    """All families, in the order of the snapshot's fields."""
    return tuple(_of_field(inspect.type_info(Snapshot), (), (), ""))


def plain(snapshot: Snapshot) -> dict[str, Any]:
    """A snapshot as maps and lists, as `samples` and `info` need it."""
    found: dict[str, Any] = msgspec.to_builtins(snapshot, str_keys=True)
    return found


def samples(figures: Mapping[str, Any]) -> Iterator[tuple[Family, list[Sample]]]:
    """The samples of each family that has some, from a snapshot made `plain`."""
    for family in families():
        found = list(_walk(figures, family, family.path, (), ()))
        if found:
            yield family, found


def info(figures: Mapping[str, Any]) -> dict[str, str]:
    """The labels of sdrlink_info, from a snapshot made `plain`."""
    found = {}
    for path, label in INFO.items():
        value: Any = figures
        for step in path.split("."):
            value = value[step]
        found[label] = str(value)
    return found


def _of_struct(
    kind: inspect.StructType, path: tuple[str, ...], labels: tuple[str, ...]
) -> Iterator[Family]:
    texts, own = field_texts(kind.cls), ".".join(path)
    taken = set(LABELS.get(own, {}).values())
    for field in kind.fields:
        here = (*path, field.encode_name)
        if field.name in taken or ".".join(here) in SKIPPED or RATE.search(field.name):
            continue
        text = texts.get(field.name, "")
        yield from _of_field(field.type, here, labels, text)


def _of_field(
    kind: inspect.Type, path: tuple[str, ...], labels: tuple[str, ...], text: str
) -> Iterator[Family]:
    whole = ".".join(path)
    if isinstance(kind, inspect.UnionType):
        kind = next(each for each in kind.types if not isinstance(each, inspect.NoneType))
    grows = isinstance(kind, inspect.Metadata) and bool((kind.extra or {}).get(ONLY_GROWS))
    if isinstance(kind, inspect.Metadata):
        kind = kind.type
    if isinstance(kind, inspect.StructType):
        yield from _of_struct(kind, path, labels)
    elif isinstance(kind, inspect.ListType) and isinstance(kind.item_type, inspect.StructType):
        yield from _of_struct(kind.item_type, path, (*labels, *LABELS[whole]))
    elif isinstance(kind, inspect.DictType):
        yield from _of_field(kind.value_type, path, (*labels, KEY_LABELS[path[-1]]), text)
    elif whole in STATES:
        yield _family(path, "state", text, labels, STATES[whole])
    elif isinstance(kind, inspect.IntType | inspect.FloatType | inspect.BoolType):
        yield _family(path, "counter" if grows else "gauge", text, labels)
    elif isinstance(kind, inspect.ListType) and isinstance(kind.item_type, inspect.IntType):
        yield _family(path, "gauge", f"Number of: {text}", labels)


def _family(
    path: tuple[str, ...], kind: str, text: str, labels: tuple[str, ...],
    states: tuple[str, ...] = (),
) -> Family:  # fmt: skip
    name, factor = named(path)
    return Family(name, kind, text.replace("null: ", "absent: "), path, factor, labels, states)


def _walk(
    value: Any, family: Family, path: tuple[str, ...], done: tuple[str, ...], labels: Labels,
) -> Iterator[Sample]:  # fmt: skip
    """The samples of a family below `value`, whose own path is `done`."""
    if value is None:
        return
    if not path:
        yield from _leaf(value, family, done, labels)
        return
    if isinstance(value, list):
        told: Mapping[str, str] = LABELS[".".join(done)]
        for item in value:
            own = tuple((label, str(item[field])) for label, field in told.items())
            yield from _walk(item[path[0]], family, path[1:], (*done, path[0]), labels + own)
        return
    yield from _walk(value[path[0]], family, path[1:], (*done, path[0]), labels)


def _leaf(value: Any, family: Family, done: tuple[str, ...], labels: Labels) -> Iterator[Sample]:
    if isinstance(value, dict):
        label = KEY_LABELS[done[-1]]
        for key, each in value.items():
            yield Sample((*labels, (label, str(key))), each * family.factor)
    elif isinstance(value, list):
        yield Sample(labels, float(len(value)))
    elif family.states:
        for state in family.states:
            yield Sample((*labels, (family.path[-1], state)), float(value == state))
    else:
        yield Sample(labels, value * family.factor)
