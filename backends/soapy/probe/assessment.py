"""How a daemon would drive a device, derived from the device's own data."""

from typing import NamedTuple

from backends.soapy.binding import Range
from backends.soapy.probe.report import DeviceProbe
from backends.soapy.settings import SoapySettings, in_flight, profile_of

FACTORS = (1, 2, 4)
"""The allowed values of modem.oversampling."""
LONG_PIECE_S = 0.02


class _ProbedTx(NamedTuple):
    """The properties of a probed device that decide how it sends bursts; see TxHardware."""

    has_time: bool
    full_duplex: bool
    tx_transfer_s: float
    in_flight: int


class Assessment(NamedTuple):
    """How a daemon would drive a device with a modem of `rate_hz`; times in s.

    `piece_s` is the length of the pieces in which samples come.
    """

    how: str
    rate_hz: float
    oversampling: int
    piece_s: float
    lead_s: float
    turnaround_s: float
    warnings: list[str]

    @property
    def latency_s(self) -> float:
        """Delay from the decision to send to the far end's receiver, without the airtime."""
        return self.lead_s + self.turnaround_s + self.piece_s


def assess_device(device: DeviceProbe, rate_hz: float) -> Assessment:
    """How a daemon whose modem runs at `rate_hz` would drive the device."""
    rx, tx, defaults = device.rx, device.tx, SoapySettings(device="", rate_hz=0, frequency_hz=0)
    least = profile_of(device.driver).least_rate_hz
    directions = [direction for direction in (rx, tx) if direction is not None]
    fitting = [
        factor
        for factor in FACTORS
        if all(_offers(direction.rates_hz, factor * rate_hz, least) for direction in directions)
    ]
    # A device without time stamps has no calibrated front end either, so use offset tuning.
    wished = [factor for factor in fitting if factor > 1 or device.has_time] or fitting
    factor = wished[0] if wished else 1
    radio_hz = factor * rate_hz
    piece_s = max(defaults.block_s, rx.transfer / radio_hz if rx else 0.0)
    transfer_s = tx.transfer / radio_hz if tx else 0.0
    hardware = _ProbedTx(
        device.has_time, device.full_duplex, transfer_s, in_flight(defaults, device.driver)
    )
    timing = defaults.tx_timing(hardware)
    return Assessment(
        how=_how(device),
        rate_hz=rate_hz,
        oversampling=factor,
        piece_s=piece_s,
        lead_s=timing.lead_s if tx else 0.0,
        turnaround_s=timing.turnaround_s if tx else 0.0,
        warnings=_warnings(device, rate_hz, bool(fitting), least, piece_s, transfer_s),
    )


def _how(device: DeviceProbe) -> str:
    if device.rx is None:
        return "unusable: it does not receive"
    if device.tx is None:
        return "receives only"
    if not device.full_duplex:
        return "half duplex: receives, and sends in TX windows in between"
    if device.has_time:
        return "full duplex; the device times the bursts"
    return "full duplex; bursts are timed by counting samples"


def _warnings(
    device: DeviceProbe, rate_hz: float, fits: bool, least: float, piece_s: float,
    transfer_s: float,
) -> list[str]:  # fmt: skip
    found = []
    if not fits:
        slowest = f" (this driver: at least {least / 1e6:g} Msps)" if least else ""
        found.append(
            f"modem.rate_hz = {rate_hz:g} fits with no oversampling of 1, 2 or 4{slowest}: "
            "choose another rate"
        )
    if device.tx is not None and not device.full_duplex:
        found.append(
            "bursts received while it sends are lost, and each turnaround takes tens of ms: "
            'throughput is good one way, poor both ways; use access.policy "tdma" with slots of '
            "300 ms or more, or send in one direction only"
        )
    if not device.has_time:
        found.append(
            f"no time stamps: sample times, other robots' clocks and ages are accurate only to "
            f"{1e3 * piece_s:.3g} ms"
        )
    if transfer_s > LONG_PIECE_S:
        found.append(
            f"it moves transfers of {1e3 * transfer_s:.3g} ms at this rate: a faster radio "
            "(modem.oversampling = 4, or a higher modem.rate_hz) shortens them"
        )
    return found


def _offers(ranges: list[Range], rate_hz: float, least: float) -> bool:
    return rate_hz >= least and any(low <= rate_hz <= high for low, high in ranges)
