"""`replay`: sends a recording back onto the air."""

import asyncio
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

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
    sending,
)
from sdrlinkd.cli.phy import RecordingFile, SampleType, open_recording, show_progress
from sdrlinkd.cli.stopping import stopped_by_signals
from sdrlinkd.errors import UserError

if TYPE_CHECKING:
    from sdrlinkd.iq import IqRecording, ReplayPlan, ReplayReport, ReplayState


@app.command()
def replay(
    file: RecordingFile,
    config: ConfigFile = None,
    device: Device = "",
    frequency: Frequency = None,
    rate: Rate = None,
    oversampling: Oversampling = Factor.ONE,
    gain: Gain = None,
    gains: Gains = "",
    antenna: Antenna = "",
    transmit: Annotated[
        bool, typer.Option("--transmit", help="Permit transmission, like soapy.tx_enabled = true.")
    ] = False,
    times: Annotated[
        int,
        typer.Option("--repeat", min=1, max=1_000_000, help="Send the recording this many times."),
    ] = 1,
    backoff: Annotated[
        float | None,
        typer.Option(
            "--backoff-db",
            min=0,
            max=100,
            help="Mean power of the strongest burst below full scale; default: as recorded.",
        ),
    ] = None,
    silence: Annotated[
        float | None,
        typer.Option(
            "--silence-db",
            min=-200,
            max=0,
            help="Level in dBFS below which nothing is sent; default: 7 dB above the quietest.",
        ),
    ] = None,
    type_name: SampleType = "",
) -> None:
    """Transmit a recording without a daemon, each burst at its recorded time."""
    from sdrlinkd.iq import plan_replay

    console = Console(soft_wrap=True)
    with open_recording(file, type_name, None) as recording:
        if config is None and rate is None:
            rate = recording.info.rate_hz
        radio = sending(
            NamedRadio(config, device, frequency, rate, oversampling, gain, gains, antenna),
            transmit,
        )
        _refuse_itself(file, radio)
        with show_progress(f"silence in {file.name}", recording) as progress:
            plan = plan_replay(recording, radio.config.modem.rate_hz, silence, backoff, progress)
        compile_first(Console(stderr=True))
        report = asyncio.run(_replay(radio, recording, plan, times))
    for line in _lines(report, plan):
        console.print(line, highlight=False, markup=False)
    if report.problem:
        raise UserError(f"ended early: {report.problem}")
    if report.sent < report.n_bursts:
        raise typer.Exit(1)


async def _replay(
    radio: OneRadio, recording: "IqRecording", plan: "ReplayPlan", times: int
) -> "ReplayReport":
    from backends import Tuning
    from sdrlinkd.iq import Replay
    from sdrlinkd.modem import make_radio

    modem = radio.config.modem
    made = make_radio(radio.config, radio.node_id, Random(radio.config.seed), plan.room_s)
    tuning = Tuning(modem.rate_hz, modem.centre_hz)
    told = TextColumn("{task.fields[told]}")
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}", markup=False), BarColumn(), told,
        console=console, transient=True, disable=not console.is_terminal,
    ) as progress:  # fmt: skip
        task = progress.add_task("opening the radio", total=None, told="")
        async with Replay(made, tuning, recording, plan, times) as sender:

            def watch(state: "ReplayState") -> None:
                progress.update(
                    task,
                    description="sending, Ctrl-C to stop",
                    total=sender.seconds,
                    completed=state.seconds,
                    told=f"{state.seconds:.1f} s  {state.n_sent} of {state.n_bursts} stretches",
                )

            with stopped_by_signals(sender.stop):
                return await sender.run(watch)


def _refuse_itself(file: Path, radio: OneRadio) -> None:
    from backends import BackendError, refuse_same

    into = radio.config.iqfile.transmit
    if radio.config.backend == "iqfile" and into:
        try:
            refuse_same(file, Path(into))
        except BackendError as error:
            raise UserError(str(error)) from None


def _lines(report: "ReplayReport", plan: "ReplayPlan") -> list[str]:
    silence = f"silence between them is below {plan.silence_dbfs:.1f} dBFS"
    lines = [f"sent {report.sent} of {report.n_bursts} stretches; {silence}"]
    kept = report.n_bursts - report.sent - report.late - report.underflow - report.lost
    if report.sent < report.n_bursts:
        lines.append(
            f"late {report.late}, underflow {report.underflow}, lost {report.lost}, never given to "
            f"the radio {kept}"
        )
    if report.slipped:
        lines.append(
            f"{report.slipped} were sent up to {1e3 * report.slip_s:.3f} ms off their recorded time"
        )
    return lines
