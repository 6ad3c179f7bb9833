"""GNU Radio's own interpreter, and its flowgraphs of etc/gnuradio."""

import contextlib
import functools
import subprocess
from pathlib import Path

from sdrlinkd.process import Process
from tests.machine import lacks

PYTHON = "/usr/bin/python3"
FLOWGRAPHS = Path(__file__).parents[2] / "etc" / "gnuradio"


@functools.cache
def no_gnu_radio():
    """Why flowgraphs cannot run here; "" if they can."""
    try:
        done = subprocess.run(
            [PYTHON, "-c", "import gnuradio.zeromq, gnuradio.digital"],
            capture_output=True,
            check=False,
        )
    except OSError:
        return lacks("gnuradio")
    return lacks("gnuradio") if done.returncode else ""


@contextlib.contextmanager
def flowgraph(name, *arguments):
    """Run etc/gnuradio/NAME.py."""
    with Process([PYTHON, FLOWGRAPHS / f"{name}.py", *arguments], name=name) as process:
        line = process.line()
        assert line == "ready", f"{name} says {line!r}"
        yield process
