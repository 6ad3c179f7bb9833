"""`status`, `check`, `reload`: what a running daemon says of itself."""

import time
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.live import Live

from sdrlinkd.cli import render
from sdrlinkd.cli.app import AsJson, RuntimeDir, app, connect
from sdrlinkd.client import ControlClient
from sdrlinkd.reports import LinkReport, Snapshot

WATCH_PERIOD_S = 0.5


def ask_status(control: ControlClient) -> Snapshot:
    """The daemon's snapshot."""
    return msgspec.convert(control.ask("status"), Snapshot)


@app.command()
def status(
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
    watch: Annotated[bool, typer.Option("--watch", "-w", help="Keep the screen fresh.")] = False,
) -> None:
    """One screen: link, queue, topics, robots heard, drops by reason."""
    console = Console()
    with connect(runtime_dir) as control:
        snapshot = ask_status(control)
        if as_json:
            while True:
                typer.echo(msgspec.json.encode(snapshot).decode())
                if not watch:
                    return
                time.sleep(WATCH_PERIOD_S)
                snapshot = ask_status(control)
        if not watch:
            console.print(render.status(snapshot))
            return
        with Live(render.status(snapshot), console=console, auto_refresh=False) as live:
            while True:
                time.sleep(WATCH_PERIOD_S)
                live.update(render.status(ask_status(control)), refresh=True)


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
    """The three identities with their numbers."""
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
    """Have the daemon read its topic policies anew."""
    with connect(runtime_dir) as control:
        answer = control.ask("reload")
    typer.echo(f"reloaded: {answer['reloaded']}; {answer['unchanged']}")
