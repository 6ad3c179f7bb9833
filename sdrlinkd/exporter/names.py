"""Names of metrics by the conventions of Prometheus: base units, at the end of the name."""

import re
from typing import NamedTuple

PREFIX = "sdrlink"
RENAMED = {
    "link": "",
    "carrier": "pdu_link",
    "topics": "topic",
    "neighbors": "neighbor",
    "robots": "robot",
    "flows": "flow",
    "counters": "events",
    "asked_of_us": "asked_of_this_robot",
}
"""What parts of the snapshot are called in names of metrics."""
RATE = re.compile(r"_per_s$")
"""Fields that Prometheus computes by itself."""
_UNITS = {
    "unix_ns": ("timestamp_seconds", 1e-9),
    "s_ago": ("age_seconds", 1.0),
    "days_left": ("left_seconds", 86400.0),
    "ms": ("seconds", 1e-3),
    "us": ("seconds", 1e-6),
    "s": ("seconds", 1.0),
    "pct": ("ratio", 1e-2),
    "ppm": ("ratio", 1e-6),
    "hz": ("hertz", 1.0),
    "per": ("loss_ratio", 1.0),
    "pdr": ("delivered_ratio", 1.0),
    "bytes": ("bytes", 1.0),
}
"""The unit in a field's name: the base unit, and the factor of the value."""


class Named(NamedTuple):
    """The name of a metric without prefix and suffix, and the factor of its values."""

    name: str
    factor: float


def named(path: tuple[str, ...]) -> Named:
    """The name of the metric for a field of the snapshot."""
    words = "_".join(RENAMED.get(step, step) for step in path).strip("_")
    words = re.sub(r"__+", "_", words)
    for unit, (base, factor) in _UNITS.items():
        found = re.search(rf"(?:^|_){unit}(?=_|$)", words)
        if found:
            rest = (words[: found.start()] + words[found.end() :]).strip("_")
            return Named(f"{rest}_{base}" if rest else base, factor)
    return Named(words, 1.0)
