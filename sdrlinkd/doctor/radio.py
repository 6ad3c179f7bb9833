"""Checks the radio: whether it is present and supports the configuration."""

from collections.abc import Iterable
from pathlib import Path

from backends import (
    BUILT_IN,
    DeviceProbe,
    DirectionProbe,
    ProbeReport,
    hub_of,
    is_listening,
)
from sdrlinkd.config import WITHOUT_AIR, Config
from sdrlinkd.doctor.finding import Finding, bad, good, good_if, none

LISTENERS = ("csma", "minislot")
"""Access policies that depend on hearing others start."""


def check_radio(config: Config | None, found: ProbeReport | None) -> list[Finding]:
    """Findings on whether the radio is present and supports the configuration.

    `config` is None to list only what is present. `found` is SoapySDR's probe of the configured
    device or of all devices; None if no radio is to be checked.
    """
    if config is not None and config.backend != "soapy":
        return [_without(config)]
    if found is None:
        return [none("radio", "not checked")]
    is_needed = config is not None
    if not found.binding:
        told = "; ".join(found.notes)
        to_do = "apt-get install libsoapysdr0.8 soapysdr-tools, and the radio's soapysdr-module-…"
        return [bad("SoapySDR", told, to_do) if is_needed else none("SoapySDR", told)]
    findings = [good("SoapySDR", f"{found.binding}; {found.drivers}")]
    if not found.devices:
        told = "; ".join(found.notes) or "no device was found"
        wanted = "plug it in, or install its driver module; see the lines above"
        return [*findings, bad("device", told, wanted) if is_needed else none("device", told)]
    for device in found.devices:
        findings += _of_device(device, config)
    return findings


def _without(config: Config) -> Finding:
    if config.backend == "ether":
        hub = hub_of(config.ether)
        return good_if(
            is_listening(hub), "hub of the air", hub.name,
            f"no hub runs there; start one: {hub.start}",
        )  # fmt: skip
    if config.backend == "iqfile" and config.iqfile.receive:
        path = Path(config.iqfile.receive)
        is_there = any(Path(f"{path}{end}").is_file() for end in ("", ".sigmf-meta"))
        return good_if(
            is_there, "recording", str(path), "set iqfile.receive to an existing recording"
        )
    if config.backend in BUILT_IN or config.backend in WITHOUT_AIR:
        return none("radio", f'backend = "{config.backend}" uses none')
    return none("radio", f'backend = "{config.backend}" belongs to another package: not checked')


def _of_device(device: DeviceProbe, config: Config | None) -> list[Finding]:
    if device.problem:
        return [bad("device", f'"{device.device}": {device.problem}', "fix what the message says")]
    findings = [good("device", f"{device.driver} {device.hardware}, {_duplex(device)}")]
    if config is None:
        return findings
    modem, soapy = config.modem, config.soapy
    directions = [("receives", device.rx)] + [("sends", device.tx)] * soapy.tx_enabled
    for name, direction in directions:
        if direction is None:
            key = "soapy.tx_enabled = false" if name == "sends" else "another device"
            findings.append(bad(f"device {name}", "no", key))
            continue
        findings += _of_direction(
            name, direction, modem.rate_hz * modem.oversampling, modem.frequency_hz,
            soapy.tx_gains if name == "sends" else soapy.rx_gains,
            soapy.tx_gain_db if name == "sends" else soapy.rx_gain_db,
            soapy.tx_antenna if name == "sends" else soapy.rx_antenna,
        )  # fmt: skip
    if not soapy.tx_enabled:
        findings.append(none("device sends", "soapy.tx_enabled = false: this robot only receives"))
    policy = config.access.policy
    if policy in LISTENERS and not device.full_duplex:
        findings.append(
            bad(
                "access.policy", f'"{policy}" must hear other robots\' bursts begin, and this '
                "radio is half duplex", 'access.policy = "tdma" at all robots, with slots of 0.3 s',
            )
        )  # fmt: skip
    return findings


def _of_direction(
    name: str, can: DirectionProbe, rate_hz: float, frequency_hz: float, gains: dict[str, float],
    total_db: float | None, antenna: str,
) -> list[Finding]:  # fmt: skip
    findings = [
        good_if(
            _within(rate_hz, can.rates_hz), f"{name} at", f"{rate_hz / 1e6:g} Msps",
            f"modem.rate_hz × modem.oversampling: {_spans(can.rates_hz)} Msps",
        ),
        good_if(
            _within(frequency_hz, can.frequencies_hz), f"{name} on", f"{frequency_hz / 1e6:g} MHz",
            f"modem.frequency_hz: {_spans(can.frequencies_hz)} MHz",
        ),
    ]  # fmt: skip
    wanted = {} if total_db is None else {"all together": total_db}
    for element, gain_db in (wanted | gains).items():
        offered = can.gain_db if element == "all together" else can.gains_db.get(element)
        what = f"{name} with {element}"
        if offered is None:
            findings.append(bad(what, "no such gain", f"one of {', '.join(can.gains_db)}"))
            continue
        low, high = offered
        findings.append(
            good_if(low <= gain_db <= high, what, f"{gain_db:g} dB", f"{low:g} to {high:g} dB")
        )
    if antenna:
        findings.append(
            good_if(
                antenna in can.antennas,
                f"{name} by",
                antenna,
                f"one of {', '.join(can.antennas)}",
            )
        )
    return findings


def _duplex(device: DeviceProbe) -> str:
    if not device.full_duplex:
        return "half duplex"
    return "full duplex" + (", keeps time" if device.has_time else "")


def _within(value: float, ranges: Iterable[tuple[float, float]]) -> bool:
    slack = 1e-9 * abs(value)
    return any(low - slack <= value <= high + slack for low, high in ranges)


def _spans(ranges: Iterable[tuple[float, float]]) -> str:
    parts = [f"{low / 1e6:g} to {high / 1e6:g}" for low, high in ranges]
    return ", ".join([*parts[:3], "…"] if len(parts) > 4 else parts)
