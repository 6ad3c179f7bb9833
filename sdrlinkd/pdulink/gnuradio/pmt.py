"""GNU Radio's polymorphic types as bytes: what `pmt::serialize` writes and reads, big endian.

| PMT | here |
|---|---|
| nil, bool, symbol, int32/uint64/int64, double, complex | None, bool, str, int, float, complex |
| pair, vector, tuple, dict | Pair, list, tuple, dict |
| uniform vector | bytes for u8, else a numpy array |
"""

import struct
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

DEPTH = 32
"""Most levels of nesting; a deeper value is not meant for us."""
_TRUE, _FALSE, _SYMBOL, _INT32, _DOUBLE, _COMPLEX, _NIL, _PAIR, _VECTOR, _DICT = range(10)
_UNIFORM, _UINT64, _TUPLE, _INT64 = 0x0A, 0x0B, 0x0C, 0x0D
_KINDS = tuple(
    np.dtype(kind).newbyteorder(">")
    for kind in ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8", "c8", "c16")
)
_U8 = 0


class Pair(NamedTuple):
    """A PMT pair; a PDU is one of a dict and a uniform vector."""

    car: Any
    cdr: Any


def dumps(value: Any) -> bytes:  # noqa: ANN401
    """A value as PMT bytes. Raises ValueError if it has no PMT."""
    out = bytearray()
    _write(value, out)
    return bytes(out)


def loads(data: bytes) -> Any:  # noqa: ANN401
    """The value at the start of `data`. Raises ValueError if it is not a PMT."""
    try:
        value, _ = _read(data, 0, DEPTH)
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise ValueError(f"no PMT: {error}") from None
    return value


def _write(value: Any, out: bytearray) -> None:  # noqa: ANN401
    for kind, write in _WRITERS:
        if isinstance(value, kind):
            write(value, out)
            return
    raise ValueError(f"no PMT for a {type(value).__name__}")


def _write_bool(value: bool, out: bytearray) -> None:
    out.append(_TRUE if value else _FALSE)


def _write_int(value: int, out: bytearray) -> None:
    for tag, form in ((_INT32, ">Bi"), (_INT64, ">Bq"), (_UINT64, ">BQ")):
        try:
            out += struct.pack(form, tag, value)
        except struct.error:
            continue
        return
    raise ValueError(f"{value} is beyond 64 bits")


def _write_symbol(value: str, out: bytearray) -> None:
    data = value.encode()
    if len(data) > 0xFFFF:
        raise ValueError("a symbol has at most 65535 bytes")
    out += struct.pack(">BH", _SYMBOL, len(data)) + data


def _write_pair(value: Pair, out: bytearray) -> None:
    out.append(_PAIR)
    _write(value.car, out)
    _write(value.cdr, out)


def _write_items(value: list[Any] | tuple[Any, ...], out: bytearray) -> None:
    out += struct.pack(">BI", _VECTOR if isinstance(value, list) else _TUPLE, len(value))
    for item in value:
        _write(item, out)


def _write_dict(value: dict[Any, Any], out: bytearray) -> None:
    # As in GNU Radio, the key added last comes first.
    for key, item in reversed(value.items()):
        out.append(_DICT)
        _write(Pair(key, item), out)
    out.append(_NIL)


def _write_uniform(value: Any, out: bytearray) -> None:  # noqa: ANN401
    if isinstance(value, bytes | bytearray | memoryview):
        tag, data, n = _U8, bytes(value), len(value)
    else:
        kind = value.dtype.newbyteorder(">")
        if value.ndim != 1 or kind not in _KINDS:
            raise ValueError(f"no uniform vector for {value.dtype} {value.shape}")
        tag, data, n = _KINDS.index(kind), value.astype(kind).tobytes(), len(value)
    # One byte of padding, as in GNU Radio.
    out += struct.pack(">BBIBB", _UNIFORM, tag, n, 1, 0) + data


