"""Compiles the modem for a command that needs it, and shows the progress."""

from rich.console import Console

LIVE_S = 0.2


def compile_first(console: Console) -> None:
    """Compile the modem if necessary, and show the progress."""
    # This imports the modem, which is slow to load.
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
