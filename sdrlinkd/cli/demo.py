"""`demo`: runs the paper's experiment on this machine."""

import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from sdrlinkd import __version__
from sdrlinkd.cli.app import app
from sdrlinkd.cli.compiling import compile_first
from sdrlinkd.cli.drive import PAGE, write_page
from sdrlinkd.cli.output import REPORT, load_pictures, make_folder, write_report
from sdrlinkd.cli.page_beside import page_beside
from sdrlinkd.demo import (
    NODE_ID,
    DemoReport,
    Options,
    RunResult,
    Source,
    Trace,
    find_rate,
    is_good,
    open_source,
    run_demo,
    table_6,
    topic_table,
    verdict,
)
from sdrlinkd.drive import DRIVE, RunDrive
from sdrlinkd.extras import lacking
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import screen_console
from sdrlinkd.wire import MAX_PDU_SIZE, MIN_PDU_SIZE


class LinkKind(StrEnum):
    """The PDU link: modem with loopback radio, modem with recording, or the direct link."""

    OFDM = "ofdm"
    IQFILE = "iqfile"
    DIRECT = "direct"


class EngineKind(StrEnum):
    """What computes the modem."""

    AUTO = "auto"
    COMPILED = "compiled"
    NUMPY = "numpy"


class ChannelKind(StrEnum):
    """The model of the simulated channel."""

    AWGN = "awgn"
    RAYLEIGH = "rayleigh"
    TDL_A = "tdl-a"
    TDL_C = "tdl-c"


PICTURES = ("latency_cdf.png", "path.png")


@app.command()
def demo(
    link: Annotated[
        list[LinkKind] | None,
        typer.Option(help="What carries the PDUs; repeatable. Default: all, one after another."),
    ] = None,
    bag: Annotated[
        Path | None, typer.Option(help="Recording to send; default: a built-in robot's drive.")
    ] = None,
    registry: Annotated[
        Path | None, typer.Option(help="Topic registry; default: the bag's own topics.")
    ] = None,
    topics: Annotated[
        list[str] | None, typer.Option("--topics", help="Send only this topic; repeatable.")
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            min=0.1, max=1e6, help="Seconds of it to send; default: all (built-in robot: 15)."
        ),
    ] = None,
    speed: Annotated[float, typer.Option(min=0.01, help="Playback speed; 1: as recorded.")] = 1.0,
    pdu_size: Annotated[
        int, typer.Option(min=MIN_PDU_SIZE, max=MAX_PDU_SIZE, help="PDU size in octets.")
    ] = 64,
    mcs: Annotated[
        int, typer.Option(min=0, max=9, help="Modulation and code rate; `phy info` lists them.")
    ] = 1,
    snr: Annotated[
        float, typer.Option(min=-30, help="Burst power over noise power in the band, in dB.")
    ] = 15.0,
    ppm: Annotated[
        float,
        typer.Option(
            "--cfo-ppm", min=-40, max=40, help="Crystal offset between sender and receiver, in ppm."
        ),
    ] = 10.0,
    channel: Annotated[
        ChannelKind, typer.Option(help="Simulated channel: noise only, or fading multipath.")
    ] = ChannelKind.AWGN,
    rate: Annotated[
        float | None,
        typer.Option(
            min=1e4,
            max=2e8,
            help="The modem's sample rate; default: what this machine sustains, up to 5e6.",
        ),
    ] = None,
    engine: Annotated[
        EngineKind, typer.Option(help="What computes the modem: compiled code, or NumPy.")
    ] = EngineKind.AUTO,
    record: Annotated[
        Path | None, typer.Option(help="Keep the SigMF recording of iqfile under this name.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Random seed.")] = 1,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Also write the report here.")
    ] = None,
    web: Annotated[
        bool, typer.Option("--web", help="Serve the page of the daemons while they run.")
    ] = False,
    out: Annotated[
        Path, typer.Option(help="Folder for report.json, the pictures and the drives.")
    ] = Path("build/demo"),
) -> None:
    """Send a robot's messages through daemons and radios; repeat the paper's measurements."""
    console = screen_console()
    no_pictures = lacking("plots")
    make_folder(out, [] if no_pictures else PICTURES)
    results: list[RunResult] = []
    traces: dict[str, Trace] = {}
    kinds = list(dict.fromkeys(link or list(LinkKind)))
    options = Options(
        link=kinds[0].value, pdu_size=pdu_size, speed=speed, seed=seed, mcs=mcs, snr_db=snr,
        clock_ppm=ppm, channel=channel.value, engine=engine.value,
        recording=record,
    )  # fmt: skip
    source = open_source(bag, registry, topics or [], duration, seed)
    for reason in source.left_out:
        _say(console, f"left out: {reason}", style="yellow")
    if kinds != [LinkKind.DIRECT]:
        compile_first(console, engine.value)
        rate = rate or _measure(console, source, options)
        options = replace(options, rate_hz=rate)
    with ExitStack() as stack:
        if web:
            _say(console, stack.enter_context(page_beside()))
        for kind in kinds:
            options = replace(options, link=kind.value)
            result, traces[kind.value] = _run(console, source, options, out / kind.value)
            results.append(result)
    source.recording.close()
    told = DemoReport(version=__version__, runs=results)
    for path in (out / REPORT, json_file):
        if path is not None:
            write_report(path, told)
    made = [REPORT, *(f"{kind.value}/{DRIVE}" for kind in kinds)]
    if not no_pictures:
        made = [REPORT, *PICTURES, *(f"{kind.value}/{PAGE}" for kind in kinds)]
        _draw(results, traces, out)
    for result in results if len(results) == 1 else ():
        console.print(topic_table(result))
    console.print(table_6(results))
    for result in results:
        _say(console, _summary(result))
    _say(console, f"wrote {out}/{', '.join(made)}")
    if results[0].damage:
        _say(console, f"warning: {results[0].damage}", style="yellow")
    for result in results:
        if text := verdict(result):
            _say(console, text, style="yellow" if is_good(result) else "bold red")
    if no_pictures:
        _say(console, no_pictures)
    if not all(map(is_good, results)):
        raise typer.Exit(1)


