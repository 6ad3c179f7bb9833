"""`phy`: shows the modem's tables, and analyzes a recording of samples. Needs no daemon."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from sdrlinkd.cli.app import AsJson, app
from sdrlinkd.cli.output import load_pictures
from sdrlinkd.cli.pdu import one_line
from sdrlinkd.config import load_registry
from sdrlinkd.errors import UserError
from sdrlinkd.tables import FittedTable, figure, screen_console, words
from sdrlinkd.wire import MAX_PDU_SIZE, MIN_PDU_SIZE

if TYPE_CHECKING:
    import phy
    from sdrlinkd.iq import IqRecording, ModemInfo
    from sdrlinkd.iq.recording import Progress as OnProgress

phys = typer.Typer(help="The modem, and recordings of samples.", no_args_is_help=True)
app.add_typer(phys, name="phy")

RecordingFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="SigMF recording, or raw samples (.cf32, .i16, …).")
]
SampleType = Annotated[
    str, typer.Option("--type", help="Sample type of a raw file: cf32_le, ci16_le, ci8 or cu8.")
]
Rate = Annotated[
    float | None, typer.Option(min=1, help="Sample rate, if the file does not state it.")
]
Network = Annotated[int, typer.Option(min=-1, max=7, help="Only bursts of this network; -1: all.")]
Grid = Annotated[
    str,
    typer.Option(help="FFT size/cyclic prefix: 64/16, 64/8, 128/16 or 256/32, as in modem.grid."),
]
Out = Annotated[
    Path | None, typer.Option(help="PNG to write; default: named like FILE, in the current folder.")
]


@phys.command()
def info(
    rate: Annotated[float, typer.Option(min=1e4, max=2e8, help="Sample rate.")] = 5e6,
    pdu_size: Annotated[
        int, typer.Option(min=MIN_PDU_SIZE, max=MAX_PDU_SIZE, help="PDU size in octets.")
    ] = 1024,
    max_burst: Annotated[float, typer.Option(min=1e-6, max=1, help="Longest burst in s.")] = 0.005,
    grid: Grid = "64/16",
    frequency: Annotated[
        float, typer.Option(min=1, max=1e11, help="Centre frequency in Hz.")
    ] = 2.45e9,
    crystal_ppm: Annotated[
        float, typer.Option(min=0, max=200, help="Largest crystal error of any radio.")
    ] = 40.0,
    json: AsJson = False,
) -> None:
    """Show subcarriers, and the rates and airtimes of every MCS."""
    from sdrlinkd.iq import modem_info

    told = modem_info(rate, pdu_size, max_burst, grid_named(grid), frequency, crystal_ppm)
    if json:
        typer.echo(msgspec.json.encode(told))
        return
    console = screen_console()
    console.print(
        f"{told.rate_hz / 1e6:g} Msps: {told.n_fft} subcarriers "
        f"{told.spacing_hz / 1e3:g} kHz apart, "
        f"{told.n_data} for data, {told.n_pilots} pilots, {told.occupied_hz / 1e6:.3g} MHz wide\n"
        f"symbols of {told.symbol_us:g} µs, of these {told.echoes_us:g} µs for echoes; "
        f"preamble and header {told.preamble_us:g} µs per burst\n{told.cfo}",
        highlight=False,
        soft_wrap=True,
    )
    console.print(table_of(told))
    console.print(
        "SNR dB: 1 % of these PDUs are lost in noise; rate control adds a margin", highlight=False
    )


def table_of(told: "ModemInfo") -> FittedTable:
    """The table of `phy info`, with a row per MCS."""
    table = FittedTable(
        f"PDUs of {told.pdu_size} B, bursts up to {told.max_burst_s * 1e3:g} ms",
        (
            figure("MCS"), words("modulation"), figure("SNR dB"), figure("Mbit/s"), figure("1 PDU"),
            figure("PDUs a burst", 2), figure("burst", 1), figure("goodput Mbit/s"),
        ),
    )  # fmt: skip
    for row in told.mcs:
        table.add(
            str(row.mcs),
            row.name,
            f"{row.snr_db:.1f}",
            f"{row.rate_bit_s / 1e6:.3g}",
            f"{row.one_pdu_ms:.3g} ms",
            str(row.burst_pdus),
            f"{row.burst_ms:.3g} ms",
            f"{row.burst_goodput_bit_s / 1e6:.3g}",
        )
    return table


@phys.command()
def decode(
    file: RecordingFile,
    type_name: SampleType = "",
    rate: Rate = None,
    network: Network = -1,
    grid: Grid = "64/16",
    registry: Annotated[
        Path | None, typer.Option(help="Topic registry that names the topics.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object a line.")] = False,
) -> None:
    """Show the bursts in a recording, their signal quality and their PDUs."""
    names = load_registry(registry) if registry else None
    console = Console(soft_wrap=True)
    counters: dict[str, int] = {}
    with (
        open_recording(file, type_name, rate) as recording,
        show_progress(f"decode {file.name}", recording) as progress,
    ):
        pdus: list[tuple[int, bytes]] = []
        for event, receiver in recording.decode(
            None if network < 0 else network, progress, grid_named(grid)
        ):
            counters = dict(receiver.counters)
            ending = getattr(event, "ending", None)
            if ending is None:
                pdus.append((event.number, event.data))  # type: ignore[union-attr]
                continue
            if json:
                _json_lines(event.burst, ending, pdus, recording.info.rate_hz)
            else:
                told = _burst_line(event.burst, len(pdus), ending, recording.info.rate_hz)
                lines = [f"  {number}  {one_line(data, names)}" for number, data in pdus]
                console.print("\n".join([told, *lines]), highlight=False, markup=False)
            pdus = []
    if not json:
        _print_counters(console, counters, recording)


@phys.command()
def spectrum(
    file: RecordingFile, type_name: SampleType = "", rate: Rate = None, out: Out = None
) -> None:
    """Plot power over frequency and time."""
    from sdrlinkd.iq import spectrum_of

    pictures = load_pictures("sdrlinkd.iq")
    console = Console()
    with (
        open_recording(file, type_name, rate) as recording,
        show_progress(f"spectrum of {file.name}", recording) as progress,
    ):
        measured = spectrum_of(recording, progress)
    path = out or _picture_of(file, "spectrum")
    pictures.draw_spectrum(measured, recording.info.rate_hz, file.name, path)
    console.print(
        f"wrote {path}; {_rate_told(recording.info.rate_hz, rate)}",
        highlight=False, markup=False, soft_wrap=True,
    )  # fmt: skip


@phys.command()
def constellation(
    file: RecordingFile,
    type_name: SampleType = "",
    rate: Rate = None,
    network: Network = -1,
    grid: Grid = "64/16",
    out: Out = None,
) -> None:
    """Plot the equalized constellation of the bursts in a recording."""
    pictures = load_pictures("sdrlinkd.iq")
    console = Console()
    with (
        open_recording(file, type_name, rate) as recording,
        show_progress(f"points in {file.name}", recording) as progress,
    ):
        points = recording.points(None if network < 0 else network, progress, grid_named(grid))
    if not points.by_modulation:
        raise UserError(
            f"{file}: no burst was found in {recording.info.n_samples} samples; "
            "`sdrlinkctl phy spectrum` plots the signal"
        )
    path = out or _picture_of(file, "constellation")
    title = f"{file.name}, {len(points.bursts)} bursts"
    pictures.draw_constellation(points, title, path)
    console.print(f"wrote {path}", highlight=False, markup=False, soft_wrap=True)


def grid_named(name: str) -> "phy.Numerology":
    """The grid that --grid names. Raises UserError."""
    import phy

    if name not in phy.GRIDS:
        raise UserError(f"--grid: got {name}; allowed: one of {', '.join(phy.GRIDS)}")
    return phy.GRIDS[name]


def open_recording(file: Path, type_name: str, rate: float | None) -> "IqRecording":
    """Open a recording; prints a warning if it is damaged."""
    from sdrlinkd.iq import IqRecording

    recording = IqRecording(file, type_name, rate)
    if recording.info.damage:
        Console(stderr=True).print(
            f"warning: {recording.info.damage}", style="yellow", highlight=False, markup=False,
            soft_wrap=True,
        )  # fmt: skip
    return recording


@contextmanager
def show_progress(what: str, recording: "IqRecording") -> Iterator["OnProgress"]:
    """Show a progress bar while a recording is read; yields a function of the samples read."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    hidden = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as progress:
        task = progress.add_task(what, total=recording.info.n_samples)
        yield lambda done: progress.update(task, completed=done)


