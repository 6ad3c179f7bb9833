"""Compiles the modem for a command that needs it, and shows the progress."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from rich.console import Console

if TYPE_CHECKING:
    from sdrlinkd.compiling import Progress

LIVE_S = 0.2

_Made = TypeVar("_Made")


def compile_first(console: Console, engine: str = "auto") -> None:
    """Compile the modem if necessary, and show the progress. Raises UserError."""
    # This imports the modem, which is slow to load.
    import phy
    from sdrlinkd.compiling import compile_modem
    from sdrlinkd.errors import UserError

    try:
        _shown(console, partial(compile_modem, engine=engine))
    except phy.EngineError as error:
        raise UserError(str(error)) from None


def show_progress(console: Console, work: "Callable[[Progress], None]") -> None:
    """Do `work(progress)`, which compiles the modem, and show the progress."""
    from sdrlinkd.compiling import tell_progress

    _shown(console, partial(tell_progress, work))


def _shown(console: Console, work: Callable[..., _Made]) -> _Made:
    """Do `work(say, every_s, passing)`: lines now and then, or one line that changes."""
    from sdrlinkd.compiling import EVERY_S

    def say(line: str) -> None:
        console.print(line, highlight=False, markup=False, soft_wrap=True)

    if not console.is_terminal:
        return work(say, EVERY_S, None)
    with console.status("loading the modem") as status:
        return work(say, LIVE_S, status.update)
