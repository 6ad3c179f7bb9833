"""In a process of its own: what SoapySDR finds, as a line of JSON."""

import sys

import msgspec

from backends.soapy.device import Device
from backends.soapy.library import (
    driver_of,
    has_module,
    load_library,
    no_radio,
    not_installed,
    why_not,
)
from backends.soapy.surface import RX, TX, DriverError, Library
from backends.soapy.survey import DeviceSurvey, Survey, WaySurvey


def _look(args: str) -> Survey:
    try:
        library = load_library()
    except DriverError as error:
        return Survey(binding="", modules=[], devices=[], notes=[not_installed(error)])
    modules = library.modules()
    devices, notes = [], []
    if refused := no_radio(args):
        return Survey(binding=library.detail, modules=modules, devices=[], notes=[refused])
    for found in library.enumerate(args):
        named = ",".join(
            f"{key}={value}"
            for key, value in found.items()
            if key != "label" and value and not set(value) & set(",=")
        )
        devices.append(_look_at(library, named, found.get("label", "")))
    driver = driver_of(args)
    if not devices:
        notes.append(_nothing(library, args, driver))
    return Survey(binding=library.detail, modules=modules, devices=devices, notes=notes)


def _nothing(library: Library, args: str, driver: str) -> str:
    if args:
        try:
            Device(library, args).close()
        except DriverError as error:
            return why_not(library, args, error)
    if driver and not has_module(library, driver):
        return f'SoapySDR has no driver "{driver}"'
    return (
        "no device was found. Plugged in, and allowed (udev rules)? A radio's own module must be "
        "installed, too: soapysdr-module-hackrf, soapysdr-module-uhd, …"
    )


def _look_at(library: Library, args: str, label: str) -> DeviceSurvey:
    try:
        device = Device(library, args)
    except DriverError as error:
        return DeviceSurvey(device=args, label=label, problem=why_not(library, args, error))
    try:
        return DeviceSurvey(
            device=args,
            label=label,
            driver=device.driver,
            hardware=device.hardware,
            full_duplex=device.full_duplex(0),
            has_time=device.has_time(),
            clock_sources=device.clock_sources(),
            rx=_way(device, RX),
            tx=_way(device, TX),
        )
    except DriverError as error:
        return DeviceSurvey(device=args, label=label, problem=str(error))
    finally:
        device.close()


def _way(device: Device, way: int) -> WaySurvey | None:
    if not device.channels(way):
        return None
    formats = device.formats(way, 0)
    stream = device.open_stream(way, 0, "CF32", {})
    transfer = stream.mtu
    stream.close()
    return WaySurvey(
        rates_hz=device.rates(way, 0),
        frequencies_hz=device.frequencies(way, 0),
        gain_db=device.gain_range(way, 0),
        gains_db={name: device.gain_range(way, 0, name) for name in device.gains(way, 0)},
        antennas=device.antennas(way, 0),
        formats=formats,
        transfer=transfer,
    )


if __name__ == "__main__":
    sys.stdout.buffer.write(b"\n" + msgspec.json.encode(_look(sys.argv[1])) + b"\n")
