"""`log` and `report`: a drive as one file, and as one page."""

import asyncio
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.live import Live

from sdrlinkd.cli.app import RuntimeDirs, app
from sdrlinkd.cli.listing import directories
from sdrlinkd.drive import DriveWriter, keep, read_drive
from sdrlinkd.errors import UserError, ungrouped
from sdrlinkd.extras import needs
from sdrlinkd.tables import screen_console

NO_DAEMON = (
    "log: no daemon of this host is running; start one, or name its directory with --runtime-dir"
)
PAGE = "report.html"


@app.command("log")
def log(
    folder: Annotated[Path, typer.Argument(help="Folder for drive.mcap.")],
    messages: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATTERN",
            help="Keep messages of these topics, too, such as '/rx_*/scan'; repeatable. Messages "
            "that say where robots are, are kept in any case.",
        ),
    ] = None,
    runtime_dir: RuntimeDirs = None,
) -> None:  # fmt: skip
    """Keep reports, events and messages of daemons in one file until Ctrl-C."""
    found = runtime_dir or directories()
    if not found:
        raise UserError(NO_DAEMON)
    writer = DriveWriter(folder)
    typer.echo(f"keeping {len(found)} daemons in {writer.path}; Ctrl-C ends it")
    try:
        with (
            ungrouped(),
            Live(console=screen_console(), auto_refresh=False, transient=True) as live,
        ):
            began_at = time.monotonic()

            def progress() -> None:
                lasted_s = time.monotonic() - began_at
                live.update(f"{lasted_s:.0f} s, {writer.n_bytes / 1e6:.1f} MB", refresh=True)

            asyncio.run(keep(found, writer, messages or [], progress))
    finally:
        writer.close()
        typer.echo(f"{writer.path}: {writer.n_bytes / 1e6:.1f} MB; sdrlinkctl report {folder}")


@app.command("report")
def report(
    drive: Annotated[Path, typer.Argument(help="A drive of `sdrlinkctl log`, or its folder.")],
    out: Annotated[
        Path | None, typer.Option(help="The page; default: report.html beside the drive.")
    ] = None,
    title: Annotated[str, typer.Option(help="Title of the page.")] = "",
) -> None:
    """Make one HTML page of a drive: map, delivery, latency, drops, events, what to change."""
    folder = drive if drive.is_dir() else drive.parent
    path = out or folder / PAGE
    write_page(drive, title or f"Drive {folder.resolve().name}", path)
    typer.echo(f"wrote {path}")


def write_page(drive: Path, title: str, path: Path | None = None) -> None:
    """Write the page of a drive, by default beside it. Raises UserError."""
    with needs("plots"):
        from sdrlinkd.drive import report_page
    found = read_drive(drive)
    path = path or found.path.parent / PAGE
    try:
        path.write_text(report_page(found, title))
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from None
