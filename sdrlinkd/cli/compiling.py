"""Compiles the modem before a command that needs it, and shows how far that is."""

from rich.console import Console

LIVE_S = 0.2


def compile_first(console: Console) -> None:
    """Compile the modem where that has not been done, and show how far it is."""
    # This brings the modem, which takes its time to load.
    from sdrlinkd.compiling import EVERY_S, compile_modem

    def say(line: str) -> None:
        console.print(line, highlight=False, markup=False, soft_wrap=True)

    if not console.is_terminal:
        compile_modem(say, EVERY_S)
        return
    with console.status("loading the modem") as status:
        compile_modem(say, LIVE_S, status.update)


if __name__ == "__main__":
    compile_first(Console())
