"""Compiles the modem, which is necessary only once, and reports the progress."""

import os
import time
from collections.abc import Callable

import phy

Say = Callable[[str], None]

EVERY_S = 10.0


def compile_modem(
    say: Say,
    every_s: float = EVERY_S,
    passing: Say | None = None,
    watch: Callable[[int, int], None] | None = None,
) -> None:
    """Compile the modem, or load it: minutes the first time, less than a second later.

    `say` gets a line on how long that took, and on problems with the cache. `passing`, by default
    `say`, gets the progress, at most once per `every_s`. `watch(done, total)` is called for every
    compiled kernel; an exception from it ends the work.
    """
    told = passing or say
    began = time.monotonic()
    last = -every_s

    def progress(done: int, total: int) -> None:
        nonlocal last
        if watch is not None:
            watch(done, total)
        so_far_s = time.monotonic() - began
        if so_far_s - last >= every_s:
            last = so_far_s
            told(f"compiling the modem, once: {done} of {total} kernels, {so_far_s:.0f} s so far")

    phy.warm_up(progress)
    if last >= 0:
        say(f"compiled the modem in {time.monotonic() - began:.0f} s")
    folder = phy.temporary_cache()
    if folder is not None and os.access(folder, os.W_OK):
        say(
            f"the compiled modem is cached in {folder}: neither the program's folder nor the "
            "user's cache is writable; set NUMBA_CACHE_DIR to a permanent folder"
        )
    elif folder is not None:
        say(
            "the compiled modem cannot be cached, so every start compiles it again: no folder is "
            "writable; set NUMBA_CACHE_DIR to a folder that is"
        )