def _burst_line(burst: "phy.BurstQuality", n_good: int, ending: str, rate_hz: float | None) -> str:
    import phy

    at = f"{burst.start / rate_hz:.6f} s" if rate_hz else f"sample {burst.start}"
    offset = (
        f"{burst.cfo * rate_hz / 1e3:+.3f} kHz" if rate_hz else f"{burst.cfo:+.6f} cycles/sample"
    )
    return (
        f"{at}  {phy.MCS_TABLE[burst.mcs].name}  {n_good} of {burst.n_pdus} PDUs of "
        f"{burst.pdu_bytes} B good  SNR {burst.snr_db:.1f} dB  EVM {burst.evm_db:.1f} dB  "
        f"CFO {offset}  {burst.rssi_dbfs:.1f} dBFS  network {burst.network}"
        + ("" if ending == "whole" else f"  ({ending})")
    )


def _json_lines(
    burst: "phy.BurstQuality",
    ending: str,
    pdus: list[tuple[int, bytes]],
    rate_hz: float | None,
) -> None:
    told = {
        **burst._asdict(),
        "start_s": burst.start / rate_hz if rate_hz else None,
        "cfo_hz": burst.cfo * rate_hz if rate_hz else None,
        "ending": ending,
        "pdus": [{"number": number, "hex": data.hex()} for number, data in pdus],
    }
    typer.echo(msgspec.json.encode(told))


def _print_counters(console: Console, counters: dict[str, int], recording: "IqRecording") -> None:
    if not counters:
        console.print(
            f"no burst in {recording.info.n_samples} samples", highlight=False, markup=False
        )
        return
    console.print(
        ", ".join(f"{name} {counters[name]}" for name in counters if counters[name]),
        highlight=False,
        markup=False,
    )


def _picture_of(file: Path, what: str) -> Path:
    """The default path of a picture, in the current folder and not beside the recording."""
    stem = file.name.removesuffix(".sigmf-meta").removesuffix(".sigmf-data")
    return Path(f"{stem}.{what}.png")


def _rate_told(rate_hz: float | None, asked: float | None) -> str:
    if rate_hz is None:
        return (
            "sample rate unknown: frequencies are in cycles per sample, times in samples; set it "
            "with --rate"
        )
    return f"at {rate_hz / 1e6:g} Msps, {'as given' if asked else 'from its metadata'}"
