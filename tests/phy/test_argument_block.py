"""Arrays in an argument block reach the kernel unchanged; a changed kernel is recompiled."""

import gc
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit

import phy
from phy.kernels.argument_block import ArgumentBlock, opener


class Content(NamedTuple):
    number: int
    share: float
    row: object
    planes: object
    cube: object


open_content = opener(Content, "i8 f8 f4[1] c8[2] i2[3]")


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


def test_who_has_the_words_keeps_the_arrays():
    words = [ArgumentBlock(content()).packed for _ in range(100)]
    gc.collect()
    _ = [np.full(4, 7.0, np.float32) for _ in range(1000)]
    assert all(_read(each)[2] == 14.0 for each in words)


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("row", np.zeros(4), "got array(float64, 1d, C); allowed: array(float32, 1d, C)"),
        ("row", np.zeros(8, np.float32)[::2], "got array(float32, 1d, A)"),
        ("planes", np.zeros(3, np.complex64), "got array(complex64, 1d, C)"),
        ("share", 1, "got int64; allowed: float64"),
    ],
)
def test_what_a_kernel_does_not_expect_is_refused(field, value, told):
    with pytest.raises(TypeError, match=re.escape(told)):
        ArgumentBlock(content()._replace(**{field: value}))


@pytest.mark.slow
def test_a_change_in_one_kernel_has_all_compiled_anew(tmp_path):
    """Its callers contain it, which numba cannot know."""
    copy = tmp_path / "phy"
    shutil.copytree(Path(phy.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    program = (
        "import numpy as np; from phy.kernels.rotation import lean; "
        "lean(0.1, np.arange(3), np.empty((2, 3), np.float32)); "
        "print(sum(lean.stats.cache_hits.values()))"
    )

    def hits():
        run = subprocess.run(
            [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, check=True
        )
        return int(run.stdout)

    assert [hits(), hits()] == [0, 1]
    with (copy / "kernels" / "lanes.py").open("a") as file:
        file.write("# changed\n")
    assert hits() == 0
