"""Compiles the modem, which is necessary only once, and reports the progress."""

import time
from collections.abc import Callable
from typing import TypeVar

import phy

Say = Callable[[str], None]

Progress = Callable[[int, int], None]

_Made = TypeVar("_Made")

EVERY_S = 10.0


def compile_modem(
    say: Say,
    every_s: float = EVERY_S,
    passing: Say | None = None,
    watch: Progress | None = None,
    engine: str = "auto",
) -> phy.Engine:
    """Make the modem ready: compile it, which takes a minute, or load it in milliseconds.

    `say` also gets a line if a modem that is not compiled had to be taken. For the rest, see
    `tell_progress`. Raises `phy.EngineError` if `engine` cannot be used here.
    """
    used = tell_progress(
        lambda progress: phy.warm_up(engine, progress), say, every_s, passing, watch
    )
    if used.name != "compiled" and engine == "auto":
        say(f"the modem runs on {used.told}; to compile it: sdrlinkctl phy compile")
    return used


def tell_progress(
    work: Callable[[Progress], _Made],
    say: Say,
    every_s: float = EVERY_S,
    passing: Say | None = None,
    watch: Progress | None = None,
) -> _Made:
    """Do `work(progress)`, which may compile the modem, and return what it returns.

    `say` gets a line on how long the compilation took. `passing`, by default `say`, gets the
    progress, at most once per `every_s`. `watch(done, total)` is called for every compiled kernel;
    an exception from it ends the work.
    """
    told = passing or say
    began = time.monotonic()
    last, is_whole = -every_s, False

    def progress(done: int, total: int) -> None:
        nonlocal last, is_whole
        if watch is not None:
            watch(done, total)
        is_whole = done == total
        so_far_s = time.monotonic() - began
        if so_far_s - last >= every_s:
            last = so_far_s
            told(f"compiling the modem, once: {done} of {total} steps, {so_far_s:.0f} s so far")

    made = work(progress)
    if is_whole:
        say(f"compiled the modem in {time.monotonic() - began:.0f} s")
    return made
