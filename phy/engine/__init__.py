"""Which code computes the modem: a compiled library of the kernels, or NumPy.

The library is made of `phy.kernels` once, by numba, in a process of its own (`build`). A process
that uses it needs no compiler. Where there is none and none can be built, `phy.reference` computes
everything in NumPy: slowly, but to the same rules.

One engine is in use in a process; `use` chooses it, and the first kernel does if nobody has.
"""

from phy.engine.builder import BuildError, Progress, build
from phy.engine.choice import ENGINES, Engine, EngineError, in_use, kernel, use
from phy.engine.files import fitting, place
from phy.engine.targets import TARGETS, Target, this

__all__ = [
    "ENGINES",
    "TARGETS",
    "BuildError",
    "Engine",
    "EngineError",
    "Progress",
    "Target",
    "build",
    "fitting",
    "in_use",
    "kernel",
    "place",
    "this",
    "use",
]
