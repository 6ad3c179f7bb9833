"""Compiles the driver, once per version of its source."""

import functools
import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.machine import lacks

HERE = Path(__file__).parent
COMPILE = ["g++", "-std=c++17", "-O2", "-Wall", "-Wextra", "-fPIC"]
# Only for loops over samples: elsewhere NaN and infinity are significant.
FAST = ["-O3", "-march=native", "-ffast-math"]


class BuildError(Exception):
    """The driver does not compile here; the message is the compiler's."""


@functools.cache
def missing() -> str:
    """Why the driver cannot be compiled here, in the form of tests.machine; "" if it can."""
    if shutil.which("g++") is None:
        return lacks("g++", "libsoapysdr-dev")
    header = "#include <SoapySDR/Device.hpp>"
    probe = subprocess.run(
        ["g++", "-fsyntax-only", "-x", "c++", "-"],
        input=header,
        capture_output=True,
        text=True,
        check=False,
    )
    return lacks("libsoapysdr-dev") if probe.returncode else ""


def module_folder() -> Path:
    """Folder of the module for this version of the source; compiles it if necessary."""
    digest = hashlib.sha256(platform.node().encode())
    for source in sorted([*HERE.glob("*.cpp"), *HERE.glob("*.h"), HERE / "build.py"]):
        digest.update(source.read_bytes())
    name = f"soapy-loopback-{os.getuid()}-{digest.hexdigest()[:16]}"
    return build(Path(tempfile.gettempdir()) / name)


def build(folder: Path) -> Path:
    """Put the module into `folder`, unless it is there. Raises BuildError."""
    module = folder / "libloopbackSupport.so"
    if module.exists():
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work, ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(lambda source: _compile(source, Path(work)), HERE.glob("*.cpp")))
        linked = Path(work) / module.name
        _run(["g++", "-shared", *map(str, objects), "-lSoapySDR", "-o", str(linked)])
        # Another session may build the same: the last one wins, with the same result.
        part = folder / f".{os.getpid()}"
        part.write_bytes(linked.read_bytes())
        part.replace(module)
    return folder


def _compile(source: Path, work: Path) -> Path:
    target = work / f"{source.stem}.o"
    fast = FAST if source.stem == "dsp" else []
    _run([*COMPILE, *fast, "-c", str(source), "-o", str(target)])
    return target


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildError(done.stderr)