_WRITERS: tuple[tuple[Any, Callable[[Any, bytearray], None]], ...] = (
    (type(None), lambda _, out: out.append(_NIL)),
    (bool, _write_bool),
    (int, _write_int),
    (float, lambda value, out: out.extend(struct.pack(">Bd", _DOUBLE, value))),
    (complex, lambda value, out: out.extend(struct.pack(">Bdd", _COMPLEX, value.real, value.imag))),
    (str, _write_symbol),
    (Pair, _write_pair),
    ((list, tuple), _write_items),
    (dict, _write_dict),
    ((bytes, bytearray, memoryview, np.ndarray), _write_uniform),
)


def _read(data: bytes, at: int, depth: int) -> tuple[Any, int]:
    """(value at index `at`, index at which the next one begins). Raises ValueError."""
    if depth < 0:
        raise ValueError("no PMT for us: nested too deep")
    tag, at = data[at], at + 1
    if tag in _PLAIN:
        return _PLAIN[tag], at
    if tag in _NUMBERS:
        form = _NUMBERS[tag]
        return form.unpack_from(data, at)[0], at + form.size
    if tag == _COMPLEX:
        return complex(*struct.unpack_from(">dd", data, at)), at + 16
    if tag == _SYMBOL:
        (n,) = struct.unpack_from(">H", data, at)
        return _slice(data, at + 2, n).decode(), at + 2 + n
    if tag == _PAIR:
        car, at = _read(data, at, depth - 1)
        cdr, at = _read(data, at, depth - 1)
        return Pair(car, cdr), at
    if tag in (_VECTOR, _TUPLE):
        return _read_items(data, at, depth, list if tag == _VECTOR else tuple)
    if tag == _DICT:
        return _read_dict(data, at - 1, depth)
    if tag == _UNIFORM:
        return _read_uniform(data, at)
    raise ValueError(f"no PMT: tag {tag:#x}")


_PLAIN = {_TRUE: True, _FALSE: False, _NIL: None}
_NUMBERS = {
    _INT32: struct.Struct(">i"), _DOUBLE: struct.Struct(">d"), _UINT64: struct.Struct(">Q"),
    _INT64: struct.Struct(">q"),
}  # fmt: skip


def _read_items(
    data: bytes, at: int, depth: int, kind: type[list[Any]] | type[tuple[Any, ...]]
) -> tuple[Any, int]:
    (n,) = struct.unpack_from(">I", data, at)
    at += 4
    items = []
    if n > len(data) - at:
        raise ValueError("no PMT: cut off")
    for _ in range(n):
        item, at = _read(data, at, depth - 1)
        items.append(item)
    return kind(items), at


def _read_dict(data: bytes, at: int, depth: int) -> tuple[dict[Any, Any], int]:
    pairs = []
    while data[at] == _DICT:
        pair, at = _read(data, at + 1, depth - 1)
        if not isinstance(pair, Pair):
            raise ValueError("no PMT: a dict of something else than pairs")
        pairs.append(pair)
    if data[at] != _NIL:
        raise ValueError("no PMT: a dict without an end")
    try:
        return dict(reversed(pairs)), at + 1
    except TypeError:
        raise ValueError("no PMT for us: a key that is no plain value") from None


def _read_uniform(data: bytes, at: int) -> tuple[Any, int]:
    tag, n, n_pad = struct.unpack_from(">BIB", data, at)
    if tag >= len(_KINDS):
        raise ValueError(f"no PMT: uniform vector of type {tag}")
    at += 6 + n_pad
    kind = _KINDS[tag]
    body = _slice(data, at, n * kind.itemsize)
    at += n * kind.itemsize
    return (bytes(body) if tag == _U8 else np.frombuffer(body, kind)), at


def _slice(data: bytes, at: int, n: int) -> bytes:
    if at + n > len(data):
        raise ValueError("no PMT: cut off")
    return data[at : at + n]
