"""The part of MessagePack that the bus header needs: one map of text keys to plain values.

The client runs in the robot's own interpreter, where ROS 2 provides ZeroMQ and little else, so
these few lines replace a dependency. https://github.com/msgpack/msgpack/blob/master/spec.md
"""

import struct
from collections.abc import Mapping
from typing import Any

Value = None | bool | int | float | str | bytes


def pack_map(values: Mapping[str, Value]) -> bytes:
    """MessagePack bytes of a map with at most 15 entries. Raises ValueError for a larger one."""
    if len(values) > 15:
        raise ValueError("a bus header has at most 15 fields")
    parts = [bytes((0x80 | len(values),))]
    try:
        for key, value in values.items():
            parts += (_pack(key), _pack(value))
    except struct.error as error:
        raise ValueError(f"a bus header's value is too large: {error}") from None
    return b"".join(parts)


def unpack(data: bytes) -> Any:  # noqa: ANN401
    """The value in `data`. Raises ValueError if `data` is not exactly one MessagePack value."""
    try:
        value, at = _unpack(memoryview(data), 0)
    except (struct.error, IndexError, RecursionError, TypeError) as error:
        raise ValueError(f"not MessagePack: {error}") from None
    if at != len(data):
        raise ValueError(f"{len(data) - at} bytes after the value")
    return value


def _pack(value: Value) -> bytes:
    if value is None:
        return b"\xc0"
    if isinstance(value, bool):
        return b"\xc3" if value else b"\xc2"
    if isinstance(value, int):
        if 0 <= value < 0x80:
            return bytes((value,))
        return (
            b"\xcf" + struct.pack(">Q", value) if value > 0 else b"\xd3" + struct.pack(">q", value)
        )
    if isinstance(value, float):
        return b"\xcb" + struct.pack(">d", value)
    if isinstance(value, str):
        raw = value.encode()
        return (
            bytes((0xA0 | len(raw),)) if len(raw) < 32 else b"\xda" + struct.pack(">H", len(raw))
        ) + raw
    return b"\xc5" + struct.pack(">H", len(value)) + value


# By the first byte of a value: the struct format of the rest, or the format of its length.
_FIXED = {
    0xCA: ">f", 0xCB: ">d", 0xCC: ">B", 0xCD: ">H", 0xCE: ">I", 0xCF: ">Q",
    0xD0: ">b", 0xD1: ">h", 0xD2: ">i", 0xD3: ">q",
}  # fmt: skip
_SIZED = {
    0xC4: (">B", bytes), 0xC5: (">H", bytes), 0xC6: (">I", bytes),
    0xD9: (">B", str), 0xDA: (">H", str), 0xDB: (">I", str),
    0xDC: (">H", list), 0xDD: (">I", list), 0xDE: (">H", dict), 0xDF: (">I", dict),
}  # fmt: skip
_SINGLE = {0xC0: None, 0xC2: False, 0xC3: True}


def _unpack(data: memoryview, at: int) -> tuple[Any, int]:
    first = data[at]
    at += 1
    if first < 0x80:
        return first, at
    if first >= 0xE0:
        return first - 256, at
    if first < 0x90:
        return _unpack_sized(data, at, dict, first & 0x0F)
    if first < 0xA0:
        return _unpack_sized(data, at, list, first & 0x0F)
    if first < 0xC0:
        return _unpack_sized(data, at, str, first & 0x1F)
    if first in _SINGLE:
        return _SINGLE[first], at
    if first in _FIXED:
        form = _FIXED[first]
        return struct.unpack_from(form, data, at)[0], at + struct.calcsize(form)
    if first in _SIZED:
        form, kind = _SIZED[first]
        length = struct.unpack_from(form, data, at)[0]
        return _unpack_sized(data, at + struct.calcsize(form), kind, length)
    raise ValueError(f"not MessagePack: first byte 0x{first:02x} is not in use here")


def _unpack_sized(data: memoryview, at: int, kind: type, length: int) -> tuple[Any, int]:
    if kind in (str, bytes):
        end = at + length
        if end > len(data):
            raise ValueError("not MessagePack: cut short")
        raw = bytes(data[at:end])
        return (raw.decode() if kind is str else raw), end
    items = []
    for _ in range(length * (2 if kind is dict else 1)):
        item, at = _unpack(data, at)
        items.append(item)
    if kind is list:
        return items, at
    return dict(zip(items[::2], items[1::2], strict=True)), at
