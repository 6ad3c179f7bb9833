"""`phy compile`: compiles the modem, for this machine or for another one."""

from pathlib import Path
from typing import Annotated

import typer

from sdrlinkd.cli.compiling import show_progress
from sdrlinkd.cli.completion import one_of
from sdrlinkd.cli.phy import phys
from sdrlinkd.errors import UserError
from sdrlinkd.tables import screen_console

HERE = "this"
FAMILIES = ("x86-64", "x86-64-v3", "aarch64")


@phys.command("compile")
def compile_(
    target: Annotated[
        str,
        typer.Option(
            "--for",
            help=f"this: this machine alone; {', '.join(FAMILIES)}: any processor of the family.",
            autocompletion=one_of(HERE, *FAMILIES),
        ),
    ] = HERE,
    to: Annotated[
        Path | None, typer.Option(help="File to write; default: where the daemon finds it.")
    ] = None,
) -> None:
    """Compile the modem into a library, which takes a minute; needs numba and a C compiler."""
    # This imports NumPy, which is slow to load.
    from phy import engine

    if target not in (HERE, *FAMILIES):
        raise UserError(f'--for: got "{target}"; allowed: one of {HERE}, {", ".join(FAMILIES)}')
    wanted = engine.this() if target == HERE else engine.TARGETS[target]
    console = screen_console()
    try:
        path = to or engine.place(wanted)
        if to is not None or not path.exists():
            show_progress(console, lambda progress: engine.build(wanted, path, progress))
    except (engine.BuildError, OSError) as error:
        raise UserError(f"the modem was not compiled: {error}") from None
    console.print(f"the compiled modem: {path}", highlight=False, markup=False, soft_wrap=True)
