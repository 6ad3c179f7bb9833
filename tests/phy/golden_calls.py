"""Records calls of kernels with all that they read and write, for a program that repeats them."""

import struct
from typing import NamedTuple

import numpy as np

from phy import engine
from phy.testing import BLOCK, ENTRIES, FIELDS, compute

EXACT, NEAR_INT16, FLOAT32, FLOAT64, ADDRESSES = range(5)
_KINDS = {"int16": NEAR_INT16, "float32": FLOAT32, "complex64": FLOAT32, "float64": FLOAT64}
_KINDS["complex128"] = FLOAT64


class Buffer(NamedTuple):
    """Memory of a call: its kind, its content before and after, and which words are addresses."""

    kind: int
    before: bytes
    after: bytes
    addresses: list[tuple[int, int]]
    """(word, number of the buffer that it points to)."""


def recorded(monkeypatch, run) -> list[tuple[str, list[Buffer]]]:
    """Every call of a kernel while `run()` runs: its name, and its buffers.

    The first buffer has the words of the arguments, the second those of the results.
    """
    calls = []
    for name in ENTRIES:
        monkeypatch.setattr(
            compute, name, _recorder(name, engine.kernel(name), calls), raising=False
        )
    run()
    return calls


def packed(calls) -> bytes:
    """The calls as the program `replay.c` reads them."""
    names = list(ENTRIES)
    out = [struct.pack("<q", len(calls))]
    for name, buffers in calls:
        out.append(struct.pack("<qq", names.index(name), len(buffers)))
        for each in buffers:
            out.append(struct.pack("<qqq", each.kind, len(each.before), len(each.addresses)))
            out += [struct.pack("<qq", *address) for address in each.addresses]
            out += [_padded(each.before), _padded(each.after)]
    return b"".join(out)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 8)


def _recorder(name, kernel, calls):
    entry = ENTRIES[name]

    def call(*given):
        arrays = []
        words, addresses = _words(zip(entry.arguments, given, strict=True), arrays, 2)
        before = [each.tobytes() for each in arrays]
        returned = kernel(*given)
        after = [each.tobytes() for each in arrays]
        told = b"".join(
            struct.pack("<q" if field.dtype.kind == "i" else "<d", part)
            for field, value in zip(entry.results, _several(returned, entry), strict=True)
            for part in ((value.real, value.imag) if field.dtype.kind == "c" else (value,))
        )
        # Beside figures, an index counts as one of almost 0: what follows from it does not.
        is_exact = all(field.dtype.kind == "i" for field in entry.results)
        results = Buffer(EXACT if is_exact else FLOAT64, bytes(len(told)), told, [])
        buffers = [Buffer(ADDRESSES, words, words, addresses), results]
        for array, first, last in zip(arrays, before, after, strict=True):
            kind = _KINDS.get(str(array.dtype), EXACT)
            own = []
            if isinstance(array, _Words):
                kind, own = ADDRESSES, array.addresses
            buffers.append(Buffer(kind, first, last, own))
        calls.append((name, buffers))
        return returned

    return call


class _Words(np.ndarray):
    """The words of an argument block."""

    addresses: list


def _several(returned, entry):
    return () if not entry.results else returned if len(entry.results) > 1 else (returned,)


def _words(fields, arrays, first):
    """(words, which of them are addresses); appends the arrays that they point to."""
    words, addresses = [], []
    for field, value in fields:
        if field is BLOCK:
            inside, pointing = _words(
                zip(FIELDS[type(value.content)], value.content, strict=True), arrays, first
            )
            block = np.frombuffer(inside, np.int64).view(_Words)
            block.addresses = pointing
            addresses.append((len(words), first + len(arrays)))
            words += [0, len(block)]
            arrays.append(block)
        elif field.n_dimensions:
            addresses.append((len(words), first + len(arrays)))
            words += [0, *value.shape]
            arrays.append(np.ascontiguousarray(value) if value.size == 0 else value)
        elif field.dtype.kind == "c":
            words += [_as_word(value.real), _as_word(value.imag)]
        else:
            words.append(_as_word(value) if field.dtype.kind == "f" else int(value))
    return struct.pack(f"<{len(words)}q", *words), addresses


def _as_word(value: float) -> int:
    return struct.unpack("<q", struct.pack("<d", float(value)))[0]
