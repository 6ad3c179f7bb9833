"""Message types from an independent library: fields in the words of rclpy, and any messages."""

import numpy as np
from rosbags.interfaces import Nodetype

from sdrlinkd.adapters.testing import ros2_types

TYPES = ros2_types()
PLAIN = {"float32": "float", "float64": "double", "bool": "boolean"}
NUMBERS = {
    "bool": "?", "float32": "f4", "float64": "f8", "byte": "i1", "octet": "i1", "char": "u1",
    "uint8": "u1", "int8": "i1", "uint16": "u2", "int16": "i2", "uint32": "u4", "int32": "i4",
    "uint64": "u8", "int64": "i8",
}  # fmt: skip


def fields_of(name):
    """A type's fields in the words of rclpy."""
    package, _, last = name.partition("/")
    found = TYPES.fielddefs[f"{package}/msg/{last}"][1]
    return {field: words(node, inner) for field, (node, inner) in found}


def words(node, inner):
    if node == Nodetype.NAME:
        return inner.replace("/msg/", "/")
    if node == Nodetype.BASE:
        return PLAIN.get(inner[0], inner[0])
    item, length = inner
    text = words(*item)
    if node == Nodetype.ARRAY:
        return f"{text}[{length}]"
    return f"sequence<{text}, {length}>" if length else f"sequence<{text}>"


def made(kind, chance):
    """A message with random fields."""
    values = (value(*field, chance) for _, field in TYPES.fielddefs[kind][1])
    return TYPES.types[kind](*values)


def value(node, inner, chance):
    if node == Nodetype.NAME:
        return made(inner, chance)
    if node == Nodetype.BASE:
        if inner[0] == "string":
            return "".join(chance.choice("aé€😀") for _ in range(chance.randrange(6)))
        return number(inner[0], 1, chance)[0].item()
    item, length = inner
    n = length if node == Nodetype.ARRAY else min(chance.randrange(4), length or 4)
    if item[0] == Nodetype.BASE and item[1][0] != "string":
        return number(item[1][0], n, chance)
    return [value(*item, chance) for _ in range(n)]


def number(name, n, chance):
    kind = np.dtype(NUMBERS[name])
    octets = np.frombuffer(chance.randbytes(n * kind.itemsize), np.uint8)
    return octets % 2 != 0 if kind.char == "?" else octets.view(kind)
