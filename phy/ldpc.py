"""Block codes for PDUs of any size, encoded and decoded as `phy.segmentation` lays them out."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from phy import compute
from phy.segmentation import MAX_ITERATIONS, Segmentation
from phy.tables.block import ArgumentBlock
from phy.tables.code import Form, Workspace, new_workspace

__all__ = ["Workspace", "decode", "encode", "new_workspace", "packed_form"]


@lru_cache(maxsize=256)
def packed_form(form: Segmentation) -> ArgumentBlock[Form]:
    """The tables of a segmentation, packed for kernels."""
    code = form.code
    return ArgumentBlock(
        Form(
            z=code.z,
            middle=code.middle,
            row_ends=code.row_ends,
            columns=code.columns,
            shifts=code.shifts,
            shares=form.shares,
            ends=form.ends,
        )
    )


def encode(bits: NDArray[np.uint8], form: Segmentation) -> NDArray[np.uint8]:
    """Encode blocks of bits `[blocks, n_bits]` to coded bits `[blocks, n_coded]`."""
    out = np.empty((len(bits), form.n_coded), np.uint8)
    compute.encode_blocks(bits, packed_form(form), out)
    return out


def decode(
    llr: NDArray[np.int16],
    form: Segmentation,
    work: ArgumentBlock[Workspace],
    max_iterations: int = MAX_ITERATIONS,
    white: NDArray[np.uint8] | None = None,
) -> NDArray[np.uint8]:
    """Decode LLRs `[blocks · n_coded]`, + for 0, to the likeliest bytes `[blocks, n_bits / 8]`.

    A block whose checks still fail after `max_iterations` is returned as it is. The bytes of all
    blocks are XORed with `white`.
    """
    out = np.empty((llr.size // form.n_coded, form.n_bits // 8), np.uint8)
    if white is None:
        white = np.zeros(out.size, np.uint8)
    compute.decode_blocks(llr.reshape(-1), max_iterations, packed_form(form), work, white, out)
    return out
