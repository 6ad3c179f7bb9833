"""`status`, `check`, `reload`: query a running daemon, and have it reload."""

import sys
import time
from collections.abc import Callable
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.live import Live
from rich.text import Text

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import AsJson, RuntimeDir, Watch, app, connect
from sdrlinkd.cli.completion import field_names
from sdrlinkd.cli.fields import USUAL, CsvLines, as_text, fields_of
from sdrlinkd.cli.following import WATCH_PERIOD_S, Follower
from sdrlinkd.cli.screens import StatusScreen
from sdrlinkd.client import NoDaemonError
from sdrlinkd.errors import UserError
from sdrlinkd.reports import LinkReport, Snapshot
from sdrlinkd.tables import SCREEN, screen_console

EXIT_CODES = {"OK": 0, "DEGRADED": 1, "DOWN": 3}
NO_DAEMON = 4


@app.command()
def status(
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
    watch: Watch = False,
    everything: Annotated[
        bool,
        typer.Option("--all", "-a", help="Show everything, even what does not fit the screen."),
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing.")] = False,
    field: Annotated[
        list[str] | None,
        typer.Option(
            help="Print only this field, such as link.tx.sent or topics.odom.sent; repeatable.",
            autocompletion=field_names,
        ),
    ] = None,
    as_csv: Annotated[
        bool,
        typer.Option(
            "--csv", help="Print the fields as one CSV line, below a line of their names."
        ),
    ] = False,
) -> None:
    """Show the link's verdict and its reasons on one screen; the exit code is the verdict, too.

    0: OK; 1: DEGRADED; 3: DOWN; 4: no daemon answers.
    """
    if quiet and watch:
        raise UserError("--quiet: given with --watch; allowed: only one of them")
    if as_json and (as_csv or field):
        raise UserError("--json: given with --csv or --field; allowed: only one of them")
    show = _printer(as_json=as_json, as_csv=as_csv, names=field or [])
    if watch:
        _watch(Follower(runtime_dir), show, whole=everything)
    try:
        with connect(runtime_dir) as control:
            snapshot = ask_status(control)
    except NoDaemonError as error:
        if not quiet:
            sys.stderr.write(f"sdrlinkctl: {error}\n")
        raise typer.Exit(NO_DAEMON) from None
    if not quiet:
        if show is not None:
            show(snapshot)
        else:
            console = screen_console()
            # Leave a line for the shell's next prompt.
            console.print(StatusScreen(snapshot, None if everything else _height(console) - 1))
    raise typer.Exit(EXIT_CODES.get(snapshot.verdict.level, 1))


def _printer(*, as_json: bool, as_csv: bool, names: list[str]) -> Callable[[Snapshot], None] | None:
    """A function that prints a snapshot for programs; None if the output is for people."""

    def as_object(snapshot: Snapshot) -> None:
        typer.echo(msgspec.json.encode(snapshot).decode())

    def in_lines(snapshot: Snapshot) -> None:
        for value in fields_of(snapshot, names):
            typer.echo(as_text(value))

    if as_json:
        return as_object
    if as_csv:
        return CsvLines(names or USUAL)
    return in_lines if names else None


def _watch(follower: Follower, show: Callable[[Snapshot], None] | None, *, whole: bool) -> None:
    """Show snapshots repeatedly until Ctrl-C."""
    console = screen_console()
    with follower:
        if show is not None or not console.is_terminal:
            while True:
                snapshot = follower.look()
                if snapshot is not None and show is not None:
                    show(snapshot)
                elif snapshot is not None:
                    console.print(StatusScreen(snapshot, None if whole else _height(console)))
                    console.print()
                sys.stdout.flush()
                time.sleep(WATCH_PERIOD_S)
        with Live(console=console, screen=True, auto_refresh=False) as live:
            while True:
                snapshot = follower.look()
                # The terminal may have been resized.
                height = None if whole else _height(console)
                live.update(
                    Text(follower.waiting, style="bold yellow")
                    if snapshot is None
                    else StatusScreen(snapshot, height),
                    refresh=True,
                )
                time.sleep(WATCH_PERIOD_S)


def _height(console: Console) -> int:
    """Height of the terminal in lines; without a terminal, that of the smallest screen."""
    return console.height if console.is_terminal else SCREEN[1]


@app.command()
def check(runtime_dir: RuntimeDir = None, as_json: AsJson = False) -> None:
    """Verify the running daemon's ledger; exit code 1 when it does not add up."""
    with connect(runtime_dir) as control:
        answer = control.ask("check")
    if as_json:
        typer.echo(msgspec.json.encode(answer).decode())
    link = msgspec.convert(answer["ledger"], LinkReport)
    if not as_json:
        for line in ledger_lines(link):
            typer.echo(line)
        for problem in answer["problems"]:
            typer.echo(f"WRONG: {problem}", err=True)
        typer.echo("the ledger does not add up" if answer["problems"] else "the ledger adds up")
    if answer["problems"]:
        raise typer.Exit(1)


def ledger_lines(link: LinkReport) -> list[str]:
    """The ledger's three identities with their numbers, one per line."""
    tx, rx = link.tx, link.rx
    return [
        _identity("messages out", tx.accepted, {"sent": tx.sent, "queued": tx.queued,
                                                "in flight": tx.in_flight, **tx.dropped}),
        _identity("PDUs heard", rx.pdus_heard, {"used": rx.pdus_used, **rx.pdus_dropped}),
        _identity("messages in", rx.started,
                  {"delivered": rx.delivered, "held": rx.held, **rx.dropped}),
    ]  # fmt: skip


def _identity(name: str, entered: int, parts: dict[str, int]) -> str:
    listed = " + ".join(f"{count} {part}" for part, count in parts.items())
    return f"{name}: {entered} = {listed}"


@app.command()
def reload(runtime_dir: RuntimeDir = None) -> None:
    """Make the daemon re-read its topic policies."""
    with connect(runtime_dir) as control:
        answer = control.ask("reload")
    typer.echo(f"reloaded: {answer['reloaded']}; {answer['unchanged']}")
