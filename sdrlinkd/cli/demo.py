"""`demo`: the paper's experiment on this machine, in one command."""

from enum import StrEnum
from pathlib import Path
from types import ModuleType
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from sdrlinkd import __version__
from sdrlinkd.cli.app import app
from sdrlinkd.demo import DemoReport, Options, open_source, run_demo, table_6, topic_table
from sdrlinkd.errors import UserError
from sdrlinkd.wire import MAX_PDU_SIZE, MIN_PDU_SIZE


class LinkKind(StrEnum):
    """What carries the PDUs."""

    DIRECT = "direct"


@app.command()
def demo(
    link: Annotated[LinkKind, typer.Option(help="What carries the PDUs.")] = LinkKind.DIRECT,
    bag: Annotated[
        Path | None, typer.Option(help="Send this recording; by default a built-in robot drives.")
    ] = None,
    registry: Annotated[
        Path | None, typer.Option(help="Topic registry; by default the bag's own topics.")
    ] = None,
    topics: Annotated[
        list[str] | None, typer.Option("--topics", help="Only this topic; may be repeated.")
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(min=0.1, max=1e6, help="Seconds of it; by default all (built-in: 15)."),
    ] = None,
    speed: Annotated[float, typer.Option(min=0.01, help="Times as fast as recorded.")] = 1.0,
    pdu_size: Annotated[
        int, typer.Option(min=MIN_PDU_SIZE, max=MAX_PDU_SIZE, help="Octets of a PDU.")
    ] = 64,
    seed: Annotated[int, typer.Option(help="Of all chance.")] = 1,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Also write the report here.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for report.json and the pictures.")] = Path(
        "build/demo"
    ),
) -> None:
    """Send a robot's messages through a daemon and back; measure what the paper measured."""
    console = Console()
    pictures = _load_pictures()
    _make_folder(out)
    source = open_source(bag, registry, topics or [], duration, seed)
    for reason in source.left_out:
        console.print(f"left out: {reason}", style="yellow", highlight=False, markup=False)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("sent {task.completed:.0f}, received {task.fields[received]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(
            f"{link.value}: {source.title}", total=source.expected(), received=0
        )
        result, trace = run_demo(
            source,
            Options(link.value, pdu_size, speed, seed),
            lambda sent, received: progress.update(task, completed=sent, received=received),
        )
    source.recording.close()
    report = DemoReport(version=__version__, runs=[result])
    _write(out, json_file, report)
    caption = (
        f"sdrlinkctl demo --link {link.value}, {source.title}, PDUs of {pdu_size} B, seed {seed}"
    )
    pictures.latency_cdf({result.name: trace}, out / "latency_cdf.png", caption)
    pictures.paths(trace, out / "path.png", caption)
    console.print(topic_table(result))
    console.print(table_6([result]))
    console.print(
        f"bytes identical: {'yes' if result.bytes_identical else 'NO'}; "
        f"ledger adds up: {'yes' if result.ledger_adds_up else 'NO'}; "
        f"{result.entries_per_message:.1f} entries a message; "
        f"dropped: {result.dropped or 'nothing'}",
        highlight=False,
        markup=False,
        soft_wrap=True,
    )
    console.print(
        f"wrote {out}/report.json, latency_cdf.png, path.png", highlight=False, markup=False
    )
    if result.damage:
        console.print(f"warning: {result.damage}", style="yellow", highlight=False, markup=False)


def _load_pictures() -> ModuleType:
    """Matplotlib is an extra, and slow to load: only here, and before a run rather than after."""
    try:
        from sdrlinkd.demo import pictures
    except ImportError:
        raise UserError(
            "the pictures need matplotlib; install it with: pip install 'sdrlinkd[plots]'"
        ) from None
    return pictures


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in ("report.json", "latency_cdf.png", "path.png"):
            (out / name).open("ab").close()
    except OSError as error:
        raise UserError(f"{error.filename} cannot be written ({error.strerror})") from None


def _write(out: Path, json_file: Path | None, report: DemoReport) -> None:
    text = msgspec.json.format(msgspec.json.encode(report), indent=2)
    for path in (out / "report.json", json_file):
        if path is not None:
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(text + b"\n")
            except OSError as error:
                raise UserError(f"{path} cannot be written ({error.strerror})") from None
