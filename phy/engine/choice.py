"""Chooses the engine of this process, and gives its kernels."""

import importlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from phy.engine import files, library
from phy.engine.builder import BuildError, Progress, build
from phy.engine.entries import ENTRIES
from phy.engine.targets import this

if TYPE_CHECKING:
    from phy.receiver import Receiver
    from phy.transmitter import Transmitter

ENGINES = ("auto", "compiled", "numpy")


class EngineError(Exception):
    """An engine cannot be used here; the text says why, and what to do."""


class Engine(NamedTuple):
    """An engine in use."""

    name: str
    told: str
    """What it is, and for "auto" why it is not the compiled one, for people."""
    kernels: Mapping[str, Callable[..., Any]]
    receiver: type["Receiver"]
    transmitter: type["Transmitter"]


_in_use: Engine | None = None


def use(name: str = "auto", progress: Progress | None = None) -> Engine:
    """Use an engine of ENGINES from now on; "auto": the compiled one if possible.

    A library that is missing is built first, which takes a minute: `progress(done, total)` is
    called first and after each kernel, and an exception from it ends the build. Raises EngineError.
    """
    global _in_use
    if name not in ENGINES:
        raise EngineError(f'engine: got "{name}"; allowed: one of {", ".join(ENGINES)}')
    if name == "numpy":
        found = _numpy("NumPy")
    elif _in_use is not None and _in_use.name == "compiled":
        found = _in_use
    else:
        try:
            found = _compiled(progress)
        except EngineError as error:
            if name == "compiled":
                raise
            found = _numpy(f"NumPy, which is slow: {error}")
    if found is not _in_use:
        _forget_kernels()
    _in_use = found
    return found


def in_use() -> Engine:
    """The engine of this process."""
    return _in_use or use()


def kernel(name: str) -> Callable[..., Any]:
    """A kernel of the engine in use."""
    return in_use().kernels[name]


def _compiled(progress: Progress | None) -> Engine:
    path = files.fitting()
    try:
        if path is None:
            path = files.place(this())
            build(this(), path, progress)
        found = library.load(path)
    except (BuildError, OSError) as error:
        raise EngineError(f"no compiled modem: {error}") from None
    from phy.receiver import Receiver
    from phy.transmitter import Transmitter

    return Engine("compiled", f"compiled for {files.target_of(path)}", found, Receiver, Transmitter)


def _numpy(told: str) -> Engine:
    from phy import reference

    # They have the faces of the compiled ones.
    receiver: Any = reference.Receiver
    transmitter: Any = reference.Transmitter
    return Engine("numpy", told, reference.KERNELS, receiver, transmitter)


def _forget_kernels() -> None:
    """`phy.compute` keeps the kernels that it was asked for."""
    known = vars(importlib.import_module("phy.compute"))
    for name in ENTRIES:
        known.pop(name, None)
