"""Times and sizes as people write them."""

import math
import re

from sdrlinkd.errors import UserError

_TIMES = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0}
_SIZES = {
    "": 1,
    "b": 1,
    "k": 1000,
    "kb": 1000,
    "kib": 1024,
    "m": 10**6,
    "mb": 10**6,
    "mib": 1 << 20,
}
_NUMBER = re.compile(r"\s*(inf|[0-9]*\.?[0-9]+(?:e[+-]?[0-9]+)?)\s*([a-zµ]*)\s*", re.IGNORECASE)


def seconds(text: str, key: str) -> float:
    """`0.1`, `100ms`, `inf`. Raises UserError that cites `key`."""
    return _read(text, key, _TIMES, "a time such as 0.1, 100ms, 2s or inf")


def octets(text: str, key: str) -> int:
    """`64000`, `64k`, `1MiB`. Raises UserError that cites `key`."""
    value = _read(text, key, _SIZES, "a size such as 64000, 64k or 1MiB")
    if not math.isfinite(value):
        raise UserError(f"{key}: got {text}; allowed: a size such as 64000, 64k or 1MiB")
    return round(value)


def _read(text: str, key: str, units: dict[str, float] | dict[str, int], allowed: str) -> float:
    found = _NUMBER.fullmatch(text)
    unit = units.get(
        found[2] if found and found[2] in units else (found[2].lower() if found else "?")
    )
    if found is None or unit is None:
        raise UserError(f"{key}: got {text}; allowed: {allowed}")
    return float(found[1]) * unit
