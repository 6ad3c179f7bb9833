"""The kernels that the interpreter calls, and the types of what they take and return.

A kernel takes its arguments and leaves its results in two rows of 64-bit words: an array is its
address and its sizes, a complex number is two words.
"""

from typing import NamedTuple

import numpy as np

from phy.tables.block import Field, parse_fields

BLOCK = Field(np.dtype("i8"), 1)
"""An argument block, to be recognised by its identity; inside kernels it is an array of words."""


class Entry(NamedTuple):
    """What a kernel takes and returns."""

    arguments: tuple[Field, ...]
    results: tuple[Field, ...]


def _entry(arguments: str, results: str = "") -> Entry:
    taken = (BLOCK if each == "block" else parse_fields(each)[0] for each in arguments.split())
    return Entry(tuple(taken), parse_fields(results))


ENTRIES = {
    "acquire": _entry("c8[1] i8 f8 c16 f8 block block block block block block", "i8 f8"),
    "settle": _entry("f4[3] block block block block block", "f8 f8 f8"),
    "demodulate": _entry(
        "c8[1] i8 f8 c16 i8 i8 block block block block c8[2] i2[1] f4[1] f8[1]", "f8"
    ),
    "to_tones": _entry("c8[1] i8[1] f8 c16 i8 block block f4[3]"),
    "slip": _entry("i8 block block"),
    "learn_channel": _entry("f4[3] f4[3] block block block"),
    "search": _entry("c8[1] i8 i8 f8 f8 i8 block", "i8"),
    "strongest": _entry("c8[1] i8 block", "i8 c16 f8"),
    "sanitise": _entry("c8[1] f8", "i8"),
    "find_lines": _entry("c8[1] i8 i8 block u1[2]", "i8"),
    "cut_lines": _entry("c8[1] i8 block c8[1] u1[2] i8[1]"),
    "blank": _entry("c8[1] i8 f8 f4[1] u1[1]", "f8"),
    "find_pulses": _entry("c8[1] f4[1]", "i8"),
    "sense": _entry("c8[1] f8 f8 f8 f8[1]"),
    "decode_blocks": _entry("i2[1] i8 block block u1[1] u1[2]"),
    "encode_blocks": _entry("u1[2] block u1[2]"),
    "convolve": _entry("u1[2] u1[2]"),
    "decode_rows": _entry("i2[2] i4[1] i2[1] u8[1] u1[2]"),
    "list_decode": _entry("i2[1] u1[2]"),
    "modulate": _entry("u1[1] i8 u1[1] i8 f8 block block block u1[1] c8[1]"),
    "modulate_bits": _entry("u1[1] i8 f8 block block c8[1]"),
    "add_noise": _entry("f4[1] i8 i8 f8 u4[1] f4[1] f4[1]"),
    "interpolate": _entry("f4[2] f4[2] f8 f8 c8[1]"),
    "filter_strided": _entry("c8[1] i8 i8 f4[1] c8[1] i8 i8"),
}
