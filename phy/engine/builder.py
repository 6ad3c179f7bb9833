"""Builds the library of the kernels, with numba and a C compiler."""

import contextlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from phy.engine import library
from phy.engine.entries import ENTRIES
from phy.engine.targets import Target

Progress = Callable[[int, int], None]

# numba must leave the code as it is: the library may be for another machine.
_SETTINGS = {
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_DISABLE_JIT": "0",
    "NUMBA_OPT": "0",
}
_ROOT = Path(__file__).parents[2]
_CALLS = Path(__file__).with_name("call.c")
_OPTIONS = ("-shared", "-fPIC", "-O2", "-fno-strict-aliasing")
N_STEPS = len(ENTRIES) + 1
"""Every kernel, and the calls."""


class BuildError(Exception):
    """A library could not be built; the text says why, and what to do."""


def build(target: Target, to: Path, progress: Progress | None = None) -> None:
    """Compile the kernels for `target` into the library `to`, in another process.

    `progress(done, total)` is called first and after each kernel, and an exception from it ends the
    build. Raises BuildError.
    """
    if importlib.util.find_spec("numba") is None:
        raise BuildError(f"numba is not installed: {_line('numba')}")
    compiler = _c_compiler(target)
    if compiler is None:
        raise BuildError(f"there is no C compiler: install gcc, or {_line('ziglang')}")
    if progress is not None:
        # The first kernel takes seconds.
        progress(0, N_STEPS)
    with tempfile.TemporaryDirectory(prefix="sdrlinkd-build-") as folder:
        made, linked = Path(folder) / "kernels.o", Path(folder) / "kernels.so"
        compile_kernels(target, made, progress)
        made.with_name("kernels.h").write_text(library.header())
        sources = [f"-I{folder}", str(_CALLS), str(made)]
        _link([*compiler, *_OPTIONS, *sources, "-o", str(linked), "-lm"])
        _move(linked, to)
    if progress is not None:
        progress(N_STEPS, N_STEPS)


def _line(package: str) -> str:
    """The line that installs a package into the environment of this program."""
    return f"`{shlex.quote(sys.executable)} -m pip install {package}`"


def compile_kernels(target: Target, to: Path, progress: Progress | None = None) -> None:
    """Compile the kernels for `target` into the object file `to`. Raises BuildError."""
    settings = {**os.environ, **_SETTINGS, "NUMBA_CACHE_DIR": str(to.parent)}
    settings["PYTHONPATH"] = os.pathsep.join((str(_ROOT), os.environ.get("PYTHONPATH", "")))
    command = [sys.executable, "-P", "-m", "phy.engine", target.name, str(to), str(os.getpid())]
    errors = to.with_name("errors")
    with (
        errors.open("w") as stderr,
        subprocess.Popen(  # noqa: S603 (Python, with a target of ours)
            command, env=settings, stdout=subprocess.PIPE, stderr=stderr
        ) as run,
    ):
        try:
            for line in run.stdout or ():
                if progress is not None:
                    progress(int(line), N_STEPS)
        except BaseException:
            run.kill()
            raise
    if run.returncode:
        told = errors.read_text().strip().splitlines()
        raise BuildError(told[-1] if told else f"the compiler ended with {run.returncode}")


def _move(linked: Path, to: Path) -> None:
    """Put a library in its place; whoever finds it there finds all of it."""
    beside = to.with_name(f".{to.name}.{os.getpid()}")
    try:
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(linked, beside)
        beside.chmod(0o755)
        beside.replace(to)
    except OSError as error:
        with contextlib.suppress(OSError):
            beside.unlink()
        raise BuildError(f"{to}: {error.strerror}") from None


def _link(command: list[str]) -> None:
    done = subprocess.run(  # noqa: S603 (a compiler of the system's)
        command, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise BuildError(f"{command[0]}: {done.stderr.strip()}")


def _c_compiler(target: Target) -> list[str] | None:
    if target.is_of_this_machine:
        for name in ("cc", "gcc", "clang"):
            if found := shutil.which(name):
                return [found]
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc", "-target", target.zig]
    return None
