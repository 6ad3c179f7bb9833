"""Steps: parts of a kernel, written as functions and inlined where they are called."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

_Step = TypeVar("_Step", bound=Callable[..., Any])


def step(function: _Step) -> _Step:
    """Compile a step, which only kernels can call and which is inlined there.

    Passing a tuple of arrays by value would cost more than many steps do.
    """
    options: dict[str, Any] = {
        "no_cpython_wrapper": True,
        "no_cfunc_wrapper": True,
        "error_model": "numpy",
    }
    made: Any = njit(nogil=True, forceinline=True, **options)(function)
    inlined: _Step = made
    return inlined
