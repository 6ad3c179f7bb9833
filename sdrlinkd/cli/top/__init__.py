"""The command `top`: the link, live."""

import asyncio
import signal
import sys
from typing import TYPE_CHECKING, Any

from sdrlinkd.cli.app import RuntimeDir, app
from sdrlinkd.cli.following import Follower
from sdrlinkd.cli.stopping import stopped_by_signals
from sdrlinkd.errors import UserError

if TYPE_CHECKING:
    from sdrlinkd.cli.top.live import TopApp


@app.command()
def top(runtime_dir: RuntimeDir = None) -> None:
    """Live view: verdict, neighbors, topics, the last minutes; explains and sets policies."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise UserError("top: needs a terminal; `sdrlinkctl status --watch` also writes to a file")
    # The screen's library takes a while to load.
    from sdrlinkd.cli.top.live import TopApp

    def ask(verb: str, arguments: dict[str, Any]) -> Any:  # noqa: ANN401
        with Follower(runtime_dir) as once:
            return once.ask(verb, arguments)

    with Follower(runtime_dir) as follower:
        screen = TopApp(follower.look, ask, lambda: follower.waiting)
        asyncio.run(_show(screen))
    if screen.return_code:
        sys.exit(screen.return_code)


async def _show(screen: "TopApp") -> None:
    """Show the screen until somebody leaves it or ends the program.

    A signal is the loop's: an exception of its handler would be lost in a callback of the screen.
    """
    with stopped_by_signals(lambda: screen.exit(return_code=128 + signal.SIGTERM)):
        await screen.run_async()
