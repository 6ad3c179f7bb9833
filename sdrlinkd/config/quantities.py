"""Reads times, frequencies and rates written with a unit: `"300 ms"`, `"433.92 MHz"`."""

from collections.abc import Callable
from typing import NamedTuple

from msgspec import inspect

from sdrlinkd.config import describe
from sdrlinkd.errors import UserError
from sdrlinkd.units import bits_per_second, hertz, seconds


class _Quantity(NamedTuple):
    """The unit that a key's `ending` implies, and the function that reads text with such a unit."""

    ending: str
    read: Callable[[str, str], float]
    example: str


# The first matching ending counts: `_bit_s` must come before `_s`.
_QUANTITIES = (
    _Quantity("_bit_s", bits_per_second, '"100 kbit/s"'),
    _Quantity("_s", seconds, '"300 ms"'),
    _Quantity("rate_hz", hertz, '"2 Msps"'),
    _Quantity("_hz", hertz, '"433.92 MHz"'),
)


def as_numbers(raw: object, kind: inspect.Type | None, key: str = "") -> object:
    """`raw`, read from TOML, with text that has a unit converted to numbers.

    This applies to keys of a numeric type. Text that cannot be read stays, and the type check then
    refuses it.
    """
    if isinstance(raw, dict):
        table = next((each for each in _kinds(kind) if each and describe.is_table(each)), None)
        if table is None:
            return raw
        return {
            name: as_numbers(value, describe.child(table, name), name)
            for name, value in raw.items()
        }
    if isinstance(raw, list) and isinstance(kind, inspect.ListType):
        return [as_numbers(each, kind.item_type) for each in raw]
    quantity = _quantity_of(key, kind)
    if not isinstance(raw, str) or quantity is None or raw in _words(kind):
        return raw
    try:
        return quantity.read(raw, key)
    except UserError:
        return raw


def example(key: str | int, kind: inspect.Type) -> str:
    """A hint for errors how to write the value of `key` with a unit; empty if it has none."""
    quantity = _quantity_of(str(key), kind)
    return f", or with a unit, such as {quantity.example}" if quantity else ""


def _quantity_of(key: str, kind: inspect.Type | None) -> _Quantity | None:
    if not any(isinstance(each, inspect.FloatType) for each in _kinds(kind)):
        return None
    return next((each for each in _QUANTITIES if key.endswith(each.ending)), None)


def _words(kind: inspect.Type | None) -> set[object]:
    """Literal words that a key of `kind` allows."""
    literals = [each for each in _kinds(kind) if isinstance(each, inspect.LiteralType)]
    return {value for each in literals for value in each.values}


def _kinds(kind: inspect.Type | None) -> tuple[inspect.Type | None, ...]:
    return kind.types if isinstance(kind, inspect.UnionType) else (kind,)
