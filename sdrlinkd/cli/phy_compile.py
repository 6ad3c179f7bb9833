"""`phy compile`: compiles the modem, for this machine or for another one."""

from pathlib import Path
from typing import Annotated

import typer

from sdrlinkd.cli.phy import phys
from sdrlinkd.errors import UserError
from sdrlinkd.tables import screen_console

HERE = "this"


@phys.command("compile")
def compile_(
    target: Annotated[
        str,
        typer.Option(
            "--for", help="this: this machine alone; x86-64, x86-64-v3, aarch64: any of a family."
        ),
    ] = HERE,
    to: Annotated[
        Path | None, typer.Option(help="File to write; default: where the daemon finds it.")
    ] = None,
) -> None:
    """Compile the modem into a library, which takes a minute; needs numba and a linker."""
    from phy import engine

    wanted = engine.this() if target == HERE else engine.TARGETS.get(target)
    if wanted is None:
        families = ", ".join((HERE, *(each.name for each in engine.FAMILIES)))
        raise UserError(f'--for: got "{target}"; allowed: one of {families}')
    path = to or engine.place(wanted)
    console = screen_console()
    if to is None and path.exists():
        console.print(f"{path} is up to date", highlight=False, markup=False, soft_wrap=True)
        return
    with console.status("compiling the modem") as status:
        try:
            engine.build(
                wanted, path,
                lambda done, total: status.update(f"compiling the modem: {done} of {total} steps"),
            )  # fmt: skip
        except (engine.BuildError, OSError) as error:
            raise UserError(f"the modem was not compiled: {error}") from None
    console.print(f"compiled the modem: {path}", highlight=False, markup=False, soft_wrap=True)
