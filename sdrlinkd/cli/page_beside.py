"""The page of `web`, beside a run."""

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from sdrlinkd.errors import UserError
from sdrlinkd.process import Process, ProcessError, module


@contextlib.contextmanager
def page_beside(directories: Iterable[Path] = ()) -> Iterator[str]:
    """Serve the page of the daemons in `directories`, or of all of this host; yields its line.

    Raises UserError.
    """
    chosen = [word for each in directories for word in ("--runtime-dir", str(each))]
    command = module("sdrlinkd.cli", "web", "--control", "--listen", "127.0.0.1:0", *chosen)
    with Process(command, name="sdrlinkctl web") as page:
        try:
            line = page.line()
        except ProcessError:
            raise UserError(page.err().strip() or "the page does not start") from None
        yield line
