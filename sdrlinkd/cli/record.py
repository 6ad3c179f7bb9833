"""`record`: captures a radio's samples as a SigMF recording with annotated bursts."""

import asyncio
from enum import StrEnum
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table

from sdrlinkd.cli.app import app
from sdrlinkd.cli.compiling import compile_first
from sdrlinkd.cli.one_radio import (
    Antenna,
    ConfigFile,
    Device,
    Factor,
    Frequency,
    Gain,
    Gains,
    NamedRadio,
    OneRadio,
    Oversampling,
    Rate,
    receiving,
)
from sdrlinkd.cli.phy import Network, grid_named
from sdrlinkd.cli.stopping import stopped_by_signals
from sdrlinkd.errors import UserError

if TYPE_CHECKING:
    from sdrlinkd.iq import CaptureReport, CaptureState, CaptureWish


class Written(StrEnum):
    """Sample types in which a recording can be written."""

    CI16 = "ci16_le"
    CF32 = "cf32_le"
    CI8 = "ci8"


@app.command()
def record(
    out: Annotated[Path, typer.Argument(help="Name for OUT.sigmf-data and OUT.sigmf-meta.")],
    config: ConfigFile = None,
    device: Device = "",
    frequency: Frequency = None,
    rate: Rate = None,
    oversampling: Oversampling = Factor.ONE,
    gain: Gain = None,
    gains: Gains = "",
    antenna: Antenna = "",
    duration: Annotated[
        float | None,
        typer.Option(
            "--seconds", min=1e-3, max=1e6, help="Seconds to record; default: until Ctrl-C."
        ),
    ] = None,
    type_name: Annotated[
        Written, typer.Option("--type", help="Sample type of the recording.")
    ] = Written.CI16,
    network: Network = -1,
    grid: Annotated[
        str,
        typer.Option(
            help="FFT size/cyclic prefix of the bursts; default: that of --config, else 64/16."
        ),
    ] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace an existing recording.")] = False,
) -> None:
    """Record what a radio hears, without a daemon; never transmits."""
    from backends import BackendError, refuse_same
    from sdrlinkd.iq import CaptureWish

    stem = _refuse_existing(out, force)
    radio = receiving(
        NamedRadio(config, device, frequency, rate, oversampling, gain, gains, antenna)
    )
    played = radio.config.iqfile.receive
    if radio.config.backend == "iqfile" and played:
        try:
            refuse_same(Path(played), out)
        except BackendError as error:
            raise UserError(str(error)) from None
    wish = CaptureWish(
        out,
        type_name.value,
        duration,
        None if network < 0 else network,
        grid_named(grid or radio.config.modem.grid),
    )
    compile_first(Console(stderr=True))
    report = asyncio.run(_capture(radio, wish))
    gain_key = "--gain or --gains" if config is None else "soapy.rx_gain_db or soapy.rx_gains"
    console = Console(soft_wrap=True)
    console.print(f"recorded {stem}.sigmf-data, {stem}.sigmf-meta", highlight=False, markup=False)
    console.print(_table(report, radio, wish, Path(f"{stem}.sigmf-data"), gain_key))
    if report.problem:
        raise UserError(f"ended early: {report.problem}")


async def _capture(radio: OneRadio, wish: "CaptureWish") -> "CaptureReport":
    from backends import Tuning
    from sdrlinkd.iq import Capture
    from sdrlinkd.modem import make_radio

    modem = radio.config.modem
    made = make_radio(radio.config, radio.node_id, Random(radio.config.seed), modem.max_burst_s)
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.fields[told]}"),
    )
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as progress:
        task = progress.add_task("opening the radio", total=None, told="")

        def watch(state: "CaptureState") -> None:
            told = (
                f"{state.recorded_s:.1f} s  {state.level_dbfs:.1f} dBFS  {state.n_bursts} bursts"
                + (f"  {state.n_gaps} gaps" if state.n_gaps else "")
            )
            if state.is_recorded:
                progress.update(
                    task, description="finding bursts, Ctrl-C to skip", total=state.recorded_s,
                    completed=state.searched_s, told=told,
                )  # fmt: skip
            else:
                progress.update(
                    task, description="recording, Ctrl-C to end", total=wish.seconds,
                    completed=state.recorded_s, told=told,
                )  # fmt: skip

        async with Capture(made, Tuning(modem.rate_hz, modem.centre_hz), wish) as capture:
            with stopped_by_signals(capture.stop):
                return await capture.run(watch)


def _refuse_existing(out: Path, force: bool) -> str:
    """The recording's name without suffix. Raises UserError if files would be replaced."""
    stem = str(out).removesuffix(".sigmf-meta").removesuffix(".sigmf-data")
    for path in (Path(f"{stem}.sigmf-data"), Path(f"{stem}.sigmf-meta")):
        if path.exists() and not force:
            raise UserError(f"{path}: already there; allowed: another name, or --force")
    return stem


def _table(
    report: "CaptureReport", radio: OneRadio, wish: "CaptureWish", data: Path, gain_key: str
) -> Table:
    rate_hz = radio.config.modem.rate_hz
    table = Table(box=None, show_header=False, pad_edge=True)
    table.add_row(
        "length",
        f"{report.seconds:.3f} s, {report.n_samples} samples of {wish.type_name} at "
        f"{rate_hz / 1e6:g} Msps, {data.stat().st_size / 1e6:.1f} MB",
    )
    bursts = f"{report.n_bursts}, {report.pdus_good} PDUs good, {report.pdus_bad} bad"
    if report.searched_s < report.seconds:
        bursts += f", in the first {report.searched_s:.1f} s; the rest was not searched"
    table.add_row("bursts", bursts)
    lost_ms = 1e3 * report.samples_lost / rate_hz
    table.add_row(
        "gaps",
        f"{report.n_gaps}, {report.samples_lost} samples ({lost_ms:.1f} ms) missing: annotated "
        "and zero-filled"
        if report.n_gaps
        else "none",
    )
    table.add_row("level", f"mean {report.mean_dbfs:.1f} dBFS, peak {report.peak_dbfs:.1f} dBFS")
    share = 50 * report.n_full / max(1, report.n_samples - report.samples_lost)
    table.add_row(
        "clipping",
        f"{report.n_full} values at full scale ({share:.2g} %): lower {gain_key}"
        if report.n_full
        else "none",
    )
    return table
