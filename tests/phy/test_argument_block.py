"""Arrays in an argument block reach the kernel unchanged."""

import ctypes
import gc
import re
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit

from phy.kernels import opener
from phy.testing import ArgumentBlock, block_of


@block_of("i8 f8 f4[1] c8[2] i2[3]")
class Content(NamedTuple):
    number: int
    share: float
    row: object
    planes: object
    cube: object


open_content = opener(Content)


@njit
def _read(words):
    it = open_content(words)
    it.row[1] = 9
    return it.number, it.share, it.row.sum(), it.planes[1, 2], it.cube[1, 0, 3], it.cube.shape


def content():
    row = np.arange(4, dtype=np.float32)
    planes = np.arange(6).reshape(2, 3).astype(np.complex64) * 1j
    return Content(-3, 0.25, row, planes, np.arange(16, dtype=np.int16).reshape(2, 2, 4))


def test_a_kernel_sees_what_is_in_an_argument_block_and_may_change_it():
    block = ArgumentBlock(content())
    assert _read(block.packed) == (-3, 0.25, 14.0, 5j, 11, (2, 2, 4))
    assert list(block.content.row) == [0, 9, 2, 3]


def test_a_block_keeps_the_arrays():
    blocks = [ArgumentBlock(content()) for _ in range(100)]
    gc.collect()
    _ = [np.full(4, 7.0, np.float32) for _ in range(1000)]
    assert all(_read(each.packed)[2] == 14.0 for each in blocks)


def test_a_block_lies_where_it_says():
    block = ArgumentBlock(content())
    words = (ctypes.c_int64 * len(block.packed)).from_address(block.address)
    assert list(words) == block.packed.tolist()


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        (
            "row",
            np.zeros(4),
            "Content.row: got float64, 1 dimensions; allowed: a contiguous array of float32",
        ),
        ("row", np.zeros(8, np.float32)[::2], "allowed: a contiguous array"),
        ("planes", np.zeros(3, np.complex64), "got complex64, 1 dimensions"),
        ("row", [1.0], "got list; allowed: a contiguous array"),
        ("number", 0.5, "Content.number: got 0.5; allowed: int64"),
    ],
)
def test_what_a_kernel_does_not_expect_is_refused(field, value, told):
    with pytest.raises(TypeError, match=re.escape(told)):
        ArgumentBlock(content()._replace(**{field: value}))
