"""Times, sizes, frequencies and rates as people write them."""

import math
import re

from sdrlinkd.errors import UserError

LONG_LIFESPAN_S = 60.0
"""Lifespan in s above which, for urgent messages, the unit `ms` was probably left out."""
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
    "g": 10**9,
    "gb": 10**9,
    "gib": 1 << 30,
}
_THOUSANDS = {"": 1.0, "k": 1e3, "m": 1e6, "g": 1e9}
_FREQUENCIES = {"": 1.0} | {
    prefix + unit: value for prefix, value in _THOUSANDS.items() for unit in ("hz", "sps")
}
_BIT_RATES = {"": 1.0} | {
    prefix + unit: value for prefix, value in _THOUSANDS.items() for unit in ("bit/s", "bps")
}
_SPEEDS = {"": 1.0, "m/s": 1.0, "km/h": 1 / 3.6, "kmh": 1 / 3.6, "mph": 0.44704, "kn": 1852 / 3600}
_NUMBER = re.compile(
    r"\s*(inf|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?)\s*([a-zµ/]*)\s*", re.IGNORECASE
)


def seconds(text: str, key: str) -> float:
    """A time in s from text such as `0.1`, `100ms`, `inf`. Raises UserError that cites `key`."""
    return _read(text, key, _TIMES, "a time such as 0.1, 100ms, 2s or inf")


def octets(text: str, key: str) -> int:
    """A size in octets from `64000`, `64k` or `1MiB`. Raises UserError that cites `key`."""
    value = _read(text, key, _SIZES, "a size such as 64000, 64k or 1MiB")
    if not math.isfinite(value):
        raise UserError(f"{key}: got {text}; allowed: a size such as 64000, 64k or 1MiB")
    return round(value)


def hertz(text: str, key: str) -> float:
    """A frequency or rate in Hz, from `433.92 MHz` or `2 Msps`.

    Raises UserError that cites `key`.
    """
    allowed = "a frequency or rate such as 433.92e6, 433.92MHz or 2Msps"
    return _finite(text, key, _FREQUENCIES, allowed)


def bits_per_second(text: str, key: str) -> float:
    """A rate in bit/s from `1e5` or `100 kbit/s`. Raises UserError that cites `key`."""
    return _finite(text, key, _BIT_RATES, "a bit rate such as 1e5 or 100kbit/s")


def metres_per_second(text: str, key: str) -> float:
    """A speed in m/s from `5`, `5 m/s` or `18km/h`. Raises UserError that cites `key`."""
    return _finite(text, key, _SPEEDS, "a speed such as 5, 5m/s or 18km/h")


def _finite(text: str, key: str, units: dict[str, float], allowed: str) -> float:
    value = _read(text, key, units, allowed)
    if not math.isfinite(value):
        raise UserError(f"{key}: got {text}; allowed: {allowed}")
    return value


def _read(text: str, key: str, units: dict[str, float] | dict[str, int], allowed: str) -> float:
    found = _NUMBER.fullmatch(text)
    unit = units.get(
        found[2] if found and found[2] in units else (found[2].lower() if found else "?")
    )
    if found is None or unit is None:
        raise UserError(f"{key}: got {text}; allowed: {allowed}")
    return float(found[1]) * unit
