"""The command `top`: the link, live."""

import sys
from typing import Any

from sdrlinkd.cli.app import RuntimeDir, app
from sdrlinkd.cli.following import Follower
from sdrlinkd.errors import UserError


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
        TopApp(follower.look, ask, lambda: follower.waiting).run()
