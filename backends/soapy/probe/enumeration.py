"""What SoapySDR finds on this machine, device by device. Runs in its own process."""

from backends.soapy.binding import (
    RX,
    TX,
    Device,
    DriverError,
    Library,
    driver_of,
    has_module,
    load_library,
    no_radio,
    not_installed,
    why_not,
)
from backends.soapy.probe.report import DeviceProbe, DirectionProbe, ProbeReport


def enumerate_devices(args: str) -> ProbeReport:
    """Open each device that matches `args`, query its properties, and close it; "" matches all."""
    try:
        library = load_library()
    except DriverError as error:
        return ProbeReport(binding="", modules=[], devices=[], notes=[not_installed(error)])
    modules = library.modules()
    devices, notes = [], []
    if refused := no_radio(args):
        return ProbeReport(binding=library.detail, modules=modules, devices=[], notes=[refused])
    for found in library.enumerate(args):
        named = ",".join(
            f"{key}={value}"
            for key, value in found.items()
            if key != "label" and value and not set(value) & set(",=")
        )
        devices.append(_probe_device(library, named, found.get("label", "")))
    driver = driver_of(args)
    if not devices:
        notes.append(_why_none(library, args, driver))
    return ProbeReport(binding=library.detail, modules=modules, devices=devices, notes=notes)


def _why_none(library: Library, args: str, driver: str) -> str:
    if args:
        try:
            Device(library, args).close()
        except DriverError as error:
            return why_not(library, args, error)
    if driver and not has_module(library, driver):
        return f'SoapySDR has no driver "{driver}"'
    return (
        "no device found. Is it plugged in, and may you open it (udev rules)? Its driver module "
        "must be installed, too: soapysdr-module-hackrf, soapysdr-module-uhd, …"
    )


def _probe_device(library: Library, args: str, label: str) -> DeviceProbe:
    try:
        device = Device(library, args)
    except DriverError as error:
        return DeviceProbe(device=args, label=label, problem=why_not(library, args, error))
    try:
        return DeviceProbe(
            device=args,
            label=label,
            driver=device.driver,
            hardware=device.hardware,
            full_duplex=device.full_duplex(0),
            has_time=device.has_time(),
            clock_sources=device.clock_sources(),
            rx=_probe_direction(device, RX),
            tx=_probe_direction(device, TX),
        )
    except DriverError as error:
        return DeviceProbe(device=args, label=label, problem=str(error))
    finally:
        device.close()


def _probe_direction(device: Device, direction: int) -> DirectionProbe | None:
    if not device.channels(direction):
        return None
    formats = device.formats(direction, 0)
    stream = device.open_stream(direction, 0, "CF32", {})
    transfer = stream.mtu
    stream.close()
    return DirectionProbe(
        rates_hz=device.rates(direction, 0),
        frequencies_hz=device.frequencies(direction, 0),
        gain_db=device.gain_range(direction, 0),
        gains_db={
            name: device.gain_range(direction, 0, name) for name in device.gains(direction, 0)
        },
        antennas=device.antennas(direction, 0),
        formats=formats,
        transfer=transfer,
    )
