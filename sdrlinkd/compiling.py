"""Compiles the modem, which is necessary only once, and reports the progress."""

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
    engine: str = "auto",
) -> phy.Engine:
    """Make the modem ready: compile it, which takes a minute, or load it in milliseconds.

    `say` gets a line on how long the compilation took, and on a modem without it. `passing`, by
    default `say`, gets the progress, at most once per `every_s`. `watch(done, total)` is called for
    every compiled kernel; an exception from it ends the work. Raises `phy.EngineError` if `engine`
    cannot be used here.
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

    used = phy.warm_up(engine, progress)
    if last >= 0 and used.name == "compiled":
        say(f"compiled the modem in {time.monotonic() - began:.0f} s")
    if used.name != "compiled" and engine == "auto":
        say(f"the modem runs on {used.told}")
    return used
