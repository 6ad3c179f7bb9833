"""`radio`: lists the attached radios, and how a daemon would drive them. Needs no daemon."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer
from rich.console import Console

from sdrlinkd.cli.app import AsJson, app
from sdrlinkd.errors import UserError
from sdrlinkd.tables import FittedTable, screen_console, words

if TYPE_CHECKING:
    from backends import Assessment, DeviceProbe, DirectionProbe

radios = typer.Typer(help="Radios of this machine, through SoapySDR.", no_args_is_help=True)
app.add_typer(radios, name="radio")


@radios.command()
def probe(
    device: Annotated[
        str, typer.Argument(help='Value of soapy.device, such as "driver=hackrf"; default: all.')
    ] = "",
    rate: Annotated[
        float, typer.Option(min=1e4, max=2e8, help="The modem's sample rate (modem.rate_hz).")
    ] = 1e6,
    json: AsJson = False,
) -> None:
    """List the attached radios and how the daemon would drive them; nothing is transmitted."""
    from backends import BackendError, assess_device, probe_devices

    console = screen_console()
    try:
        with Console(stderr=True).status("probing radios"):
            found = probe_devices(device)
    except BackendError as error:
        raise UserError(str(error)) from None
    if json:
        typer.echo(msgspec.json.encode(found))
        return
    if found.binding:
        console.print(f"{found.binding}; {found.drivers}", highlight=False, soft_wrap=True)
    for each in found.devices:
        console.print(table_of(each, assess_device(each, rate), rate))
    for note in found.notes:
        console.print(note, highlight=False, soft_wrap=True)
    if not found.devices or all(each.problem for each in found.devices):
        raise typer.Exit(2)


def table_of(device: "DeviceProbe", ahead: "Assessment", rate_hz: float) -> FittedTable:
    """The table of a radio: identity, capabilities, and how a daemon would drive it."""
    table = FittedTable(
        device.label or device.device, (words("", least=20), words("")), heads=False
    )
    table.add("soapy.device", f'"{device.device}"')
    if device.problem:
        table.add("unusable", device.problem)
        return table
    table.add("radio", f"{device.driver} {device.hardware}")
    for does, direction in (("receives", device.rx), ("sends", device.tx)):
        table.add(does, _direction(direction) if direction is not None else "no")
    if device.clock_sources:
        table.add("soapy.clock_source", ", ".join(device.clock_sources))
    modem = f"modem.rate_hz = {rate_hz:g}" + (
        f", modem.oversampling = {ahead.oversampling}" if ahead.oversampling > 1 else ""
    )
    table.add("with " + modem, ahead.how)
    if device.tx is not None:
        turn = f" + turnaround {1e3 * ahead.turnaround_s:.3g} ms" if ahead.turnaround_s else ""
        table.add(
            "expected latency",
            f"{1e3 * ahead.latency_s:.3g} ms plus airtime: lead {1e3 * ahead.lead_s:.3g} ms{turn} "
            f"+ receive blocks of {1e3 * ahead.piece_s:.3g} ms",
        )
    for warning in ahead.warnings:
        table.add("warning", warning)
    return table


def _direction(can: "DirectionProbe") -> str:
    gains = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in can.gains_db.items())
    return (
        f"{_spans(can.rates_hz)} Msps, {_spans(can.frequencies_hz)} MHz\n"
        f"gain {can.gain_db.low:g} to {can.gain_db.high:g} dB ({gains or 'no elements'}); "
        f"antennas {', '.join(can.antennas) or 'one'}; transfers of {can.transfer} samples"
    )


def _spans(ranges: Sequence[tuple[float, float]]) -> str:
    parts = [
        f"{low / 1e6:g}" if low == high else f"{low / 1e6:g} to {high / 1e6:g}"
        for low, high in ranges
    ]
    return ", ".join([*parts[:4], f"and {len(parts) - 4} more"] if len(parts) > 5 else parts)
