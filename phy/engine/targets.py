"""The machines that a library can be for: this one, or any of a family."""

import hashlib
import platform
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

_V3 = frozenset(["avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"])


class Target(NamedTuple):
    """A kind of processor; `features` and `cpu` are in LLVM's words."""

    name: str
    machine: str
    """As in `platform.machine()`."""
    needs: frozenset[str]
    """What the processor must have, in the kernel's words."""
    cpu: Callable[[], str]
    features: Callable[[], str]

    @property
    def triple(self) -> str:
        """The target in LLVM's words."""
        return f"{self.machine}-unknown-linux-gnu"

    @property
    def zig(self) -> str:
        """The target in Zig's words."""
        return f"{self.machine}-linux-gnu"

    @property
    def is_of_this_machine(self) -> bool:
        """Whether a compiler of this machine can make the library."""
        return self.machine == platform.machine()

    @property
    def fits(self) -> bool:
        """Whether this machine can run the library."""
        return self.is_of_this_machine and self.needs <= features_here()


def _this_cpu() -> str:
    import llvmlite.binding as llvm

    return str(llvm.get_host_cpu_name())


def _these_features() -> str:
    import llvmlite.binding as llvm

    return str(llvm.get_host_cpu_features().flatten())


@cache
def features_here() -> frozenset[str]:
    """What this processor has, in the kernel's words; empty if they are not told."""
    try:
        told = Path("/proc/cpuinfo").read_text()
    except OSError:
        return frozenset()
    for line in told.splitlines():
        key, _, value = line.partition(":")
        if key.strip() in {"flags", "Features"}:
            return frozenset(value.split())
    return frozenset()


def this() -> Target:
    """This machine alone; the name changes with the features of its processor."""
    found = " ".join(sorted(features_here()))
    key = hashlib.sha256(found.encode()).hexdigest()[:8]
    machine = platform.machine()
    return Target(f"{machine}-{key}", machine, frozenset(), _this_cpu, _these_features)


def _family(name: str, machine: str, cpu: str, needs: frozenset[str] = frozenset()) -> Target:
    return Target(name, machine, needs, lambda: cpu, lambda: "")


FAMILIES = (
    _family("x86-64-v3", "x86_64", "x86-64-v3", _V3),
    _family("x86-64", "x86_64", "x86-64"),
    _family("aarch64", "aarch64", "generic"),
)
"""The best first."""
TARGETS = {each.name: each for each in (this(), *FAMILIES)}
