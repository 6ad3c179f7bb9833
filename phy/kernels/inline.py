"""Steps of a kernel: code of their own to read, inlined where they are used."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

_Step = TypeVar("_Step", bound=Callable[..., Any])


def step(function: _Step) -> _Step:
    """Compile a step, which only kernels can call and which is inlined there.

    To hand a tuple of arrays on by value costs more than many a step does.
    """
    options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    made: Any = njit(nogil=True, forceinline=True, **options)(function)
    inlined: _Step = made
    return inlined
