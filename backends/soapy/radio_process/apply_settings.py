"""Applies settings to a device and reads back what it made of them."""

import contextlib
from collections.abc import Iterator, Sequence

from backends.soapy.binding import DIRECTIONS, RX, SAMPLE_BYTES, TX, Device, DriverError, Range
from backends.soapy.settings import SettingError, SoapySettings, profile_of

RATE_TOLERANCE = 1e-3
"""Relative. OFDM tolerates far less between two robots, but both would be equally wrong."""
FREQUENCY_TOLERANCE_HZ = 1e3


def apply_settings(device: Device, settings: SoapySettings) -> dict[int, dict[str, float]]:
    """Apply all settings but the streams'; returns the gains in force by direction.

    Raises SettingError, DriverError.
    """
    directions = [RX, TX] if settings.tx_enabled else [RX]
    if settings.clock_source:
        _among("clock_source", settings.clock_source, device.clock_sources())
        device.set_clock_source(settings.clock_source)
    for key, value in settings.settings.items():
        with blaming(f'soapy.settings.{key}: got "{value}"'):
            device.write_setting(key, value)
    for direction in directions:
        _set_channel(device, settings, direction)
        _set_antenna(device, settings, direction)
        _set_rate(device, settings, direction)
    # Frequencies after all rates: in some drivers a new rate moves the oscillator.
    for direction in directions:
        _set_frequency(device, settings, direction)
        if settings.bandwidth_hz:
            with blaming(f"soapy.bandwidth_hz: got {settings.bandwidth_hz:g}"):
                device.set_bandwidth(direction, settings.channel, settings.bandwidth_hz)
        if settings.ppm:
            with blaming(f"soapy.ppm: got {settings.ppm:g}"):
                device.set_ppm(direction, settings.channel, settings.ppm)
    return {direction: _set_gains(device, settings, direction) for direction in directions}


def choose_format(device: Device, settings: SoapySettings, direction: int) -> str:
    """The cheapest sample format for us that the device offers. Raises SettingError."""
    offered = device.formats(direction, settings.channel)
    for form in SAMPLE_BYTES:
        if form in offered:
            return form
    raise SettingError(
        f"soapy.device: this device's samples are of type {', '.join(offered) or 'none'}; allowed: "
        f"a device with {', '.join(SAMPLE_BYTES)}"
    )


def _set_channel(device: Device, settings: SoapySettings, direction: int) -> None:
    n = device.channels(direction)
    if settings.channel >= n:
        can = (
            f"0 to {n - 1}" if n else f"a device with {DIRECTIONS[direction]}, which this one lacks"
        )
        raise SettingError(
            f"soapy.channel: got {settings.channel} for {DIRECTIONS[direction]}; allowed: {can}"
        )


def _set_antenna(device: Device, settings: SoapySettings, direction: int) -> None:
    name = settings.rx_antenna if direction == RX else settings.tx_antenna
    if name:
        _among(
            f"{DIRECTIONS[direction]}_antenna", name, device.antennas(direction, settings.channel)
        )
        with blaming(f'soapy.{DIRECTIONS[direction]}_antenna: got "{name}"'):
            device.set_antenna(direction, settings.channel, name)


def _set_rate(device: Device, settings: SoapySettings, direction: int) -> None:
    wanted, offered = settings.rate_hz, device.rates(direction, settings.channel)
    least = profile_of(device.driver).least_rate_hz
    allowed = f"{_ranges(offered, 1e6)} Msps" + (f", at least {least / 1e6:g}" if least else "")
    what = (
        f"modem.rate_hz: got {wanted / 1e6:g} Msps at the radio (modem.rate_hz × "
        "modem.oversampling)"
    )
    if wanted < least or (offered and not _inside(wanted, offered)):
        raise SettingError(f"{what}; allowed by this device: {allowed}")
    with blaming(what):
        got = device.set_rate(direction, settings.channel, wanted)
    if abs(got / wanted - 1) > RATE_TOLERANCE:
        raise SettingError(
            f"{what}, but the device chose {got / 1e6:g} Msps for {DIRECTIONS[direction]}; "
            f"allowed: a rate that it accepts: {allowed}"
        )


def _set_frequency(device: Device, settings: SoapySettings, direction: int) -> None:
    wanted, offered = settings.frequency_hz, device.frequencies(direction, settings.channel)
    what = f"modem.frequency_hz: got {wanted / 1e6:g} MHz at the radio's oscillator"
    if offered and not _inside(wanted, offered):
        raise SettingError(f"{what}; allowed by this device: {_ranges(offered, 1e6)} MHz")
    with blaming(what):
        got = device.set_frequency(direction, settings.channel, wanted)
    if abs(got - wanted) > FREQUENCY_TOLERANCE_HZ:
        raise SettingError(
            f"{what}, but the device tuned {DIRECTIONS[direction]} to {got / 1e6:.6f} MHz"
        )


@contextlib.contextmanager
def blaming(what: str) -> Iterator[None]:
    """Turn a driver's refusal into a SettingError that begins with `what`.

    If only the driver knows what is allowed, its own message says so.
    """
    try:
        yield
    except DriverError as error:
        raise SettingError(f"{what}; the device refuses it: {error}") from None


def _set_gains(device: Device, settings: SoapySettings, direction: int) -> dict[str, float]:
    """Set the gains of a direction; returns those in force, in dB by element.

    The element "" is the overall gain; it is present only if the settings include it.
    """
    name, channel = DIRECTIONS[direction], settings.channel
    total = settings.rx_gain_db if direction == RX else settings.tx_gain_db
    by_element = settings.rx_gains if direction == RX else settings.tx_gains
    if direction == TX and total is None and not by_element:
        raise SettingError(
            "soapy.tx_gain_db: not set, but required to transmit; allowed by this device: "
            f"{_ranges([device.gain_range(direction, channel)])} dB"
        )
    device.set_manual_gain(direction, channel)
    elements = device.gains(direction, channel)
    for element in by_element:
        _among(f"{name}_gains", element, elements)
    wanted = {**({} if total is None else {"": total}), **by_element}
    got = {}
    for element, gain_db in wanted.items():
        offered = device.gain_range(direction, channel, element)
        key = f"{name}_gains.{element}" if element else f"{name}_gain_db"
        if not _inside(gain_db, [offered]):
            raise SettingError(
                f"soapy.{key}: got {gain_db:g} dB; allowed by this device: {_ranges([offered])} dB"
            )
        with blaming(f"soapy.{key}: got {gain_db:g} dB"):
            got[element] = device.set_gain(direction, channel, element, gain_db)
    return got


def _among(key: str, given: str, offered: Sequence[str]) -> None:
    if given not in offered:
        allowed = ", ".join(f'"{each}"' for each in offered) or 'only ""'
        raise SettingError(f'soapy.{key}: got "{given}"; allowed by this device: {allowed}')


def _inside(value: float, ranges: Sequence[Range]) -> bool:
    slack = 1e-9 * abs(value)
    return any(low - slack <= value <= high + slack for low, high in ranges)


def _ranges(ranges: Sequence[Range], unit: float = 1.0) -> str:
    """The ranges in words, such as `2, 4 to 20`, each value divided by `unit`."""
    return ", ".join(
        f"{low / unit:g}" if low == high else f"{low / unit:g} to {high / unit:g}"
        for low, high in ranges
    )
