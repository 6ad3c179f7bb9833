"""Sets a device and reads back what it made of it."""

import contextlib
from collections.abc import Iterator, Sequence

from backends.soapy.device import WAYS, Device
from backends.soapy.library import driver_of
from backends.soapy.settings import SettingError, SoapySettings
from backends.soapy.surface import RX, SAMPLE_BYTES, TX, DriverError, Range

RATE_TOLERANCE = 1e-3
"""OFDM bears far less between two robots, but both would be off alike."""
FREQUENCY_TOLERANCE_HZ = 1e3
LEAST_RATES = {"hackrf": 2e6}
"""Of drivers that claim to go slower, and do not."""


def least_rate_hz(args: str) -> float:
    """The slowest rate of the driver that device `args` name, as far as is known without it."""
    return LEAST_RATES.get(driver_of(args).lower(), 0.0)


def set_up(device: Device, settings: SoapySettings) -> dict[int, dict[str, float]]:
    """Everything but the streams; gains in force by direction. Raises SettingError, DriverError."""
    ways = [RX, TX] if settings.tx_enabled else [RX]
    if settings.clock_source:
        _among("clock_source", settings.clock_source, device.clock_sources())
        device.set_clock_source(settings.clock_source)
    for key, value in settings.settings.items():
        with blaming(f'soapy.settings.{key}: got "{value}"'):
            device.write_setting(key, value)
    for way in ways:
        _set_channel(device, settings, way)
        _set_antenna(device, settings, way)
        _set_rate(device, settings, way)
    # Frequencies when all rates are set: some drivers move the oscillator with the rate.
    for way in ways:
        _set_frequency(device, settings, way)
        if settings.bandwidth_hz:
            with blaming(f"soapy.bandwidth_hz: got {settings.bandwidth_hz:g}"):
                device.set_bandwidth(way, settings.channel, settings.bandwidth_hz)
        if settings.ppm:
            with blaming(f"soapy.ppm: got {settings.ppm:g}"):
                device.set_ppm(way, settings.channel, settings.ppm)
    return {way: _set_gains(device, settings, way) for way in ways}


def choose_format(device: Device, settings: SoapySettings, way: int) -> str:
    """The format of samples that costs least here. Raises SettingError."""
    offered = device.formats(way, settings.channel)
    for form in SAMPLE_BYTES:
        if form in offered:
            return form
    raise SettingError(
        f"soapy.device: this device's samples are of type {', '.join(offered) or 'none'}; allowed: "
        f"a device with {', '.join(SAMPLE_BYTES)}"
    )


def _set_channel(device: Device, settings: SoapySettings, way: int) -> None:
    n = device.channels(way)
    if settings.channel >= n:
        can = f"0 to {n - 1}" if n else f"a device that can do {WAYS[way]}: this one cannot"
        raise SettingError(f"soapy.channel: got {settings.channel} for {WAYS[way]}; allowed: {can}")


def _set_antenna(device: Device, settings: SoapySettings, way: int) -> None:
    name = settings.rx_antenna if way == RX else settings.tx_antenna
    if name:
        _among(f"{WAYS[way]}_antenna", name, device.antennas(way, settings.channel))
        with blaming(f'soapy.{WAYS[way]}_antenna: got "{name}"'):
            device.set_antenna(way, settings.channel, name)


def _set_rate(device: Device, settings: SoapySettings, way: int) -> None:
    wanted, offered = settings.rate_hz, device.rates(way, settings.channel)
    least = LEAST_RATES.get(device.driver.lower(), 0.0)
    allowed = f"{_ranges(offered, 1e6)} Msps" + (f", from {least / 1e6:g} on" if least else "")
    what = (
        f"modem.rate_hz: got {wanted / 1e6:g} Msps at the radio (modem.rate_hz × "
        "modem.oversampling)"
    )
    if wanted < least or (offered and not _inside(wanted, offered)):
        raise SettingError(f"{what}; allowed by this device: {allowed}")
    with blaming(what):
        got = device.set_rate(way, settings.channel, wanted)
    if abs(got / wanted - 1) > RATE_TOLERANCE:
        raise SettingError(
            f"{what}, and the device made it {got / 1e6:g} Msps for {WAYS[way]}; allowed: a rate "
            f"that it keeps: {allowed}"
        )


def _set_frequency(device: Device, settings: SoapySettings, way: int) -> None:
    wanted, offered = settings.frequency_hz, device.frequencies(way, settings.channel)
    what = f"modem.frequency_hz: got {wanted / 1e6:g} MHz at the radio's oscillator"
    if offered and not _inside(wanted, offered):
        raise SettingError(f"{what}; allowed by this device: {_ranges(offered, 1e6)} MHz")
    with blaming(what):
        got = device.set_frequency(way, settings.channel, wanted)
    if abs(got - wanted) > FREQUENCY_TOLERANCE_HZ:
        raise SettingError(f"{what}, and the device tuned {WAYS[way]} to {got / 1e6:.6f} MHz")


@contextlib.contextmanager
def blaming(what: str) -> Iterator[None]:
    """Where only the driver knows what is allowed, it says so itself."""
    try:
        yield
    except DriverError as error:
        raise SettingError(f"{what}; the device refuses it: {error}") from None


def _set_gains(device: Device, settings: SoapySettings, way: int) -> dict[str, float]:
    """In dB by element; "" for all together where only that was asked for."""
    name, channel = WAYS[way], settings.channel
    total = settings.rx_gain_db if way == RX else settings.tx_gain_db
    by_element = settings.rx_gains if way == RX else settings.tx_gains
    if way == TX and total is None and not by_element:
        raise SettingError(
            "soapy.tx_gain_db: not set; nothing is sent before it is: allowed by this device: "
            f"{_ranges([device.gain_range(way, channel)])} dB"
        )
    device.set_manual_gain(way, channel)
    elements = device.gains(way, channel)
    for element in by_element:
        _among(f"{name}_gains", element, elements)
    wanted = {**({} if total is None else {"": total}), **by_element}
    got = {}
    for element, gain_db in wanted.items():
        offered = device.gain_range(way, channel, element)
        key = f"{name}_gains.{element}" if element else f"{name}_gain_db"
        if not _inside(gain_db, [offered]):
            raise SettingError(
                f"soapy.{key}: got {gain_db:g} dB; allowed by this device: {_ranges([offered])} dB"
            )
        with blaming(f"soapy.{key}: got {gain_db:g} dB"):
            got[element] = device.set_gain(way, channel, element, gain_db)
    return got


def _among(key: str, given: str, offered: Sequence[str]) -> None:
    if given not in offered:
        allowed = ", ".join(f'"{each}"' for each in offered) or 'only ""'
        raise SettingError(f'soapy.{key}: got "{given}"; allowed by this device: {allowed}')


def _inside(value: float, ranges: Sequence[Range]) -> bool:
    slack = 1e-9 * abs(value)
    return any(low - slack <= value <= high + slack for low, high in ranges)


def _ranges(ranges: Sequence[Range], unit: float = 1.0) -> str:
    """`2, 4 to 20`."""
    return ", ".join(
        f"{low / unit:g}" if low == high else f"{low / unit:g} to {high / unit:g}"
        for low, high in ranges
    )