def _draw(results: list[RunResult], traces: dict[str, Trace], out: Path) -> None:
    """Draw the pictures of all links, and the page of each."""
    pictures = load_pictures("sdrlinkd.demo")
    caption = _caption(results[0])
    pictures.latency_cdf(traces, out / PICTURES[0], caption)
    pictures.paths(traces, out / PICTURES[1], caption)
    for link, result in zip(traces, results, strict=True):
        write_page(out / link, f"Demo over {link}: {result.source}")


def _measure(console: Console, source: Source, options: Options) -> float:
    """The sample rate in Hz that this machine sustains; prints a line with the reason."""
    with console.status("measuring what this machine sustains"):
        found = find_rate(source, options)
    tried = ", ".join(
        f"{100 * each.busy:.0f} % at {each.rate_hz / 1e6:g} Msps" for each in found.tried
    )
    rate = f"rate: {found.rate_hz / 1e6:g} Msps"
    _say(console, f"{rate}; load on one CPU core: {tried}")
    if not found.is_enough:
        told = "the modem needs almost a whole core, so messages will wait for it"
        _say(console, f"{told}; fewer at a time: --speed 0.25, or --topics", style="yellow")
    return found.rate_hz


def _run(
    console: Console, source: Source, options: Options, folder: Path
) -> tuple[RunResult, Trace]:
    """Run one link, and keep its drive in `folder`."""
    folder.mkdir(exist_ok=True)
    began, drive, receiver = time.monotonic(), RunDrive(folder, time.time_ns()), NODE_ID

    def see(snapshot: Snapshot) -> None:
        nonlocal receiver
        receiver = snapshot.node
        drive.see([snapshot], time.monotonic() - began)

    with closing(drive):
        result, trace = _in_sight(console, source, options, see)
        drive.passed(NODE_ID, receiver, trace, began)
    return result, trace


def _in_sight(
    console: Console, source: Source, options: Options, see: Callable[[Snapshot], None]
) -> tuple[RunResult, Trace]:
    """Run one link with its progress on the screen."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("sent {task.completed:.0f}, received {task.fields[received]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(
            f"{options.link}: {source.title}", total=source.expected(), received=0
        )
        return run_demo(
            source,
            options,
            lambda sent, received: progress.update(task, completed=sent, received=received),
            see,
        )


def _summary(result: RunResult) -> str:
    identical = "yes" if result.bytes_identical else "NO" if result.received else "none came"
    text = (
        f"{result.name}: bytes identical: {identical}; "
        f"ledger adds up: {'yes' if result.ledger_adds_up else 'NO'}; "
        f"{result.entries_per_message:.1f} entries a message; "
        f"dropped: {result.dropped or 'nothing'}"
    )
    if result.phy is not None:
        heard = result.phy
        text += (
            f"; {heard.pdus_good} of {result.pdus_sent} PDUs good in {heard.bursts} bursts, "
            f"{heard.pdus_bad} bad"
        )
        if heard.samples_lost:
            text += f"; {heard.samples_lost} samples lost"
    return text


def _caption(result: RunResult) -> str:
    text = f"sdrlinkctl demo, {result.source}, PDUs of {result.pdu_size} B, seed {result.seed}"
    if result.phy is not None:
        heard = result.phy
        text += (
            f"; {heard.mcs} at {heard.rate_hz / 1e6:g} Msps, {heard.channel} {heard.snr_db:g} dB, "
            f"{heard.clock_ppm:g} ppm"
        )
    return text


def _say(console: Console, text: str, style: str | None = None) -> None:
    console.print(text, style=style, highlight=False, markup=False, soft_wrap=True)
