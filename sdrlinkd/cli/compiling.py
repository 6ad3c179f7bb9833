"""Compiles the modem for a command that needs it, and shows the progress."""

from rich.console import Console

LIVE_S = 0.2


def compile_first(console: Console, engine: str = "auto") -> None:
    """Compile the modem if necessary, and show the progress. Raises UserError."""
    # This imports the modem, which is slow to load.
    import phy
    from sdrlinkd.compiling import EVERY_S, compile_modem
    from sdrlinkd.errors import UserError

    def say(line: str) -> None:
        console.print(line, highlight=False, markup=False, soft_wrap=True)

    try:
        if not console.is_terminal:
            compile_modem(say, EVERY_S, engine=engine)
            return
        with console.status("loading the modem") as status:
            compile_modem(say, LIVE_S, status.update, engine=engine)
    except phy.EngineError as error:
        raise UserError(str(error)) from None
