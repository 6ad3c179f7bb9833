"""Makes and checks messages by their type: fields that people write, and octets of others."""

import dataclasses
import difflib
import math
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype

from sdrlinkd.adapters.typestore import empty, from_cdr, knows, ros2_types, to_cdr
from sdrlinkd.errors import CdrError, UserError

_TEXT = ("string", "wstring")
_NUMBERS = {
    "byte": "b", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip


def cdr_from_fields(kind: str, given: Mapping[Any, Any], where: str) -> bytes:
    """CDR of a message of type `kind` with the fields `given`, and defaults for the others.

    `where` names the message in errors. Raises UserError with the field, what was given and what is
    allowed.
    """
    return to_cdr(_message(kind, given, where), kind)


def check_cdr(kind: str, cdr: bytes, where: str) -> None:
    """Raise UserError if octets are no CDR of `kind`, or have a number that is not finite.

    Of a type that this host does not know, nothing can be said.
    """
    if not knows(kind):
        return
    try:
        message = from_cdr(cdr, kind)
    except CdrError as error:
        raise UserError(f"{where}: {error}") from None
    if not _is_finite(message):
        raise UserError(f"{where}: a number is not finite; allowed: finite numbers")


def _is_finite(value: Any) -> bool:  # noqa: ANN401
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, np.ndarray):
        return value.dtype.kind != "f" or bool(np.isfinite(value).all())
    if isinstance(value, list):
        return all(map(_is_finite, value))
    if dataclasses.is_dataclass(value):
        return all(_is_finite(getattr(value, each.name)) for each in dataclasses.fields(value))
    return True


def _message(kind: str, given: Any, where: str) -> Any:  # noqa: ANN401
    if not isinstance(given, Mapping):
        raise UserError(f"{where}: got {given!r}; allowed: a table of its fields")
    message = empty(kind)
    kinds = dict(ros2_types().fielddefs[kind][1])
    for name, value in given.items():
        if name not in kinds:
            near = difflib.get_close_matches(str(name), kinds, 1)
            hint = f" (did you mean {near[0]}?)" if near else ""
            raise UserError(f"{where}.{name}: no such field{hint}; allowed: {', '.join(kinds)}")
        old = getattr(message, name)
        setattr(message, name, _field(kinds[name], value, old, f"{where}.{name}"))
    return message


def _field(kind: Any, given: Any, old: Any, where: str) -> Any:  # noqa: ANN401
    """`given` as a field of type `kind`, whose default is `old`; `where` names it in errors."""
    node, inner = kind
    if node == Nodetype.NAME:
        return _message(inner, given, where)
    if node == Nodetype.BASE:
        return _plain(inner[0], given, where)
    item, length = inner
    if not isinstance(given, list) or (node == Nodetype.ARRAY and len(given) != length):
        wanted = f"a list of {length} items" if node == Nodetype.ARRAY else "a list"
        raise UserError(f"{where}: got {given!r}; allowed: {wanted}")
    items = [_field(item, each, None, f"{where}[{i}]") for i, each in enumerate(given)]
    return np.array(items, old.dtype) if isinstance(old, np.ndarray) else items


def _plain(kind: str, given: Any, where: str) -> Any:  # noqa: ANN401
    if kind in _TEXT:
        fits = isinstance(given, str) and _encodes(given)
    elif kind == "bool":
        fits = isinstance(given, bool)
    else:
        fits = not isinstance(given, bool) and _packs(_NUMBERS[kind], given)
    if not fits:
        article = "an" if kind.startswith("int") else "a"
        raise UserError(f"{where}: got {given!r}; allowed: {article} {kind}")
    return float(given) if kind.startswith("float") else given


def _encodes(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _packs(form: str, number: Any) -> bool:  # noqa: ANN401
    try:
        struct.pack("<" + form, number)
    except (struct.error, OverflowError):
        return False
    return True
