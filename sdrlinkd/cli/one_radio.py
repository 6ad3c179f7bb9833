"""The radio of a command that needs no daemon, from a configuration or from options."""

import math
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated, NamedTuple

import typer
from msgspec.structs import replace

from backends import SoapyParams
from sdrlinkd.config import Config, ModemParams, load_config, make_setup
from sdrlinkd.errors import UserError
from sdrlinkd.units import hertz

MOST_GAIN_DB = 200


def _between(option: str, least: int, most: int) -> Callable[[str], float]:
    """A parser of a frequency or rate in Hz, from `least` to `most`."""

    def read(text: str) -> float:
        try:
            value = hertz(text, option)
        except UserError:
            value = math.nan
        if not least <= value <= most:
            raise UserError(
                f"{option}: got {text}; allowed: {least} to {most}, or with a unit, such as 2 MHz"
            )
        return value

    return read


class Factor(StrEnum):
    """Ratio of the radio's sample rate to the modem's."""

    ONE = "1"
    TWO = "2"
    FOUR = "4"


ConfigFile = Annotated[
    Path | None,
    typer.Option("--config", metavar="FILE", help="Use the radio of this daemon configuration."),
]
Device = Annotated[
    str,
    typer.Option(metavar="ARGS", help='Use this SoapySDR device, such as "driver=hackrf".'),
]
Frequency = Annotated[
    float | None,
    typer.Option(
        metavar='"433.92 MHz"',
        parser=_between("--frequency", 1, 10**11),
        help="With --device: centre frequency, in Hz or with a unit.",
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(
        metavar='"2 Msps"',
        parser=_between("--rate", 10**4, 2 * 10**8),
        help="With --device: sample rate, in samples/s or with a unit.",
    ),
]
Oversampling = Annotated[
    Factor, typer.Option(help="With --device: its sample rate divided by --rate.")
]
Gain = Annotated[
    float | None,
    typer.Option(
        metavar="DB",
        min=-MOST_GAIN_DB,
        max=MOST_GAIN_DB,
        help="With --device: gain of all elements together.",
    ),
]
Gains = Annotated[
    str, typer.Option(metavar='"LNA=16,VGA=20"', help="With --device: gain of each element in dB.")
]
Antenna = Annotated[str, typer.Option(metavar="NAME", help="With --device: antenna port.")]


class NamedRadio(NamedTuple):
    """The radio as given on the command line."""

    config: Path | None
    device: str
    frequency_hz: float | None
    rate_hz: float | None
    oversampling: Factor
    gain_db: float | None
    gains: str
    antenna: str


class OneRadio(NamedTuple):
    """A configuration with a radio, and the id of its robot."""

    config: Config
    node_id: int


def receiving(named: NamedRadio) -> OneRadio:
    """The radio that the command line names, for receiving only. Raises UserError."""
    _refuse_none(named)
    if named.config is None:
        soapy = SoapyParams(
            device=named.device,
            rx_gain_db=named.gain_db,
            rx_gains=_by_element(named.gains),
            rx_antenna=named.antenna,
        )
        return OneRadio(_by_itself(named, soapy), 0)
    found = _of_daemon(named.config, named, tx_enabled=False)
    iqfile = replace(found.config.iqfile, transmit="")
    return found._replace(config=replace(found.config, iqfile=iqfile))


def sending(named: NamedRadio, transmit: bool) -> OneRadio:
    """The radio that the command line names, for sending. Raises UserError.

    Either `transmit` or the configuration must allow sending.
    """
    _refuse_none(named)
    if named.config is not None:
        found = _of_daemon(named.config, named, tx_enabled=transmit or None)
        if found.config.backend == "soapy" and not found.config.soapy.tx_enabled:
            raise _unasked(f"--transmit, or soapy.tx_enabled = true in {named.config}")
        return found._replace(config=_deaf_between_bursts(found.config))
    if not transmit:
        raise _unasked("--transmit, once frequency, gain and antenna are right")
    gains = _by_element(named.gains)
    if named.gain_db is None and not gains:
        raise UserError(
            "--gain: not given, and replay needs it to transmit; allowed: a gain in dB, or "
            '--gains "ELEMENT=DB,…"; start low; `sdrlinkctl radio probe` shows the range'
        )
    soapy = SoapyParams(
        device=named.device,
        tx_enabled=True,
        tx_gain_db=named.gain_db,
        tx_gains=gains,
        tx_antenna=named.antenna,
    )
    return OneRadio(_deaf_between_bursts(_by_itself(named, soapy)), 0)


def _refuse_none(named: NamedRadio) -> None:
    if named.config is None and not named.device:
        raise UserError(
            "no radio given; allowed: --config FILE, or --device ARGS with --frequency and "
            "--rate; `sdrlinkctl radio probe` lists the attached radios"
        )


def _unasked(allowed: str) -> UserError:
    return UserError(f"replay has no permission to transmit; allowed: {allowed}")


def _of_daemon(path: Path, named: NamedRadio, tx_enabled: bool | None) -> OneRadio:
    """The radio of a daemon's configuration; `tx_enabled` None: as configured."""
    for option, key, value in (
        ("--device", "soapy.device", named.device),
        ("--frequency", "modem.frequency_hz", named.frequency_hz),
        ("--rate", "modem.rate_hz", named.rate_hz),
        ("--oversampling", "modem.oversampling", "" if named.oversampling is Factor.ONE else "2"),
        ("--gain", "[soapy]", named.gain_db),
        ("--gains", "[soapy]", named.gains),
        ("--antenna", "[soapy]", named.antenna),
    ):
        if value is not None and value != "":
            raise UserError(f"{option}: given with --config; allowed: {key} in {path}")
    config = load_config(path)
    if tx_enabled is not None:
        config = replace(config, soapy=replace(config.soapy, tx_enabled=tx_enabled))
    setup = make_setup(config, path.parent, str(path))
    return OneRadio(setup.config, setup.node_id)


def _by_itself(named: NamedRadio, soapy: SoapyParams) -> Config:
    rate_hz = _given(named.rate_hz, "--rate", "samples a second, such as 2e6")
    frequency_hz = _given(named.frequency_hz, "--frequency", "Hz, such as 433.5e6")
    factor = named.oversampling
    modem = ModemParams(
        rate_hz=rate_hz,
        frequency_hz=frequency_hz,
        oversampling=4 if factor is Factor.FOUR else 2 if factor is Factor.TWO else 1,
    )
    return Config(backend="soapy", modem=modem, soapy=soapy)


def _deaf_between_bursts(config: Config) -> Config:
    """The configuration without listening, which a half-duplex radio does not need in a replay."""
    return replace(config, soapy=replace(config.soapy, longest_tx_s=10.0, listen_s=0.0))


def _given(value: float | None, option: str, allowed: str) -> float:
    if value is None:
        raise UserError(f"{option}: not given; allowed with --device: {allowed}")
    return value


def _by_element(text: str) -> dict[str, float]:
    found = {}
    for part in text.split(",") if text else []:
        element, is_there, number = part.partition("=")
        try:
            gain_db = float(number)
        except ValueError:
            gain_db = math.nan
        if not (element.strip() and is_there and abs(gain_db) <= MOST_GAIN_DB):
            raise UserError(
                f'--gains: got "{part}"; allowed: ELEMENT=DB, such as "LNA=16,VGA=20"; '
                "`sdrlinkctl radio probe` shows the elements"
            )
        found[element.strip()] = gain_db
    return found
